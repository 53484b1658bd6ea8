"""Rally points: the places that RTL may lead to, and the mission items that carry them."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

from missions.geo import LatLon, to_e7
from missions.items import Command, CoordinateFrame, MissionItem

_RELATIVE_FRAMES = (CoordinateFrame.GLOBAL_RELATIVE_ALT, CoordinateFrame.GLOBAL_RELATIVE_ALT_INT)


class RallyPoint(NamedTuple):
    """A place that RTL may lead to, with its altitude above home: nothing to a rover, but part of the list.

    Parameters
    ----------
    lat_deg, lon_deg : float
        Where it is, decimal degrees.
    alt_m : float
        Metres above home.
    """

    lat_deg: float
    lon_deg: float
    alt_m: float = 0.0

    @property
    def position(self) -> LatLon:
        """Where it is."""
        return LatLon(self.lat_deg, self.lon_deg)


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
        for lat_e7, lon_e7 in (to_e7(point.position),)
    )
