"""Building an envelope: legs and corners to pieces of a band."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from missions.drive_model import corner as at_corner
from missions.drive_model import pursuit
from missions.drive_model.band import Pieces, add_corner, add_end, add_leg, add_start
from missions.drive_model.envelope import Envelope
from missions.drive_model.from_points import SAME_PLACE_M, drive_plan
from missions.drive_model.stray import Stray
from missions.drive_model.summary import arrivals_s, told_corner, told_leg
from missions.errors import InvalidPositionError, VehicleError
from missions.vehicle.parameters import LEAST_MPS

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import ArrayLike, NDArray

    from missions.drive_model.envelope import Corner
    from missions.drive_model.from_points import KnownCorners
    from missions.drive_model.legs_and_corners import DrivePlan
    from missions.vehicle import Vehicle


def envelope(
    points: ArrayLike,
    vehicle: Vehicle,
    *,
    heading_deg: float | None = None,
    speeds: Sequence[float | None] | None = None,
    stops: Mapping[int, float] | None = None,
) -> Envelope:
    """Predict how a vehicle drives a list of points.

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
        A speed below 0.05 m/s, or not one for each leg.
    """
    return plan_drive(points, vehicle, heading_deg=heading_deg, speeds=speeds, stops=stops).envelope


def plan_drive(
    points: ArrayLike,
    vehicle: Vehicle,
    *,
    heading_deg: float | None = None,
    speeds: Sequence[float | None] | None = None,
    stops: Mapping[int, float] | None = None,
    known: dict[int, KnownCorners] | None = None,
) -> Drive:
    """Predict a drive step by step: first its time, and only if need be its band; see `envelope`.

    What becomes known of the vehicle's corners, as one or as the other it may be, serves its other drives.
    """
    array = _checked(points)
    _check_speeds(speeds, len(array) - 1)
    starts = [_start(array, vehicle, heading_deg)]
    if heading_deg is None and len(array) > 1:
        # Starting straight on it is sooner at speed, and then strays further from short legs than after the worst start.
        starts.append(_start(array, vehicle, _bearing_deg(array)))
    ways, corners = [], []
    for number, one in enumerate(_of_known_corners(vehicle)):
        ways += [(one, *start) for start in starts]
        corners += [{} if known is None else known.setdefault(number, {})] * len(starts)
    return Drive(array, tuple(ways), speeds, stops or {}, tuple(corners))


def _of_known_corners(vehicle: Vehicle) -> Sequence[Vehicle]:
    """Return the vehicle; where its firmware may be older than 4.6 or not, or its RA_ACC_RAD_MAX is not known, as either: the worse of both counts."""
    steers = vehicle.pursuit
    if steers is not None and steers.acceptance_max_m is None:
        return tuple(
            replace(vehicle, pursuit=replace(steers, acceptance_max_m=most_m)) for most_m in (3.0, -1.0)
        )
    if vehicle.has_measured_corners is not None:
        return (vehicle,)
    return tuple(replace(vehicle, has_measured_corners=has_them) for has_them in (True, False))


@dataclass(frozen=True, eq=False)
class Drive:
    """A drive of which each part is made when it is asked for.

    Parameters
    ----------
    points : ndarray of float, shape (n, 2)
        What is driven, east and north in metres.
    ways : tuple of (Vehicle, Stray, float)
        How it may be driven: with another age of the firmware, or another heading at the start, which swings out and takes the rover so
        far behind its place. The first tells the time.
    speeds : sequence of float or None, or None
        The speed asked for on each leg.
    stops : mapping of int to float
        Where it stops, and for how many seconds.
    known : tuple of dict
        What is known of the corners of each way.
    """

    points: NDArray[np.float64]
    ways: tuple[tuple[Vehicle, Stray, float], ...]
    speeds: Sequence[float | None] | None
    stops: Mapping[int, float]
    known: tuple[KnownCorners, ...]
    _plans: dict[int, DrivePlan] = field(default_factory=dict, init=False)

    def plan(self, way: int) -> DrivePlan:
        """Return the legs and corners of one way."""
        if way not in self._plans:
            vehicle, stray, _ = self.ways[way]
            corners = self.known[way]
            self._plans[way] = drive_plan(self.points, vehicle, self.speeds, self.stops, stray, corners)
        return self._plans[way]

    @property
    def plans(self) -> tuple[DrivePlan, ...]:
        """The legs and corners of each way."""
        return tuple(map(self.plan, range(len(self.ways))))

    @property
    def middles_m(self) -> tuple[list[float], list[float]]:
        """How far from each corner the middle of its cut lies along the legs, at the most and at the least."""
        ways = [[corner.blend.reach_m for corner in plan.corners] for plan in self.plans]
        return list(map(max, ways[0], *ways)), list(map(min, ways[0], *ways))

    @cached_property
    def arrivals_s(self) -> NDArray[np.float64]:
        """When the rover passes each point, from its start on, shape (n,)."""
        return arrivals_s(self.plan(0), len(self.points))

    def pieces(self, *ways: int) -> Pieces:
        """Return the pieces of the band of some ways, as the places about which they lie."""
        pieces = Pieces()
        for way in ways:
            _add_plan(pieces, self.plan(way), self.points, self.ways[way][2])
        return pieces

    @property
    def envelope(self) -> Envelope:
        """The band, with the predictions for corners and legs."""
        pieces = self.pieces(*range(len(self.ways)))
        plan = self.plan(0)
        return Envelope(
            points=self.points,
            cores=pieces.convex(),
            bands_m=np.array(pieces.bands_m),
            waypoints=np.array(pieces.waypoints, dtype=np.int64),
            corners=tuple(told_corner(self.plans, number) for number in range(len(plan.corners))),
            legs=tuple(told_leg(self.plans, number) for number in range(len(plan.legs))),
            arrivals_s=self.arrivals_s,
            motion=plan,
        )


def _add_plan(pieces: Pieces, plan: DrivePlan, points: NDArray[np.float64], behind_m: float) -> None:
    add_start(pieces, plan, points, behind_m)
    for number in range(len(plan.legs)):
        add_leg(pieces, plan, number)
        if number < len(plan.corners):
            add_corner(pieces, plan, number)
    add_end(pieces, plan)


def _bearing_deg(points: NDArray[np.float64]) -> float:
    """Return the bearing of the first leg that has a length."""
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
    """Predict one corner by itself, without the tails of others.

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
    speeds = [speed_mps, speed_mps]
    plans = [drive_plan(points, known, speeds, stops, Stray()) for known in _of_known_corners(vehicle)]
    return told_corner(plans, 0)


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
        raise VehicleError(f"{legs} legs need {legs} speeds, not {len(speeds)}", legs=legs)
    for number, speed_mps in enumerate(speeds):
        if speed_mps is not None and not LEAST_MPS <= speed_mps < math.inf:
            raise VehicleError(
                f"a speed of {speed_mps:g} m/s on leg {number} cannot be predicted; the minimum is {LEAST_MPS:g} m/s",
                leg=number,
            )


def _start(array: NDArray[np.float64], vehicle: Vehicle, heading_deg: float | None) -> tuple[Stray, float]:
    """Return the swing at the start, and how far behind its place it takes the rover."""
    here = array[0].tolist()
    step = next((place for place in array.tolist() if math.dist(place, here) >= SAME_PLACE_M), None)
    if step is None:
        return Stray(), 0.0
    if heading_deg is None:
        off_deg = at_corner.UNKNOWN_START_DEG if vehicle.pursuit is None else 180.0
        swing_m = at_corner.start_swing_m(vehicle, off_deg)
        return Stray(swing_m, swing_m), at_corner.start_behind_m(vehicle, off_deg)
    east_m, north_m = step[0] - here[0], step[1] - here[1]
    error_deg = (heading_deg - math.degrees(math.atan2(east_m, north_m)) + 180.0) % 360.0 - 180.0
    swing_m = at_corner.start_swing_m(vehicle, error_deg)
    either_side = abs(error_deg) > EITHER_SIDE_DEG
    stray = Stray(
        swing_m if error_deg < 0 or either_side else 0.0, swing_m if error_deg >= 0 or either_side else 0.0
    )
    if vehicle.pursuit is not None:
        back_m = pursuit.start_back_swing_m(vehicle, vehicle.pursuit, error_deg)
        stray = stray.wider(Stray(back_m, back_m))
    return stray, at_corner.start_behind_m(vehicle, error_deg)


EITHER_SIDE_DEG = 165.0
"""A start that faces farther back than this may swing to either side. Chosen, not measured: it bounds where little decides on the side."""
