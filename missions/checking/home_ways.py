"""The ways home inside a mission, checked: from all of the leg from which each may be chosen.

Chosen in AUTO, while the vehicle drives, a way begins where the vehicle could stop (AR_WPNav.cpp, ``get_stopping_location``): straight ahead of it, by its
speed. The straight lines from the leg, and from all such places, to where the way begins fill triangles, which have to keep what the leg has to keep, or what the leg itself
keeps. What the vehicle is predicted to drive is looked at from five of these places, as from a stand at the leg's course: between them nothing is promised
but the drawn lines.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise
from typing import TYPE_CHECKING, Protocol

import numpy as np
import shapely
from shapely import LineString

from missions.checking.home_part import home_parts
from missions.drive_model.stopping import motion
from missions.geo import LocalPoint, bearing_deg
from missions.items import Command, change_speed
from missions.situation import Known, Mission, Pose
from missions.words import metres

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

    from missions.checking.execution import CourseLeg
    from missions.checking.home_part import HomePart
    from missions.drive_model import Envelope
    from missions.geo import LatLon
    from missions.ground.ground import Ground
    from missions.request import Request
    from missions.situation import Situation
    from missions.vehicle import Vehicle

    Check = Callable[[Mission, Situation, Request], "KeptDrive"]

_PLACES = 5
"""Of a leg, from where it is looked at what the vehicle is predicted to drive. Chosen."""

_BESIDE_M, _ALONG = 2.0, 0.7
"""A vehicle is on a leg within so many metres of its line, with such a share of its speed along it: at corners it is on both. Chosen."""

_TOLERANCE_M = 0.02
"""Rounding to degE7 moves each of a triangle's corners by up to 8 mm."""


class KeptLeg(Protocol):
    """What is read of a checked leg."""

    @property
    def leg(self) -> CourseLeg: ...  # noqa: D102 - as `CheckedLeg`
    @property
    def asked_m(self) -> float: ...  # noqa: D102
    @property
    def driven_clearance_m(self) -> float: ...  # noqa: D102
    @property
    def fence(self) -> str | None: ...  # noqa: D102


class KeptDrive(Protocol):
    """What is read of a checked mission, which stands above this module."""

    @property
    def mission(self) -> Mission: ...  # noqa: D102 - as `MissionCheck`
    @property
    def ground(self) -> Ground: ...  # noqa: D102
    @property
    def vehicle(self) -> Vehicle: ...  # noqa: D102
    @property
    def envelope(self) -> Envelope: ...  # noqa: D102
    @property
    def legs(self) -> Sequence[KeptLeg]: ...  # noqa: D102
    @property
    def broken(self) -> Sequence[KeptLeg]: ...  # noqa: D102
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
    found: KeptDrive, situation: Situation, request: Request, check: Check
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
    found: KeptDrive,
    situation: Situation,
    request: Request,
    check: Check,
) -> CheckedWay:
    """Check a way home from a leg, whose drawn line keeps ``asked_m`` or less."""
    items = part.items
    if leg.speed_mps is not None and items[0].command != Command.DO_CHANGE_SPEED:
        items = (change_speed(leg.speed_mps), *items)
    least_m = float("inf")
    ways: list[KeptDrive] = []
    stops, headings_deg = _stops(leg, found)
    trouble = _triangle_trouble(part, leg, asked_m, found, stops)
    some = np.unique(np.linspace(0, len(stops) - 1, _PLACES).astype(int))
    for number in reversed(some.tolist()):  # the last tells how long the way is from the leg's end
        place = found.ground.frame.to_lat_lon(LocalPoint(*stops[number].tolist()))
        pose = Known(Pose(place, float(headings_deg[number])), None, "on the way")
        way = check(
            Mission(items, found.mission.home), replace(situation, pose=pose), replace(request, start=place)
        )
        ways.append(way)
        least_m = min(least_m, way.driven_clearance_m)
        trouble = trouble or _drive_trouble(way, place)
        if trouble:  # one is enough, and each place costs a check
            break
    first = ways[0]
    return CheckedWay(part, first.length_m, first.duration_s, least_m, first.path, trouble)


def _drive_trouble(way: KeptDrive, place: LatLon) -> str:
    """Return what is wrong with a way from a place as it is predicted to be driven; empty where nothing is."""
    for one in way.broken:
        near = f"{one.driven_clearance_m:.2f} m of {one.fence or 'a fence'}"
        return f"from {place} it comes within {near} while driving; {metres(one.asked_m)} is required"
    return next(iter(way.troubles), "")


def _triangle_trouble(
    part: HomePart, leg: CourseLeg, asked_m: float, found: KeptDrive, stops: NDArray[np.float64]
) -> str:
    """Return what is wrong with the straight lines from a leg to where its way home begins; empty where nothing is."""
    ground = found.ground
    first = next((item.position for item in part.items if item.is_placed), None)
    if first is None:
        return "it leads to no place"
    line = ground.frame.to_local_array([leg.start, leg.end])
    goal = ground.frame.to_local_array([first])[0]
    # From one place to the next the lines to the goal fill a triangle; all together they need not be convex.
    corners = np.array([(p, q, goal) for places in (line, stops) for p, q in pairwise(places)])
    points = shapely.multipoints(corners.reshape(-1, 2), indices=np.repeat(np.arange(len(corners)), 3))
    hulls = np.asarray(shapely.convex_hull(points))
    needed_m = min(asked_m, ground.clearance_m(LineString(line)))
    away_m = np.full(len(hulls), np.inf) if ground.edge.is_empty else shapely.distance(hulls, ground.edge)
    away_m = np.where(shapely.covers(ground.allowed, hulls), away_m, 0.0)
    kept_m = float(away_m.min())
    if kept_m >= needed_m - _TOLERANCE_M and kept_m > 0:
        return ""
    nearest, _ = ground.nearest(hulls[away_m.argmin()])
    return (
        f"a straight line from the leg to item {part.item} comes within {kept_m:.2f} m of {nearest.name if nearest else 'a fence'}; "
        f"{metres(needed_m)} is required"
    )


def _stops(leg: CourseLeg, found: KeptDrive) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return where the vehicle could stop from the places of a leg, in the order of the drive, and its headings there."""
    start, end = found.ground.frame.to_local_array([leg.start, leg.end])
    length_m = float(np.hypot(*(end - start)))
    course = (end - start) / length_m if length_m else np.array([0.0, 1.0])
    heading_deg = bearing_deg(leg.start, leg.end)
    moving = motion(found.envelope, found.vehicle, found.ground.edge)
    if moving is None or not length_m:
        return np.array([start, end]), np.full(2, heading_deg)
    along_m = (moving.places - start) @ course
    beside_m = np.abs((moving.places - start) @ np.array([-course[1], course[0]]))
    is_on = (beside_m <= _BESIDE_M) & (along_m >= -_BESIDE_M) & (along_m <= length_m + _BESIDE_M)
    is_on &= moving.ways @ course >= _ALONG
    if not is_on.any():
        return np.array([start, end]), np.full(2, heading_deg)
    stops_m = moving.speeds_mps**2 / (2 * found.vehicle.accel_max_mps2)
    stops = (moving.places + moving.ways * stops_m[:, None])[is_on]
    return stops, np.degrees(np.arctan2(*moving.ways[is_on].T))
