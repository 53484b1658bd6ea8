"""What the drive model was measured on, and which vehicles and drives lie outside it: there a plan is extrapolated, and promises nothing.

Ranges of parameters stand in their table (`missions.vehicle.parameters`), from the measured rows that docs/drive-model.md describes.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

from missions.drive_model.corner import SHORT_START_M, SLOW_MPS, is_early, unsettled_m
from missions.vehicle import Autopilot, Steering
from missions.vehicle.parameters import PARAMETERS

if TYPE_CHECKING:
    from collections.abc import Iterator

    from missions.drive_model.envelope import Envelope
    from missions.vehicle import Vehicle

LEAST_MARGIN_M = PARAMETERS["FENCE_MARGIN"].measured.least if PARAMETERS["FENCE_MARGIN"].measured else 0.0
"""With less FENCE_MARGIN measured rovers stopped at the fence or past it (0: 0.02 to 0.04 m past, 0.05: 0.02 m before)."""

_TURNED_DEG = 45.0  # as at a start that swings out by START_TURNED_M

_PX4_ACCEL_MPS2, _PX4_JERK_MPS3 = 3.0, 10.0
"""RO_ACCEL_LIM and RO_DECEL_LIM, and RO_JERK_LIM, of the PX4 rover that was measured."""

SAME_TURN_DEG = 20.0
SAME_MPS = 3.0
"""Up to such a turn and speed firmware before 4.6 kept within the later corners too (162 corners on long legs, within 0.04 m); so it did where it pivots."""


def beyond_measured(vehicle: Vehicle, *speeds_mps: float | None) -> tuple[str, ...]:
    """Return in what a vehicle lies outside the measurements that the drive model rests on.

    The formulas go on beyond them (a larger turning radius swings out farther, a weaker position gain strays farther), but nothing was
    measured there.

    Parameters
    ----------
    vehicle : Vehicle
        What drives.
    *speeds_mps : float or None
        The speeds that are asked for on its way besides its own; None is its own.

    Returns
    -------
    tuple of str
        One sentence each; empty where the vehicle is of the measured kind.
    """
    speeds = {vehicle.speed_mps, *filter(None, speeds_mps)}
    if vehicle.autopilot is not Autopilot.ARDUPILOT:
        return tuple(_beyond_px4s(vehicle, min(speeds), max(speeds)))
    return (
        *_beyond_kinds(vehicle, min(speeds)),
        *_beyond_ranges(vehicle, min(speeds), max(speeds)),
        *_beyond_margin(vehicle),
    )


def extrapolated(
    vehicle: Vehicle, band: Envelope, *speeds_mps: float | None, ends_in_loiter: bool = False
) -> tuple[str, ...]:
    """Return in what a drive lies outside the measurements: its vehicle (`beyond_measured`), corners that its firmware may drive otherwise, its legs and end."""
    speeds = {vehicle.speed_mps, *filter(None, speeds_mps)}
    return (
        *beyond_measured(vehicle, *speeds_mps),
        *_beyond_corners(vehicle, band, speeds),
        *_beyond_short_drives(vehicle, band),
        *(_beyond_loiter(vehicle) if ends_in_loiter else ()),
    )


def _beyond_loiter(vehicle: Vehicle) -> Iterator[str]:
    """Yield that a steered rover may go on steering at LOITER_UNLIM: since 4.5 it stands (AR_PosControl.cpp, November 2023), as measured on 4.5 and later."""
    if is_early(vehicle) and vehicle.steering is Steering.ACKERMANN:
        yield (
            "ArduPilot before 4.5 goes on steering at LOITER_UNLIM, which was not measured; versions before 4.6 are not told apart: "
            "use --end hold"
        )


def _beyond_short_drives(vehicle: Vehicle, band: Envelope) -> Iterator[str]:
    """Yield that a leg from rest to rest is shorter than what a steered rover needs to turn into it."""
    rests = [True, *(corner.stops for corner in band.corners), True]
    for number, leg in enumerate(band.legs):
        turned = number == 0 or abs(band.corners[number - 1].turn_deg) > _TURNED_DEG
        swung_m = max(leg.left_m, leg.right_m) - leg.half_width_m
        is_short = leg.length_m < SHORT_START_M and unsettled_m(vehicle, swung_m, leg.length_m) > 0
        if rests[number] and rests[number + 1] and turned and is_short:
            yield (
                f"a steered rover that turns and stops again after only {leg.length_m:.1f} m was not measured, only on longer drives: it may circle to get "
                f"there; choose a target at least {SHORT_START_M:g} m away"
            )
            return


def _beyond_px4s(vehicle: Vehicle, least_mps: float, top_mps: float) -> Iterator[str]:
    """Yield what of a PX4 rover was not measured."""
    steers = vehicle.pursuit
    if steers is None:
        if vehicle.steering is Steering.ACKERMANN:
            yield "how this PX4 rover steers is not known"
            return
        yield "skid-steered rovers were not measured with PX4: how they turn on the spot is known from its source only"
        return
    known_mps = vehicle.speed_mps if steers.full_speed_mps is None else steers.full_speed_mps
    told = (
        ("RO_SPEED_LIM", least_mps, "m/s", "the drive"),
        ("RO_SPEED_LIM", top_mps, "m/s", "the drive"),
        ("NAV_ACC_RAD", steers.acceptance_m, "m", "corners"),
        ("RA_ACC_RAD_GAIN", steers.acceptance_gain, "", "corners"),
        ("RA_WHEEL_BASE", steers.wheel_base_m, "m", "swings"),
        ("RA_MAX_STR_ANG", steers.steering_angle_rad, "rad", "swings"),
        ("RO_MAX_THR_SPEED", known_mps, "m/s", "corners"),
        ("PP_LOOKAHD_GAIN", steers.lookahead_gain_s, "s", "tracking"),
        ("PP_LOOKAHD_MIN", steers.lookahead_least_m, "m", "tracking"),
        ("PP_LOOKAHD_MAX", steers.lookahead_most_m, "m", "tracking"),
    )
    found = {
        f"{name} {value:g} {unit}".rstrip()
        + f" was not measured with PX4 (only {PARAMETERS[name].measured}): {what} may differ": None
        for name, value, unit, what in told
        if (measured := PARAMETERS[name].measured) is not None and value not in measured
    }
    yield from dict.fromkeys(found)
    choices = (
        ("RA_ACC_RAD_MAX", steers.acceptance_max_m, (-1.0, 3.0, None), "corners"),
        ("RO_SPEED_RED", steers.speed_reduction, (-1.0, 1.0), "corners"),
        ("RO_ACCEL_LIM or RO_DECEL_LIM", vehicle.accel_max_mps2, (_PX4_ACCEL_MPS2,), "corners"),
        ("RO_JERK_LIM", vehicle.jerk_mps3, (_PX4_JERK_MPS3,), "corners"),
    )
    for name, chosen, measured_ones, what in choices:
        if chosen not in measured_ones:
            only = " and ".join(f"{one:g}" for one in measured_ones if one is not None)
            yield f"{name} {chosen:g} was not measured with PX4 (only {only}): {what} may differ"


def _beyond_kinds(vehicle: Vehicle, least_mps: float) -> Iterator[str]:
    if vehicle.boat_drift_m is not None:
        yield "the drive model was measured on wheels, not on a boat"
    if vehicle.steering is Steering.ACKERMANN and least_mps < SLOW_MPS:
        yield (
            f"steered rovers below {SLOW_MPS:g} m/s were not measured, and this one drives {least_mps:g} m/s: slow ones swing out farther "
            "(after 90° 0.7 m at 1 m/s, 1.8 m at 0.5, 3.2 m at 0.3) and count waypoints as reached that they pass at a "
            f"distance; drive {SLOW_MPS:g} m/s or faster, or tune the steering: at 0.3 m/s ATC_STR_RAT_FF 2.5 (not 0.75) or PSC_VEL_P 3 (not 1) "
            "reduced 3.2 m to 1.2 m"
        )
    if vehicle.oa_type:
        yield f"OA_TYPE {vehicle.oa_type}: ArduPilot plans its own way around fences and may leave the route; set OA_TYPE 0"


def _beyond_corners(vehicle: Vehicle, band: Envelope, speeds_mps: set[float]) -> Iterator[str]:
    """Yield which corners firmware before 4.6 was not measured at; where the version is not known, in what it would matter; and which PX4 was not."""
    if vehicle.pursuit is not None:
        sharpest_deg = max(
            (abs(corner.turn_deg) for corner in band.corners if not corner.bounded), default=0.0
        )
        if sharpest_deg:
            yield (
                f"turns like those of this drive (up to {sharpest_deg:.0f}°) were not measured with PX4: "
                "only between legs of 15 m and more, up to 90° of 4 m, at one speed"
            )
        return
    if vehicle.has_measured_corners or vehicle.autopilot is not Autopilot.ARDUPILOT:
        return
    turns_deg = [abs(corner.turn_deg) for corner in band.corners if not corner.bounded]
    unmeasured = (
        [f"turns like those of this drive (up to {max(turns_deg):.0f}°) were not measured"]
        if turns_deg
        else []
    )
    if vehicle.has_measured_corners is None:
        ends_mps = min(speeds_mps), max(speeds_mps)
        is_decisive = any(
            not (corner.pivots or corner.stops)
            and (abs(corner.turn_deg) > SAME_TURN_DEG or ends_mps[1] > SAME_MPS)
            for corner in band.corners
        )
        early = replace(vehicle, has_measured_corners=False)
        known = set(_beyond_ranges(vehicle, *ends_mps))
        unmeasured += [
            reason for reason in _beyond_ranges(early, *ends_mps) if is_decisive and reason not in known
        ]
    if unmeasured:
        yield f"{_age(vehicle)}: {'; '.join(unmeasured)}"


def _age(vehicle: Vehicle) -> str:
    if vehicle.has_measured_corners is False:
        return f"ArduPilot {vehicle.firmware} (before 4.6)"
    version = "unknown" if vehicle.firmware is None else f"{vehicle.firmware}"
    return f"firmware {version}, which may be older than April 2025 (give the version: --firmware 4.6, or connect to the vehicle)"


def _beyond_ranges(vehicle: Vehicle, least_mps: float, top_mps: float) -> Iterator[str]:
    """Yield which of the vehicle's limits, gains and distances were not measured."""
    is_early = vehicle.has_measured_corners is False
    is_steered = vehicle.steering is Steering.ACKERMANN
    radius_m = (
        max(vehicle.waypoint_radius_m, vehicle.turn_radius_m) if is_steered else vehicle.waypoint_radius_m
    )
    no_limit = math.inf  # what 0 means, and what a limit that is not told is taken for
    told = (
        ("WP_SPEED", least_mps if is_early and least_mps < SLOW_MPS else top_mps, "m/s", "the drive"),
        ("WP_RADIUS", radius_m, "m", "corners"),
        ("TURN_RADIUS", vehicle.turn_radius_m, "m", "swings"),
        ("ATC_TURN_MAX_G", vehicle.turn_max_g, "g", "turns"),
        ("ATC_STR_RAT_MAX", vehicle.turn_rate_max_dps or no_limit, "°/s", "turns"),
        ("ATC_STR_ACC_MAX", vehicle.turn_accel_max_dps2 or no_limit, "°/s²", "turns"),
        ("ATC_ACCEL_MAX", vehicle.accel_max_mps2, "m/s²", "corners"),
        ("WP_JERK", vehicle.jerk_mps3, "m/s³", "corners"),
        ("PSC_POS_P", vehicle.position_gain_per_s, "/s", "tracking"),
    )
    for name, value, unit, what in told:
        row = PARAMETERS[name]
        measured = row.measured if is_steered else row.measured_skid
        is_too_slow = name == "WP_SPEED" and is_steered and value < SLOW_MPS  # has a sentence of its own
        if measured and value not in measured and not is_too_slow:
            yield f"{name} {value:g} {unit} was not measured (only {measured}, {vehicle.steering} steering): {what} may differ"
        elif (
            measured
            and is_early
            and row.measured_before_4_6
            and value not in row.measured_before_4_6
            and not is_too_slow
        ):
            yield f"{name} {value:g} {unit} was not measured before ArduPilot 4.6 (only {row.measured_before_4_6}): {what} may differ"


def _beyond_margin(vehicle: Vehicle) -> Iterator[str]:
    if not vehicle.avoids_fence:
        return
    margin_m, name, measured = (
        vehicle.stops_within_m,
        vehicle.fence.margin_name,
        PARAMETERS["FENCE_MARGIN"].measured,
    )
    if margin_m < LEAST_MARGIN_M:
        yield (
            f"{name} {margin_m:g} m does not switch avoidance off: the vehicle still brakes at the "
            "fence, and in tests rovers stopped up to 0.04 m past it, a breach; clearance was not measured there. "
            f"Set {name} {LEAST_MARGIN_M:g} or more, or AVOID_ENABLE {vehicle.avoid_bits & ~1} (without bit 0)"
        )
    elif measured and margin_m not in measured:
        yield f"{name} {margin_m:g} m was not measured (only {measured}): avoidance may differ"
