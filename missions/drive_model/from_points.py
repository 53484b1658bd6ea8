"""From a list of points to legs and corners."""

from __future__ import annotations

import itertools
import math
from typing import TYPE_CHECKING

from missions.drive_model import before_4_6
from missions.drive_model import corner as at_corner
from missions.drive_model import pursuit as at_pursuit
from missions.drive_model.legs_and_corners import CornerPlan, DrivePlan, LegPlan
from missions.drive_model.motion import leg_profile
from missions.drive_model.stray import Bend, Stray
from missions.geo import change_deg
from missions.vehicle.calibration import corner_more

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    import numpy as np
    from numpy.typing import NDArray

    from missions.drive_model.motion import LegProfile
    from missions.geo import Vector
    from missions.vehicle import Vehicle

SAME_PLACE_M = 0.3
"""Points nearer to one another are one place for a rover: it can make nothing of a leg between them but a stop."""


KnownCorners = dict[tuple[object, ...], CornerPlan]
"""Corners of one vehicle by what decides on them, without their places: of many drives that differ little most have the same."""

MOST_KNOWN = 20_000
"""Corners that are kept, about 1 kB each; of more it begins anew."""


def drive_plan(
    points: NDArray[np.float64],
    vehicle: Vehicle,
    speeds: Sequence[float | None] | None,
    stops: Mapping[int, float],
    start: Stray,
    known: KnownCorners | None = None,
) -> DrivePlan:
    """Return the legs and corners of a list of points; points that lie on one another are one place, and a stop."""
    known = {} if known is None else known
    groups = _grouped(points)
    legs = tuple(
        _leg(vehicle, before, after, None if speeds is None else speeds[after[0][0] - 1])
        for before, after in itertools.pairwise(groups)
    )
    turns_deg = [change_deg(before.direction, after.direction) for before, after in itertools.pairwise(legs)]
    runs_m = _runs_m(legs, turns_deg)
    asked = [None if speeds is None else speeds[leg.first] for leg in legs]
    asked_mps = [vehicle.speed_mps if speed_mps is None else speed_mps for speed_mps in asked]
    corners = []
    whole_deg = 0.0
    is_first_run, start_more_m = True, 0.0
    swung_m = start.widest_m  # what the present run swings out that began from rest
    for number, (group, (before, after)) in enumerate(
        zip(groups[1:], itertools.pairwise(legs), strict=False)
    ):
        turn_deg = turns_deg[number]
        whole_deg = turn_deg + (whole_deg if before.profile.length_m < at_corner.NEAR_M else 0.0)
        changes_speed = asked[number] != asked[number + 1] and abs(turn_deg) > at_corner.STRAIGHT_ON_DEG
        fastest_mps = max(asked_mps[number], asked_mps[number + 1])
        bend = Bend(turn_deg, whole_deg, min(runs_m[number], runs_m[number + 1]), fastest_mps, changes_speed)
        stops_s = [stops[number] for number, _ in group if number in stops] if stops else []
        corner = _known_corner(known, vehicle, (before.profile, after.profile), bend, len(group), stops_s)
        goes_on = abs(turn_deg) < at_corner.STRAIGHT_ON_DEG
        more_m = 0.0 if goes_on else at_corner.unsettled_m(vehicle, swung_m, runs_m[number])
        places = tuple([place for _, place in group])
        stray_m = max(corner.stray_m, more_m)
        corner = corner._replace(waypoint=group[-1][0], places=places, stray_m=stray_m)
        start_more_m = more_m if is_first_run and not goes_on else start_more_m
        if corner.stops or not goes_on:
            is_first_run = False
            swung_m = corner.swing_m if corner.stops and not corner.pivots else 0.0
        corners.append(corner)
    strays = [start.widened(start_more_m)]
    middle_s = at_corner.START_HOLD_S
    for leg, corner in zip(legs, corners, strict=False):
        passed_s = leg.profile.duration_s - middle_s - corner.blend.duration_s / 2
        middle_s = corner.swings_until_s
        left = strays[-1].after(passed_s, vehicle.position_gain_per_s)
        # PX4's rover that comes to a waypoint facing the wrong way was as far off on the leg after it: no turn takes anything away.
        kept = (
            left.turned(corner.turn_deg) if vehicle.pursuit is None else Stray(left.widest_m, left.widest_m)
        )
        stray = kept.swung(corner.turn_deg, corner.swing_m)
        strays.append(stray.widened(corner.stray_m))
    return DrivePlan(
        vehicle, legs, tuple(corners), tuple(strays), _tails(vehicle, legs, corners), start_more_m
    )


def _tails(vehicle: Vehicle, legs: Sequence[LegPlan], corners: Sequence[CornerPlan]) -> tuple[Stray, ...]:
    """Return what each leg begins with of the tails that hardly die away: of several the widest counts."""
    if not at_corner.is_early(vehicle):
        return ()
    tails = [Stray()]
    begin_s = 0.0
    for leg, corner in zip(legs, corners, strict=False):
        passed_s = leg.profile.duration_s - corner.blend.duration_s / 2 - begin_s
        begin_s = corner.blend.duration_s
        tails.append(before_4_6.left_of(tails[-1], passed_s).turned(corner.turn_deg).wider(corner.tail))
    return tuple(tails)


def _grouped(points: NDArray[np.float64]) -> list[list[tuple[int, Vector]]]:
    groups: list[list[tuple[int, Vector]]] = []
    for number, (east_m, north_m) in enumerate(points.tolist()):
        place = (east_m, north_m)
        if groups and math.dist(place, groups[-1][0][1]) < SAME_PLACE_M:
            groups[-1].append((number, place))
        else:
            groups.append([(number, place)])
    return groups


def _leg(
    vehicle: Vehicle,
    before: list[tuple[int, Vector]],
    after: list[tuple[int, Vector]],
    speed_mps: float | None,
) -> LegPlan:
    (first, start), (_, end) = before[-1], after[0]
    length_m = math.dist(start, end)
    speed_mps = vehicle.speed_mps if speed_mps is None else speed_mps
    profile = leg_profile(length_m, speed_mps, vehicle.accel_max_mps2, vehicle.jerk_mps3)
    direction = ((end[0] - start[0]) / length_m, (end[1] - start[1]) / length_m)
    return LegPlan(first, start, end, direction, profile, at_corner.band_m(vehicle, profile.top_speed_mps))


def _runs_m(legs: Sequence[LegPlan], turns_deg: Sequence[float]) -> list[float]:
    """Return for each leg how far the line goes nearly straight on before and after it, together."""
    runs: list[list[LegPlan]] = []
    for number, leg in enumerate(legs):
        if runs and abs(turns_deg[number - 1]) < at_corner.STRAIGHT_ON_DEG:
            runs[-1].append(leg)
        else:
            runs.append([leg])
    lengths_m = [sum([leg.profile.length_m for leg in run]) for run in runs]
    return [length_m for length_m, run in zip(lengths_m, runs, strict=True) for _ in run]


def _known_corner(
    known: KnownCorners,
    vehicle: Vehicle,
    profiles: tuple[LegProfile, LegProfile],
    bend: Bend,
    places: int,
    stops_s: list[float],
) -> CornerPlan:
    """Return a corner, without its places, from those known if it is one of them."""
    key = (*profiles, bend, places, *stops_s)
    corner = known.get(key)
    if corner is None:
        if len(known) >= MOST_KNOWN:
            known.clear()
        corner = known[key] = _corner(vehicle, profiles, bend, places, stops_s)
    return corner


def _corner(
    vehicle: Vehicle,
    profiles: tuple[LegProfile, LegProfile],
    bend: Bend,
    places: int,
    stops_s: list[float],
) -> CornerPlan:
    # Long: one decision on how a corner is driven, and what follows from it field by field.
    before, after = profiles
    turn_deg = bend.turn_deg
    pivots = at_corner.pivots(vehicle, turn_deg)
    delay_s = sum(stops_s, 0.0)
    stopped = places > 1 or bool(stops_s)
    doubtful = at_corner.may_pivot_or_cut(vehicle, turn_deg) and not stopped
    tail = Stray()
    either_m = 0.0
    if pivots and not doubtful:
        blend = at_corner.STANDSTILL
        swing_m = at_corner.pivot_swing_m(vehicle, bend.shorter_run_m)
        behind_m = 0.0
    elif stopped:
        blend = at_corner.STANDSTILL
        swing_m = at_corner.start_swing_m(vehicle, turn_deg)
        behind_m = at_corner.start_behind_m(vehicle, turn_deg)
    else:
        blend = at_corner.blend(vehicle, before, after, turn_deg)
        swing_m = at_corner.corner_swing_m(vehicle, bend, blend.reach_m)
        if vehicle.pursuit is not None and abs(turn_deg) > at_pursuit.EITHER_SIDE_DEG:
            either_m = swing_m
        if at_corner.is_early(vehicle):
            swing = at_corner.early_swing(vehicle, bend)
            swing_m = swing.outside_m
            tail = Stray(swing.later_outside_m, swing.later_inside_m).seen_from(turn_deg)
        behind_m = swing_m * at_corner.behind_share(vehicle, turn_deg)
    more = corner_more(vehicle, turn_deg, bend.speed_mps, stands=stopped or pivots)
    holds_s = at_corner.swing_hold_s(vehicle, swing_m, stopped=stopped, pivots=pivots)
    swing_m = max(0.0, swing_m + min(more.outside_m, 0.0))
    top_mps = min(before.top_speed_mps, after.top_speed_mps)
    ramps_s = (before.ramp.duration_s + after.ramp.duration_s) / 2
    lost_s = ramps_s - blend.duration_s + at_corner.swing_time_s(swing_m, top_mps) + delay_s
    if vehicle.pursuit is not None and not stopped:
        lost_s += at_pursuit.time_lost_s(vehicle, vehicle.pursuit, turn_deg, top_mps)
    if stopped or pivots:
        lost_s += at_corner.STOP_LAG_S
    if pivots:
        lost_s += at_corner.pivot_time_s(vehicle, turn_deg)
    return CornerPlan(
        waypoint=0,
        places=(),
        turn_deg=turn_deg,
        stops=stopped or pivots,
        pivots=pivots,
        doubtful=doubtful,
        bounded=at_corner.is_bounded(vehicle, turn_deg, bend.shorter_run_m, stops=stopped)
        and (stopped or pivots or not bend.changes_speed),
        blend=blend,
        swing_m=swing_m,
        behind_m=behind_m,
        swings_until_s=blend.duration_s / 2 + holds_s,
        stray_m=max(_stray_m(places, delay_s), either_m),
        tail=tail,
        time_lost_s=lost_s,
        more=more,
    )


def _stray_m(places: int, delay_s: float) -> float:
    if places > 1:
        return at_corner.SAME_PLACE_STRAY_M
    return at_corner.DELAY_STRAY_M if delay_s > 0 else 0.0
