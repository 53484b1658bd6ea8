"""The band itself: convex pieces about legs, blends and swings."""

from __future__ import annotations

import itertools
import math
from typing import TYPE_CHECKING

import numpy as np
import shapely

from missions.drive_model import corner as at_corner
from missions.drive_model import pursuit as at_pursuit
from missions.drive_model.stray import Stray
from missions.vehicle import Autopilot

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from missions.drive_model.legs_and_corners import DrivePlan
    from missions.geo import Vector
    from missions.vehicle import Pursuit

BLEND_SAMPLES = 6  # straight pieces of a blend; chosen, not measured
_BLEND_SHARES = [(sample / BLEND_SAMPLES, 1 - sample / BLEND_SAMPLES) for sample in range(BLEND_SAMPLES + 1)]
NEGLIGIBLE_M = 0.03  # a swing below this is left out; chosen: about a tenth of the band, 0.25 to 0.45 m
TAIL_TIMES_S = (2.0, 4.5, 8.0, 14.0)
"""Where a leg's band is cut, in seconds since its corner; between them a tail is taken as straight, which is never too narrow."""


class Pieces:
    """Collects the corner points of convex pieces."""

    def __init__(self) -> None:
        self.bands_m: list[float] = []
        self.waypoints: list[int] = []
        self._vertices: list[Vector] = []
        self._sizes: list[int] = []

    def add(self, vertices: Sequence[Vector], band_m: float, waypoint: int) -> None:
        """Add the hull of some places, to be grown by a band."""
        if len(vertices) == 1:
            vertices = (*vertices, *vertices)
        self._vertices += vertices
        self._sizes.append(len(vertices))
        self.bands_m.append(band_m)
        self.waypoints.append(waypoint)

    def extend(self, others: Pieces, more_m: float) -> None:
        """Add all of other pieces, each grown by so much more."""
        self._vertices += others._vertices
        self._sizes += others._sizes
        self.bands_m += [band_m + more_m for band_m in others.bands_m]
        self.waypoints += others.waypoints

    def convex(self) -> NDArray[np.object_]:
        """Return the convex hulls of their places."""
        owners = np.repeat(np.arange(len(self._sizes)), self._sizes)
        coordinates = np.fromiter(itertools.chain.from_iterable(self._vertices), np.float64, 2 * len(owners))
        # Lines take far less to make than as many points, and their hulls are the same.
        lines = shapely.linestrings(coordinates.reshape(-1, 2), indices=owners)
        return np.asarray(shapely.convex_hull(lines), dtype=np.object_)


def _beside(place: Vector, direction: Vector, stray: Stray) -> list[Vector]:
    """Return the place, or the two ends of the strip around it."""
    left_m, right_m = stray
    if left_m < NEGLIGIBLE_M and right_m < NEGLIGIBLE_M:
        return [place]
    (east_m, north_m), (ahead_east, ahead_north) = place, direction
    return [
        (east_m - ahead_north * left_m, north_m + ahead_east * left_m),
        (east_m + ahead_north * right_m, north_m - ahead_east * right_m),
    ]


def _shifted(place: Vector, direction: Vector, along_m: float) -> Vector:
    return (place[0] + direction[0] * along_m, place[1] + direction[1] * along_m)


def add_start(pieces: Pieces, drive: DrivePlan, array: NDArray[np.float64], behind_m: float) -> None:
    """Add the place it starts from, with its swing to the side and behind it."""
    place = (float(array[0, 0]), float(array[0, 1]))
    if not drive.legs:
        pieces.add(
            [(float(east_m), float(north_m)) for east_m, north_m in array], at_corner.BAND_AT_REST_M, 0
        )
        return
    leg, stray = drive.legs[0], drive.strays[0]
    vertices = [place]
    swings = stray.widest_m >= NEGLIGIBLE_M
    ahead_m = min(at_corner.swing_length_m(drive.vehicle), leg.profile.length_m) if swings else 0.0
    for along_m in (-behind_m - drive.start_more_m, ahead_m):
        vertices += _beside(_shifted(place, leg.direction, along_m), leg.direction, stray)
    pieces.add(vertices, leg.band_m, 0)


def add_leg(pieces: Pieces, drive: DrivePlan, number: int) -> None:
    """Add a leg from one blend to the next, as wide as the tails of earlier swings make it."""
    leg = drive.legs[number]
    # Pure pursuit follows no motion that blends: its corners lie beside whole legs.
    begin_s, end_s = drive.span_s(number) if drive.vehicle.pursuit is None else (0.0, leg.profile.duration_s)
    waypoint = waypoint_after(drive, number)
    if drive.stray_at(number, begin_s).widest_m < NEGLIGIBLE_M:  # and less later on
        pieces.add((leg.at(begin_s), leg.at(end_s)), leg.band_m, waypoint)
        return
    times_s = [begin_s, *(begin_s + time_s for time_s in TAIL_TIMES_S if begin_s + time_s < end_s), end_s]
    rungs = [_beside(leg.at(time_s), leg.direction, drive.stray_at(number, time_s)) for time_s in times_s]
    for rung, following in itertools.pairwise(rungs):
        pieces.add([*rung, *following], leg.band_m, waypoint)


def waypoint_after(drive: DrivePlan, leg: int) -> int:
    """Return the number of the waypoint that a leg leads to."""
    return drive.corners[leg].waypoint if leg < len(drive.corners) else drive.legs[leg].first + 1


def add_corner(pieces: Pieces, drive: DrivePlan, number: int) -> None:
    """Add the blend of two legs, and the area of a swing that does not follow it; where the rover was seen to need more, all of it so much wider.

    What it was seen to need counts from the middle of one leg to the middle of the next, as it was measured (`mavlink_bridge.logbook.legs`).
    """
    corner = drive.corners[number]
    if corner.more.beyond_m <= 0:
        _add_corner(pieces, drive, number)
        return
    own = Pieces()
    _add_corner(own, drive, number)
    _add_half_legs(own, drive, number)
    pieces.extend(own, corner.more.beyond_m)


def _add_corner(pieces: Pieces, drive: DrivePlan, number: int) -> None:
    corner, before, after = drive.corners[number], drive.legs[number], drive.legs[number + 1]
    if drive.vehicle.pursuit is not None and not corner.stops:
        _add_pursuit_corner(pieces, drive, number, drive.vehicle.pursuit)
        return
    band_m = max(before.band_m, after.band_m)
    path = _blend_path(drive, number)
    left = drive.stray_at(number, before.profile.duration_s - corner.blend.duration_s).widest_m
    # The band about a blend is narrower on its inside: the same strip, moved outwards.
    inside_m = at_corner.inside_band_m(
        drive.vehicle, max(before.profile.top_speed_mps, after.profile.top_speed_mps), band_m
    )
    outwards_m = (band_m - max(0.0, inside_m + min(corner.more.inside_m, 0.0))) / 2
    side = Stray(outwards_m, -outwards_m) if corner.turn_deg >= 0 else Stray(-outwards_m, outwards_m)
    strip = Stray(left + side.left_m, left + side.right_m)
    rungs = [_beside(place, direction, strip) for place, direction in path]
    # Where it may not follow the blend, the ground between blend and waypoint belongs to the band.
    wide = corner.swing_m >= NEGLIGIBLE_M or corner.doubtful
    corner_places = corner.places if wide else ()
    for rung, following in itertools.pairwise(rungs):
        pieces.add([*rung, *following, *corner_places], band_m - outwards_m, corner.waypoint)
    if wide or len(path) == 1:
        pieces.add(_swing_hull(drive, number), band_m, corner.waypoint)
        pieces.add(_swing_strip(drive, number), band_m, corner.waypoint)
    if drive.vehicle.autopilot is Autopilot.PX4 and (corner.pivots or not corner.stops):
        pieces.add(_whole_corner(drive, number), band_m, corner.waypoint)


def _add_half_legs(pieces: Pieces, drive: DrivePlan, number: int) -> None:
    """Add the half of a leg before a corner and the half of the leg after it, as wide as they are predicted."""
    corner, before, after = drive.corners[number], drive.legs[number], drive.legs[number + 1]
    middle_s = before.profile.duration_s / 2
    stray = drive.stray_at(number, middle_s)
    rungs = [_beside(place, before.direction, stray) for place in (before.at(middle_s), before.end)]
    pieces.add([*rungs[0], *rungs[1]], before.band_m, corner.waypoint)
    end_s = after.profile.duration_s / 2
    times_s = [0.0, *(time_s for time_s in TAIL_TIMES_S if time_s < end_s), end_s]
    rungs = [
        _beside(after.at(time_s), after.direction, drive.stray_at(number + 1, time_s)) for time_s in times_s
    ]
    for rung, following in itertools.pairwise(rungs):
        pieces.add([*rung, *following], after.band_m, corner.waypoint)


def _add_pursuit_corner(pieces: Pieces, drive: DrivePlan, number: int, steers: Pursuit) -> None:
    """Add the ground between the waypoint and the arc about it, and that of a turn which it cannot make in time."""
    corner, before, after = drive.corners[number], drive.legs[number], drive.legs[number + 1]
    band_m = max(before.band_m, after.band_m)
    radius_m = min(at_pursuit.switch_radius_m(steers, corner.turn_deg), before.profile.length_m)
    left = drive.stray_at(number, before.profile.duration_s - corner.blend.duration_s).widest_m
    arc = at_pursuit.cut_arc(before.end, before.direction, after.direction, corner.turn_deg, radius_m)
    strip = Stray(left, left)
    for place, following in itertools.pairwise(arc):
        rungs = [*_beside(place, before.direction, strip), *_beside(following, after.direction, strip)]
        pieces.add([*rungs, *corner.places], band_m, corner.waypoint)
    along_m = radius_m
    if corner.swing_m >= NEGLIGIBLE_M:
        circle_m = at_pursuit.turning_circle_m(drive.vehicle, steers)
        along_m = at_pursuit.swing_length_m(drive.vehicle, steers, corner.turn_deg)
        is_back = abs(corner.turn_deg) > at_pursuit.EITHER_SIDE_DEG
        for turn_deg in (corner.turn_deg, -corner.turn_deg)[: 1 + is_back]:
            late = at_pursuit.late_arc(before.end, before.direction, turn_deg, radius_m, circle_m)
            pieces.add([*late, *corner.places], band_m, corner.waypoint)
    ends = (0.0, min(along_m, after.profile.length_m))
    rows = [_shifted(after.start, after.direction, end_m) for end_m in ends]
    stray = drive.stray_after(number)
    pieces.add([one for row in rows for one in _beside(row, after.direction, stray)], band_m, corner.waypoint)


def _blend_path(drive: DrivePlan, number: int) -> list[tuple[Vector, Vector]]:
    """Return places and directions along the blend of two legs; one place where the rover stops."""
    corner, before, after = drive.corners[number], drive.legs[number], drive.legs[number + 1]
    duration_s = corner.blend.duration_s
    if duration_s == 0:
        return [(corner.places[0], before.direction)]
    (east_0, north_0), (ahead_east_0, ahead_north_0), (ahead_east_1, ahead_north_1) = (
        before.start,
        before.direction,
        after.direction,
    )
    begin_s = before.profile.duration_s
    before_m, after_m = before.profile.travelled_m, after.profile.travelled_m
    path: list[tuple[Vector, Vector]] = []
    for share, rest in _BLEND_SHARES:
        along_m, onto_m = before_m(begin_s - duration_s * rest), after_m(duration_s * share)
        east, north = ahead_east_0 * rest + ahead_east_1 * share, ahead_north_0 * rest + ahead_north_1 * share
        length = math.hypot(east, north)
        direction = (east / length, north / length) if length > 0.01 else after.direction
        place = (
            east_0 + ahead_east_0 * along_m + ahead_east_1 * onto_m,
            north_0 + ahead_north_0 * along_m + ahead_north_1 * onto_m,
        )
        path.append((place, direction))
    return path


def _swing_hull(drive: DrivePlan, number: int) -> list[Vector]:
    """Return the ground behind the waypoint that a turn needs which the rover cannot follow."""
    corner, after = drive.corners[number], drive.legs[number + 1]
    hull = [*corner.places]
    for along_m in (-corner.behind_m, 0.0):
        place = _shifted(after.start, after.direction, along_m)
        hull += _beside(place, after.direction, drive.stray_after(number))
    return hull


def _swing_strip(drive: DrivePlan, number: int) -> list[Vector]:
    """Return the strip along the next leg in which a swing has not begun to die away."""
    corner, after = drive.corners[number], drive.legs[number + 1]
    ahead_m = after.profile.travelled_m(corner.blend.duration_s)
    if corner.swing_m >= NEGLIGIBLE_M and not corner.pivots:
        swing_length_m = at_corner.swing_length_m(drive.vehicle)
        ahead_m = max(ahead_m, min(swing_length_m, after.profile.length_m))
    strip: list[Vector] = []
    for along_m in (0.0, ahead_m):
        strip += _beside(
            _shifted(after.start, after.direction, along_m), after.direction, drive.stray_after(number)
        )
    return strip


def _whole_corner(drive: DrivePlan, number: int) -> list[Vector]:
    """Return the ground of a corner that is turned within the acceptance radius along a path that was not measured."""
    corner, before, after = drive.corners[number], drive.legs[number], drive.legs[number + 1]
    radius_m = drive.vehicle.waypoint_radius_m
    return [
        *corner.places,
        _shifted(before.end, before.direction, -radius_m),
        _shifted(after.start, after.direction, 2 * radius_m),
    ]


def add_end(pieces: Pieces, drive: DrivePlan) -> None:
    """Add the last place, and how far a rover runs past it."""
    if not drive.legs:
        return
    overrun_m = at_corner.overrun_m(drive.vehicle)
    leg = drive.legs[-1]
    stray = drive.stray_at(len(drive.legs) - 1, leg.profile.duration_s)
    past = _shifted(leg.end, leg.direction, max(overrun_m - leg.band_m, 0.0))
    waypoint = waypoint_after(drive, len(drive.legs) - 1)
    pieces.add(
        [*_beside(leg.end, leg.direction, stray), *_beside(past, leg.direction, stray)], leg.band_m, waypoint
    )
