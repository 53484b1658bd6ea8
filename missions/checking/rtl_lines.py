"""Where RTL leads: straight to the place that ArduPilot Rover chooses, from every point of a route.

Which place that is was read in ArduPilot's source, in its state before 4.1 (commit 08b63b03a3f4) and after 4.6 (with ``HAL_RALLY_ENABLED``), which
agree: AP_Rally.cpp, ``find_nearest_rally_point`` and ``calc_best_rally_or_home_location``. The rally point at the least straight distance counts,
whatever stands in between. Home is taken instead where RALLY_LIMIT_KM is above 0 and that point is farther away (home need not be nearer), and, with
RALLY_INCL_HOME, where home is as near. On Rover RALLY_LIMIT_KM is 0.5 and RALLY_INCL_HOME is 1 unless they were changed. Rover/mode_rtl.cpp,
``ModeRTL::_enter``: the place is chosen once, as RTL begins, from where the vehicle is; the line begins where it could stop
(AR_WPNav.cpp, ``get_stopping_location``: straight ahead).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import shapely

from missions.ground.frame import autopilot_distance_m, autopilot_scale
from missions.vehicle import real_number

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from missions.geo import LatLon
    from missions.ground.ground import Ground
    from missions.situation import Situation

RALLY_LIMIT_KM = 0.5
"""RALLY_LIMIT_KM of ArduPilot Rover, unless it was changed."""

_EARTH_M = 6.35e6  # the least radius of curvature of the ellipsoid, so that nothing is underrated
_FLOAT_M = 0.01
"""The autopilot adds up distances in 32-bit floats of degE7: less than a centimetre on any field."""


@dataclass(frozen=True, slots=True)
class ReturnRule:
    """How the autopilot chooses.

    Parameters
    ----------
    includes_home : bool
        RALLY_INCL_HOME: home counts as one of the rally points.
    limit_m : float
        RALLY_LIMIT_KM: beyond it home is taken; 0 is no limit.
    """

    includes_home: bool = True
    limit_m: float = RALLY_LIMIT_KM * 1000

    @classmethod
    def of(cls, parameters: Mapping[str, float]) -> ReturnRule:
        """Return the rule that parameters make.

        Raises
        ------
        VehicleError
            RALLY_LIMIT_KM is impossible.
        """
        limit_km = real_number(parameters, "RALLY_LIMIT_KM", RALLY_LIMIT_KM)
        return cls(parameters.get("RALLY_INCL_HOME", 1.0) != 0, limit_km * 1000)


RALLY_ONLY = ReturnRule(includes_home=False, limit_m=0.0)
"""The nearest rally point, wherever home is: what `ReturnRule` is with RALLY_INCL_HOME 0 and RALLY_LIMIT_KM 0."""


def return_place(situation: Situation, here: LatLon, home: LatLon | None) -> LatLon | None:
    """Return where RTL leads from a place: a rally point, or home; None where neither is known."""
    rally = [point.position for point in situation.rally.value] if situation.rally else []
    if home is None:
        return min(rally, key=lambda place: autopilot_distance_m(here, place), default=None)
    return chosen_place(rally, here, home, ReturnRule.of(situation.parameters))


def chosen_place(rally: Sequence[LatLon], here: LatLon, home: LatLon, rule: ReturnRule) -> LatLon:
    """Return which of the rally points and home the autopilot chooses from a place."""
    if not rally:
        return home
    nearest = min(rally, key=lambda place: autopilot_distance_m(here, place))
    away_m = autopilot_distance_m(here, nearest)
    if 0 < rule.limit_m < away_m:
        return home
    return home if rule.includes_home and not away_m < autopilot_distance_m(here, home) else nearest


@dataclass(frozen=True, eq=False)
class RoutePieces:
    """A route in pieces so short that from all of one the same places are nearest, but for few.

    Parameters
    ----------
    starts, ends : (n, 2) array
        East and north in metres.
    legs : (n,) array of int
        The leg of each, from 0.
    """

    starts: NDArray[np.float64]
    ends: NDArray[np.float64]
    legs: NDArray[np.intp]

    @classmethod
    def of(cls, route: NDArray[np.float64], length_m: float, most: int) -> RoutePieces:
        """Return the pieces of a route through points, none longer than a length, unless there were more than ``most``."""
        route_m = float(np.hypot(*np.diff(route, axis=0).T).sum())
        length_m = max(length_m, route_m / max(1, most - len(route)))
        starts, ends, legs = [], [], []
        for leg in range(len(route) - 1):
            count = max(1, math.ceil(math.dist(route[leg], route[leg + 1]) / length_m))
            points = route[leg] + np.linspace(0, 1, count + 1)[:, None] * (route[leg + 1] - route[leg])
            starts.append(points[:-1])
            ends.append(points[1:])
            legs += [leg] * count
        return cls(np.vstack(starts), np.vstack(ends), np.array(legs, dtype=np.intp))

    @property
    def lengths_m(self) -> NDArray[np.float64]:
        """How long each is."""
        return np.asarray(np.hypot(*(self.ends - self.starts).T))

    def __len__(self) -> int:
        return len(self.legs)


@dataclass(frozen=True, slots=True)
class Metric:
    """The autopilot's distances, by the metres of a local plane.

    Parameters
    ----------
    east, north : float
        The autopilot's metres for each of the plane's.
    slack_m : float
        How far two distances of the autopilot may differ from two of this metric, taken together.
    """

    east: float
    north: float
    slack_m: float

    @classmethod
    def of(cls, ground: Ground, span_m: float) -> Metric:
        """Return the metric of a field in which no two places are farther apart than ``span_m``."""
        lat_deg = ground.frame.origin.lat_deg
        scale = autopilot_scale(lat_deg)
        # The autopilot shortens longitudes by the latitude in the middle of two places, the plane by its origin's.
        bent_m = span_m * (span_m / _EARTH_M) * (math.tan(math.radians(abs(lat_deg))) + span_m / _EARTH_M)
        return cls(1 / scale.east, 1 / scale.north, 2 * (bent_m + _FLOAT_M))

    @property
    def steepest(self) -> float:
        """How much a distance changes at most for each metre that one end is moved."""
        return max(self.east, self.north)

    def distances_m(self, places: NDArray[np.float64], points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return how far each place is from each point, a row a place."""
        away = places[:, None, :] - points[None, :, :]
        return np.asarray(np.hypot(away[..., 0] * self.east, away[..., 1] * self.north))


def may_choose(
    rally_m: NDArray[np.float64],
    home_m: NDArray[np.float64] | None,
    rule: ReturnRule,
    within_m: NDArray[np.float64],
) -> NDArray[np.bool_]:
    """Return which places may be chosen from some point of each piece.

    A distance changes by no more than the way between two points (times `Metric.steepest`): a place that is farther from a piece's middle than another
    one by more than ``within_m`` is farther from all of the piece. So what is not chosen here is chosen from no point of it.

    Parameters
    ----------
    rally_m : (r, n) array
        How far each rally point is from each piece's middle.
    home_m : (n,) array or None
        The same of home; None where it is not known.
    rule : ReturnRule
        How the autopilot chooses.
    within_m : (n,) array
        How far two distances from one point may differ from those from the middle, taken together.

    Returns
    -------
    (r + 1, n) array of bool
        The rally points, and last home.
    """
    count = rally_m.shape[1]
    if not len(rally_m):
        return np.full((1, count), home_m is not None)
    least_m = rally_m.min(axis=0)
    rally = rally_m <= least_m + within_m
    home = np.zeros(count, dtype=bool)
    if home_m is not None:
        if rule.includes_home:
            rally &= rally_m <= home_m + within_m
            home |= home_m <= least_m + within_m
        if rule.limit_m > 0:
            rally &= least_m <= rule.limit_m + within_m
            home |= least_m >= rule.limit_m - within_m
    return np.vstack([rally, home])


def swept(
    pieces: RoutePieces, goals: NDArray[np.float64], which: NDArray[np.bool_]
) -> tuple[NDArray[np.object_], NDArray[np.intp], NDArray[np.intp]]:
    """Return the triangles that the straight lines from pieces to places fill, with the place and the piece of each."""
    place, piece = np.nonzero(which)
    corners = np.stack([pieces.starts[piece], pieces.ends[piece], goals[place]], axis=1)
    points = shapely.multipoints(corners.reshape(-1, 2), indices=np.repeat(np.arange(len(piece)), 3))
    return np.asarray(shapely.convex_hull(points)), place, piece
