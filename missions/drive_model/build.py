"""Building an envelope: legs and corners to pieces of a band."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from missions.drive_model import corner as at_corner
from missions.drive_model.band import Pieces, add_corner, add_end, add_leg, add_start
from missions.drive_model.envelope import Corner, Envelope, Leg
from missions.drive_model.plan import SAME_PLACE_M, plan_route
from missions.drive_model.route import Route, Stray
from missions.errors import InvalidPositionError, VehicleError
from missions.vehicle import Autopilot

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import ArrayLike, NDArray

    from missions.drive_model.route import LegPlan
    from missions.vehicle import Vehicle

START_AND_END_LAG_S = 2.0


def envelope(
    points: ArrayLike,
    vehicle: Vehicle,
    *,
    heading_deg: float | None = None,
    speeds: Sequence[float | None] | None = None,
    stops: Mapping[int, float] | None = None,
) -> Envelope:
    """Foresee how a vehicle drives a list of points.

    Parameters
    ----------
    points : array_like of float, shape (n, 2)
        East and north in metres: the vehicle's place at rest, then its waypoints; at least one point.
    vehicle : Vehicle
        Its parameters.
    heading_deg : float, optional
        Where it faces at the start, clockwise from north. Not known: the worst is taken, to either side. To say that it faces along
        its first leg, give that leg's bearing.
    speeds : sequence of float or None, optional
        The speed asked for on each leg (n - 1 of them), as DO_CHANGE_SPEED sets it; None is the vehicle's own.
    stops : mapping of int to float, optional
        Waypoints (their numbers in `points`) where it stops, and for how many seconds (``param1``).

    Returns
    -------
    Envelope

    Raises
    ------
    InvalidPositionError
        No points, or one that is not a pair of numbers.
    VehicleError
        A speed that is not positive, or not one for each leg.
    """
    array = _checked(points)
    _check_speeds(speeds, len(array) - 1)
    start, behind_m = _start(array, vehicle, heading_deg)
    route = plan_route(array, vehicle, speeds, stops or {}, start)
    pieces = Pieces()
    _add_route(pieces, route, array, behind_m)
    if heading_deg is None and len(array) > 1:
        # Starting straight on it is sooner at speed, and then strays further from short legs than after the worst start.
        along, behind_m = _start(array, vehicle, _bearing_deg(array))
        _add_route(pieces, plan_route(array, vehicle, speeds, stops or {}, along), array, behind_m)
    return Envelope(
        points=array,
        cores=pieces.cores(),
        bands_m=np.asarray(pieces.bands_m),
        waypoints=np.asarray(pieces.waypoints, dtype=np.int64),
        corners=tuple(_corner(route, number) for number in range(len(route.corners))),
        legs=tuple(_leg(route, number) for number in range(len(route.legs))),
        arrivals_s=_arrivals_s(route, len(array)),
    )


def _add_route(pieces: Pieces, route: Route, points: NDArray[np.float64], behind_m: float) -> None:
    add_start(pieces, route, points, behind_m)
    for number in range(len(route.legs)):
        add_leg(pieces, route, number)
        if number < len(route.corners):
            add_corner(pieces, route, number)
    add_end(pieces, route)


def _bearing_deg(points: NDArray[np.float64]) -> float:
    """Give the bearing of the first leg that leads anywhere."""
    away = points[np.hypot(*(points - points[0]).T) > SAME_PLACE_M]
    if not len(away):
        return 0.0
    east_m, north_m = away[0] - points[0]
    return math.degrees(math.atan2(east_m, north_m)) % 360.0


def corner_forecast(
    turn_deg: float,
    vehicle: Vehicle,
    *,
    leg_before_m: float = 1000.0,
    leg_after_m: float = 1000.0,
    speed_mps: float | None = None,
    stop_s: float | None = None,
) -> Corner:
    """Foresee one corner by itself, without the tails of others.

    Parameters
    ----------
    turn_deg : float
        Change of course, to the right positive.
    vehicle : Vehicle
        Its parameters.
    leg_before_m, leg_after_m : float
        The lengths of its two legs.
    speed_mps : float, optional
        The speed asked for on both.
    stop_s : float, optional
        A stop at the waypoint for so long.
    """
    turn_rad = math.radians(turn_deg)
    points = np.array(
        [
            (0.0, -leg_before_m),
            (0.0, 0.0),
            (leg_after_m * math.sin(turn_rad), leg_after_m * math.cos(turn_rad)),
        ]
    )
    stops = {} if stop_s is None else {1: stop_s}
    return _corner(plan_route(points, vehicle, [speed_mps, speed_mps], stops, Stray()), 0)


def _checked(points: ArrayLike) -> NDArray[np.float64]:
    array = np.asarray(points, dtype=np.float64)
    if array.ndim != 2 or array.shape[0] < 1 or array.shape[1] != 2 or not np.isfinite(array).all():
        raise InvalidPositionError(
            f"a drive needs points of two finite numbers, not an array of shape {array.shape}"
        )
    return array


def _check_speeds(speeds: Sequence[float | None] | None, legs: int) -> None:
    if speeds is None:
        return
    if len(speeds) != legs:
        raise VehicleError(f"a drive of {legs} legs needs as many speeds, not {len(speeds)}", legs=legs)
    for number, speed_mps in enumerate(speeds):
        if speed_mps is not None and not 0 < speed_mps < math.inf:
            raise VehicleError(f"a speed of {speed_mps:g} m/s on leg {number} is none", leg=number)


def _start(array: NDArray[np.float64], vehicle: Vehicle, heading_deg: float | None) -> tuple[Stray, float]:
    """Give the swing at the start, and how far behind its place it takes the rover."""
    steps = array - array[0]
    far = np.flatnonzero(np.hypot(steps[:, 0], steps[:, 1]) >= SAME_PLACE_M)
    if not len(far):
        return Stray(), 0.0
    if heading_deg is None:
        swing_m = at_corner.start_swing_m(vehicle, 180.0)
        return Stray(swing_m, swing_m), at_corner.start_behind_m(vehicle, 180.0)
    east_m, north_m = steps[far[0]]
    error_deg = (heading_deg - math.degrees(math.atan2(east_m, north_m)) + 180.0) % 360.0 - 180.0
    swing_m = at_corner.start_swing_m(vehicle, error_deg)
    either_side = abs(error_deg) > EITHER_SIDE_DEG
    stray = Stray(
        swing_m if error_deg < 0 or either_side else 0.0, swing_m if error_deg >= 0 or either_side else 0.0
    )
    return stray, at_corner.start_behind_m(vehicle, error_deg)


EITHER_SIDE_DEG = 165.0


def _corner(route: Route, number: int) -> Corner:
    plan, before, after = route.corners[number], route.legs[number], route.legs[number + 1]
    band_m = max(before.band_m, after.band_m)
    blend_s = before.profile.duration_s - plan.blend.duration_s
    coming_m = route.stray_at(number, blend_s).widest_m
    midway = route.stray_at(number, before.profile.duration_s / 2).seen_from(plan.turn_deg)
    going = route.strays[number + 1].seen_from(plan.turn_deg)
    return Corner(
        waypoint=plan.waypoint,
        turn_deg=plan.turn_deg,
        stops=plan.stops,
        pivots=plan.pivots,
        inside_cut_m=max(
            _cut_m(route, number) + coming_m + min(band_m, at_corner.INSIDE_BAND_M),
            max(going.right_m, midway.right_m) + band_m,
        ),
        outside_overshoot_m=max(coming_m, going.left_m, midway.left_m) + band_m,
        reach_m=before.profile.length_m - before.profile.travelled_m(blend_s),
        middle_m=plan.blend.reach_m,
        time_lost_s=plan.time_lost_s,
        bounded=plan.bounded,
    )


def _cut_m(route: Route, number: int) -> float:
    plan = route.corners[number]
    sine = abs(math.sin(math.radians(plan.turn_deg)))
    if route.vehicle.autopilot is Autopilot.PX4 and not plan.stops:
        return route.vehicle.waypoint_radius_m * (sine if abs(plan.turn_deg) < 90 else 1.0)
    return plan.blend.reach_m * sine


def _leg(route: Route, number: int) -> Leg:
    leg: LegPlan = route.legs[number]
    begin_s, _ = route.span_s(number)
    stray = route.stray_at(number, begin_s)
    return Leg(
        first=leg.first,
        length_m=leg.profile.length_m,
        top_speed_mps=leg.profile.top_speed_mps,
        half_width_m=leg.band_m,
        left_m=leg.band_m + stray.left_m,
        right_m=leg.band_m + stray.right_m,
    )


def _arrivals_s(route: Route, count: int) -> NDArray[np.float64]:
    """Give when each point is passed: the motions of the legs one after another, less what they overlap."""
    arrivals_s = np.zeros(count)
    clock_s = (
        START_AND_END_LAG_S / 2 + at_corner.swing_time_s(route.strays[0].widest_m, route.vehicle.speed_mps)
        if route.legs
        else 0.0
    )
    for number, leg in enumerate(route.legs):
        clock_s += leg.profile.duration_s
        if number == len(route.corners):
            clock_s += START_AND_END_LAG_S / 2
            arrivals_s[leg.first + 1 :] = clock_s
            break
        corner = route.corners[number]
        ramps_s = (leg.profile.ramp.duration_s + route.legs[number + 1].profile.ramp.duration_s) / 2
        extra_s = corner.time_lost_s - ramps_s  # negative by the overlap of the two motions
        arrivals_s[leg.first + 1 : corner.waypoint + 1] = clock_s - corner.blend.duration_s / 2
        clock_s += extra_s
    return arrivals_s
