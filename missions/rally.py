"""Rally points: the places that RTL may lead to, and the mission items that carry them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Self

from missions.geo import LatLon, to_e7
from missions.items import Command, CoordinateFrame, MissionItem

if TYPE_CHECKING:
    from collections.abc import Iterable

_RELATIVE_FRAMES = (CoordinateFrame.GLOBAL_RELATIVE_ALT, CoordinateFrame.GLOBAL_RELATIVE_ALT_INT)


class RallyPoint(LatLon):
    """A place that RTL may lead to, with its altitude above home: nothing to a rover, but part of the list.

    Parameters
    ----------
    lat_deg, lon_deg : float
        Where it is, decimal degrees.
    alt_m : float
        Metres above home.
    """

    alt_m: float = 0.0

    def __new__(cls, lat_deg: float, lon_deg: float, alt_m: float = 0.0) -> Self:
        """Return a place with its altitude."""
        point = super().__new__(cls, lat_deg, lon_deg)
        point.alt_m = alt_m
        return point

    def __eq__(self, other: object) -> bool:
        """Return whether places, and for rally points also the altitudes, are equal."""
        return tuple.__eq__(self, other) is True and getattr(other, "alt_m", self.alt_m) == self.alt_m

    def __ne__(self, other: object) -> bool:
        """Return whether they are unequal."""
        return not self == other

    __hash__ = tuple.__hash__


def rally_from_items(items: Iterable[MissionItem]) -> tuple[RallyPoint, ...]:
    """Return the rally points in mission items; an altitude that is not above home is left out."""
    return tuple(
        RallyPoint(*item.position, item.alt_m if item.frame in _RELATIVE_FRAMES else 0.0) for item in items
    )


def rally_to_items(points: Iterable[RallyPoint]) -> tuple[MissionItem, ...]:
    """Return rally points as mission items, in the frame in which ArduPilot reads them back."""
    return tuple(
        MissionItem(
            Command.RALLY_POINT,
            CoordinateFrame.GLOBAL_RELATIVE_ALT,
            lat_e7=lat_e7,
            lon_e7=lon_e7,
            alt_m=point.alt_m,
        )
        for point in points
        for lat_e7, lon_e7 in (to_e7(point),)
    )
