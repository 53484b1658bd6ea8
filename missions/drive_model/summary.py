"""The summary of a predicted drive: its corners, its legs, and when it comes to each point."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from missions.drive_model import corner as at_corner
from missions.drive_model import pursuit
from missions.drive_model.envelope import Corner, Leg
from missions.vehicle import Autopilot

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from missions.drive_model.legs_and_corners import DrivePlan, LegPlan

START_AND_END_LAG_S = 2.0
"""For both together, besides the motions of the legs (docs/drive-model.md, 5)."""


def told_corner(drives: Sequence[DrivePlan], number: int) -> Corner:
    """Return the prediction for a corner: the worst of several ways in which it may be driven, with the time of the first."""
    corners = [_corner(drive, number) for drive in drives]
    if len(corners) == 1:
        return corners[0]
    return replace(
        corners[0],
        inside_cut_m=max(corner.inside_cut_m for corner in corners),
        outside_overshoot_m=max(corner.outside_overshoot_m for corner in corners),
        reach_m=max(corner.reach_m for corner in corners),
        middle_m=max(corner.middle_m for corner in corners),
        least_middle_m=min(corner.least_middle_m for corner in corners),
        bounded=all(corner.bounded for corner in corners),
    )


def _corner(drive: DrivePlan, number: int) -> Corner:
    plan, before, after = drive.corners[number], drive.legs[number], drive.legs[number + 1]
    band_m = max(before.band_m, after.band_m)
    blend_s = before.profile.duration_s - plan.blend.duration_s
    coming_m = drive.stray_at(number, blend_s).widest_m
    midway = drive.stray_at(number, before.profile.duration_s / 2).seen_from(plan.turn_deg)
    going = drive.stray_after(number).seen_from(plan.turn_deg)
    return Corner(
        waypoint=plan.waypoint,
        turn_deg=plan.turn_deg,
        stops=plan.stops,
        pivots=plan.pivots,
        inside_cut_m=max(
            _cut_m(drive, number)
            + coming_m
            + max(
                0.0,
                plan.more.inside_m
                + at_corner.inside_band_m(
                    drive.vehicle, max(before.profile.top_speed_mps, after.profile.top_speed_mps), band_m
                ),
            ),
            max(going.right_m, midway.right_m) + band_m + max(plan.more.inside_m, 0.0),
        ),
        outside_overshoot_m=max(coming_m, going.left_m, midway.left_m)
        + band_m
        + max(plan.more.outside_m, 0.0),
        reach_m=_reach_m(drive, number, blend_s),
        middle_m=plan.blend.reach_m,
        least_middle_m=plan.blend.reach_m,
        time_lost_s=plan.time_lost_s,
        bounded=plan.bounded,
    )


def _reach_m(drive: DrivePlan, number: int, blend_s: float) -> float:
    """Return how far before the waypoint it may leave its leg, from when the blend begins."""
    before, plan = drive.legs[number].profile, drive.corners[number]
    reach_m = before.length_m - before.travelled_m(blend_s)
    if drive.vehicle.pursuit is None or plan.stops:
        return reach_m
    return max(reach_m, pursuit.switch_radius_m(drive.vehicle.pursuit, plan.turn_deg))


def _cut_m(drive: DrivePlan, number: int) -> float:
    plan = drive.corners[number]
    sine = abs(math.sin(math.radians(plan.turn_deg)))
    if drive.vehicle.pursuit is not None and not plan.stops:
        return pursuit.cut_m(drive.vehicle.pursuit, plan.turn_deg)
    if drive.vehicle.autopilot is Autopilot.PX4 and not plan.stops:
        return drive.vehicle.waypoint_radius_m * (sine if abs(plan.turn_deg) < 90 else 1.0)
    return plan.blend.reach_m * sine


def told_leg(drives: Sequence[DrivePlan], number: int) -> Leg:
    """Return the prediction for a leg: the worst of several ways in which it may be driven."""
    leg: LegPlan = drives[0].legs[number]
    strays = [drive.stray_at(number, drive.span_s(number)[0]) for drive in drives]
    return Leg(
        first=leg.first,
        length_m=leg.profile.length_m,
        top_speed_mps=leg.profile.top_speed_mps,
        half_width_m=leg.band_m,
        left_m=leg.band_m + max(stray.left_m for stray in strays),
        right_m=leg.band_m + max(stray.right_m for stray in strays),
    )


def arrivals_s(drive: DrivePlan, count: int) -> NDArray[np.float64]:
    """Return when each point is passed: the motions of the legs one after another, less their overlaps."""
    if not drive.legs:
        return np.zeros(count)
    clock_s = START_AND_END_LAG_S / 2 + at_corner.swing_time_s(
        drive.strays[0].widest_m, drive.vehicle.speed_mps
    )
    times_s = [0.0] * (drive.legs[0].first + 1)
    for leg, following, corner in zip(drive.legs, drive.legs[1:], drive.corners, strict=False):
        clock_s += leg.profile.duration_s
        ramps_s = (leg.profile.ramp.duration_s + following.profile.ramp.duration_s) / 2
        extra_s = corner.time_lost_s - ramps_s  # negative by the overlap of the two motions
        times_s += [clock_s - corner.blend.duration_s / 2] * (corner.waypoint - leg.first)
        clock_s += extra_s
    clock_s += drive.legs[-1].profile.duration_s
    clock_s += START_AND_END_LAG_S / 2
    return np.array(times_s + [clock_s] * (count - len(times_s)))
