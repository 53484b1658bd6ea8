"""The ways home inside a mission, checked: from all of the leg from which each may be chosen.

The straight lines from a leg to where its way home begins fill a triangle, which has to keep what the leg has to keep, or what the leg itself keeps. What the
vehicle is predicted to drive is looked at from five places of the leg, at its course: between them nothing is promised but the drawn lines.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Protocol

from shapely import MultiPoint

from missions.checking.home_part import home_parts
from missions.geo import LatLon, bearing_deg
from missions.items import Command, change_speed
from missions.situation import Known, Mission, Pose
from missions.words import metres

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from missions.checking.execution import CourseLeg
    from missions.checking.home_part import HomePart
    from missions.ground.ground import Ground
    from missions.request import Request
    from missions.situation import Situation

    Check = Callable[[Mission, Situation, Request], "Drive"]

_SHARES = (0.0, 0.25, 0.5, 0.75, 1.0)
"""Of a leg, where it is looked at what the vehicle is predicted to drive. Chosen."""

_TOLERANCE_M = 0.02
"""Rounding to degE7 moves each of a triangle's corners by up to 8 mm."""


class Leg(Protocol):
    """What is read of a checked leg."""

    @property
    def leg(self) -> CourseLeg: ...  # noqa: D102 - as `CheckedLeg`
    @property
    def asked_m(self) -> float: ...  # noqa: D102
    @property
    def driven_clearance_m(self) -> float: ...  # noqa: D102
    @property
    def fence(self) -> str | None: ...  # noqa: D102


class Drive(Protocol):
    """What is read of a checked mission, which stands above this module."""

    @property
    def mission(self) -> Mission: ...  # noqa: D102 - as `MissionCheck`
    @property
    def ground(self) -> Ground: ...  # noqa: D102
    @property
    def legs(self) -> Sequence[Leg]: ...  # noqa: D102
    @property
    def broken(self) -> Sequence[Leg]: ...  # noqa: D102
    @property
    def troubles(self) -> Sequence[str]: ...  # noqa: D102
    @property
    def driven_clearance_m(self) -> float: ...  # noqa: D102
    @property
    def length_m(self) -> float: ...  # noqa: D102
    @property
    def duration_s(self) -> float: ...  # noqa: D102
    @property
    def path(self) -> tuple[LatLon, ...]: ...  # noqa: D102


@dataclass(frozen=True, slots=True)
class CheckedWay:
    """A way home inside a mission, from the leg from which it may be chosen.

    Parameters
    ----------
    part : HomePart
        Which.
    length_m, time_s : float
        From the end of the leg, as it is predicted to be driven.
    driven_clearance_m : float
        The least that the vehicle is predicted to keep, from any of the places that were looked at.
    path : tuple of LatLon
        From the end of the leg.
    trouble : str
        Why it is not safe; empty where it is.
    """

    part: HomePart
    length_m: float
    time_s: float
    driven_clearance_m: float
    path: tuple[LatLon, ...]
    trouble: str = ""

    def __str__(self) -> str:
        return f"the way home from the leg to item {self.part.leg_item} (choose item {self.part.item})"


def checked_ways(
    found: Drive, situation: Situation, request: Request, check: Check
) -> tuple[CheckedWay, ...]:
    """Check each way home inside a mission.

    Parameters
    ----------
    found : MissionCheck
        The mission, and what its drive keeps.
    situation, request
        As `missions.checking.check.check_mission`, which ``check`` is.
    """
    return tuple(
        checked_way(part, leg.leg, leg.asked_m, found, situation, request, check)
        for part in home_parts(found.mission.items)
        for leg in found.legs
        if leg.leg.last_item == part.leg_item
    )


def checked_way(
    part: HomePart,
    leg: CourseLeg,
    asked_m: float,
    found: Drive,
    situation: Situation,
    request: Request,
    check: Check,
) -> CheckedWay:
    """Check a way home from a leg, whose drawn line keeps ``asked_m`` or less."""
    heading_deg = bearing_deg(leg.start, leg.end)
    items = part.items
    if leg.speed_mps is not None and items[0].command != Command.DO_CHANGE_SPEED:
        items = (change_speed(leg.speed_mps), *items)
    troubles, least_m = [], float("inf")
    for share in _SHARES:
        place = LatLon(*(a + (b - a) * share for a, b in zip(leg.start, leg.end, strict=True)))
        pose = Known(Pose(place, heading_deg), None, "on the way")
        # Nobody knows here how fast it is, or which way it turned: it is taken to stand, looking along the leg.
        way = check(
            Mission(items, found.mission.home), replace(situation, pose=pose), replace(request, start=place)
        )
        least_m = min(least_m, way.driven_clearance_m)
        troubles += [
            f"from {share:.0%} of the leg it comes within {one.driven_clearance_m:.2f} m of {one.fence or 'a fence'} while driving; "
            f"{metres(one.asked_m)} is required"
            for one in way.broken
        ]
        troubles += way.troubles
    if trouble := _triangle_trouble(part, leg, asked_m, found):
        troubles.insert(0, trouble)
    return CheckedWay(part, way.length_m, way.duration_s, least_m, way.path, troubles[0] if troubles else "")


def _triangle_trouble(part: HomePart, leg: CourseLeg, asked_m: float, found: Drive) -> str:
    """Return what is wrong with the straight lines from a leg to where its way home begins; empty where nothing is."""
    ground = found.ground
    first = next((item.position for item in part.items if item.is_placed), None)
    if first is None:
        return "it leads to no place"
    corners = ground.frame.to_local_array([leg.start, leg.end, first])
    kept_m = ground.clearance_m(MultiPoint(corners).convex_hull)
    needed_m = min(asked_m, ground.clearance_m(MultiPoint(corners[:2]).convex_hull))
    if kept_m >= needed_m - _TOLERANCE_M and ground.allowed.covers(MultiPoint(corners).convex_hull):
        return ""
    nearest, _ = ground.nearest(MultiPoint(corners).convex_hull)
    return (
        f"a straight line from the leg to item {part.item} comes within {kept_m:.2f} m of {nearest.name if nearest else 'a fence'}; "
        f"{metres(needed_m)} is required"
    )
