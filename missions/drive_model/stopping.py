"""How far a rover rolls on after HOLD or disarming, by its speed; and from where on a drive that ends beyond a fence.

HOLD does not brake (ATC_DECEL_MAX changes nothing): the throttle goes to 0 and the rover rolls straight on (sideways 0.00 m measured).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
import shapely

from missions.drive_model.avoidance import STEP_S, TargetPoint
from missions.drive_model.fence_ahead import FenceAhead, FenceEdges
from missions.vehicle import Steering

if TYPE_CHECKING:
    from numpy.typing import NDArray
    from shapely.geometry.base import BaseGeometry

    from missions.drive_model.envelope import Envelope
    from missions.geo import LatLon
    from missions.stops import Stops
    from missions.vehicle import Vehicle

MEASURED: dict[Steering, tuple[tuple[float, float], ...]] = {
    Steering.ACKERMANN: ((0.99, 1.98), (1.99, 4.05), (2.99, 6.19), (4.98, 10.60), (7.99, 17.61)),
    Steering.SKID: ((1.0, 0.42), (2.0, 1.09), (3.0, 2.00), (4.0, 3.18)),
}
"""The longest HOLD of each speed in ArduPilot's software in the loop (builds of November 2024, October 2025 and February 2026 alike): speed in m/s,
distance in m. By the rolling resistance of its simulated vehicle, which is nobody's rover: shorter on grass, longer downhill."""

SIMULATED = "from ArduPilot's simulation, not your rover"
OWN, GIVEN = "its own stops", "--stopping"
"""Where a stopping distance comes from."""

_REACH = 2.0
"""A stop tells of speeds up to so many times its own: by then its distance has grown fourfold. Chosen, not measured."""

_MOST_SAMPLES = (
    4000  # of a drive: one in 1.5 m at 5 m/s, up to 20 minutes; longer drives are looked at more seldom
)
_STEP_M = 0.5  # between places of a drive by pure pursuit; chosen
_LONGEST_S = 86_400.0  # longer drives are not looked at; chosen, bounds memory


@dataclass(frozen=True, eq=False)
class Leaving:
    """How far HOLDs take a vehicle, and how far beyond the allowed area.

    Parameters
    ----------
    reach_m : ndarray of float, shape (n,)
        How far it goes from each place.
    beyond_m : ndarray of float, shape (n,)
        How far beyond the edge that is; negative infinite where it stays within.
    ends : ndarray of float, shape (n, 2), or None
        Where it is farthest beyond; None: straight on.
    """

    reach_m: NDArray[np.float64]
    beyond_m: NDArray[np.float64]
    ends: NDArray[np.float64] | None = None


@dataclass(frozen=True)
class Stopping:
    """How far a vehicle rolls on, by its speed.

    Between stops of several speeds by straight lines, below the slowest in proportion to the speed (as measured rovers do), above the fastest with its
    square (as constant friction would have it): each the longer of what may be.

    Parameters
    ----------
    stops : Stops
        What is known of this vehicle.
    steering : Steering
        Whose measured rows stand in for what is not.
    """

    stops: Stops
    steering: Steering

    def distance_m(self, speed_mps: float) -> float:
        """Return how far it rolls on from a speed."""
        return float(self.distances_m(np.array([speed_mps]))[0])

    def distances_m(self, speeds_mps: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return how far it rolls on from each of several speeds."""
        measured_m = _scaled_m(_curve(MEASURED[self.steering]), speeds_mps)
        if self._known is None:
            return measured_m
        most_mps = _REACH * self._known[0][-1]
        known_m = _scaled_m(self._known, np.minimum(speeds_mps, most_mps))
        longer_m = np.maximum(known_m, measured_m)
        return np.asarray(np.where(speeds_mps > most_mps, longer_m, known_m))

    def rest_s(self, speed_mps: float) -> float:
        """Return how long it rolls on from a speed: at half of that on average."""
        return 2 * self.distance_m(speed_mps) / speed_mps

    def leaves(
        self, moving: Motion, allowed: BaseGeometry, more_m: NDArray[np.float64] | float = 0.0
    ) -> Leaving:
        """Return how each HOLD on a way leaves the allowed area: straight on.

        Parameters
        ----------
        moving : Motion
            Where it is, and how fast.
        allowed : shapely geometry
            Where it may be, metres.
        more_m : ndarray of float or float
            How far it goes on before that, from each place.
        """
        reach_m = self.distances_m(moving.speeds_mps) + more_m
        return Leaving(reach_m, reach_m - roll_out_m(moving, reach_m, allowed))

    def source(self, speed_mps: float) -> str:
        """Return in words what the distance rests on at a speed."""
        if self._known is None or speed_mps > _REACH * self._known[0][-1]:
            return SIMULATED
        told = [name for name, found in ((GIVEN, self.stops.given), (OWN, self.stops.own)) if found]
        return f"from {' and '.join(told)}"

    @cached_property
    def _known(self) -> tuple[NDArray[np.float64], NDArray[np.float64]] | None:
        known = sorted((one.speed_mps, one.distance_m) for one in (*self.stops.given, *self.stops.own))
        return _curve(known) if known else None


def _curve(
    points: list[tuple[float, float]] | tuple[tuple[float, float], ...],
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return speeds and distances, from standing on; no distance is less than that of a slower stop."""
    speeds_mps, distances_m = np.array([(0.0, 0.0), *points]).T
    return speeds_mps, np.maximum.accumulate(distances_m)


def _scaled_m(
    curve: tuple[NDArray[np.float64], NDArray[np.float64]], speeds_mps: NDArray[np.float64]
) -> NDArray[np.float64]:
    beyond = np.maximum(speeds_mps / curve[0][-1], 1.0)
    return np.asarray(np.interp(speeds_mps, *curve) * beyond**2)


@dataclass(frozen=True, eq=False)
class Motion:
    """Where a vehicle is predicted to be on a drive, and how fast, a fraction of a second apart.

    Parameters
    ----------
    places : ndarray of float, shape (n, 2)
        East and north in metres.
    speeds_mps : ndarray of float, shape (n,)
    ways : ndarray of float, shape (n, 2)
        Directions of length 1.
    """

    places: NDArray[np.float64]
    speeds_mps: NDArray[np.float64]
    ways: NDArray[np.float64]


def motion(band: Envelope, vehicle: Vehicle, fence: BaseGeometry | None = None) -> Motion | None:
    """Return how a vehicle is predicted to move on a drive, slower where its own avoidance sees a fence ahead; None for a drive of more than a day.

    Parameters
    ----------
    band : Envelope
        The drive.
    vehicle : Vehicle
        What drives.
    fence : shapely geometry, optional
        The lines it avoids, metres; without them it slows down for none.
    """
    if not band.legs or band.duration_s > _LONGEST_S:
        return None
    if vehicle.pursuit is not None:
        return _at_cruise(band)
    target = TargetPoint(band.points, band.motion, [corner.middle_m for corner in band.corners])
    places = target.places.view(np.float64).reshape(-1, 2)
    every = 1 + (len(places) - 2) // _MOST_SAMPLES
    steps = np.diff(places, axis=0)[::every]
    moved_m = np.hypot(*steps.T)
    moves = moved_m > 0
    places, ways = places[:-1][::every][moves], steps[moves] / moved_m[moves, None]
    # Where two motions overlap their sum may be a little faster than the rover lets itself be.
    speeds_mps = np.minimum(moved_m[moves] / STEP_S, max(leg.top_speed_mps for leg in band.legs))
    if len(places) and vehicle.avoids_fence and fence is not None and not fence.is_empty:
        allowed_mps = FenceAhead(FenceEdges(fence), places, vehicle).speeds_mps(
            places, ways, float(speeds_mps.max())
        )
        speeds_mps = np.minimum(speeds_mps, allowed_mps)
    return Motion(places, speeds_mps, ways)


def _at_cruise(band: Envelope) -> Motion:
    """Return the drawn lines at the top speed of each leg: no slower for a corner, the start or the end, which is never too fast."""
    places, speeds_mps, ways = [], [], []
    every_m = max(_STEP_M, sum(leg.length_m for leg in band.legs) / _MOST_SAMPLES)
    for leg in band.legs:
        start, end = band.points[leg.first], band.points[leg.first + 1]
        count = max(2, 1 + int(leg.length_m / every_m))
        shares = np.linspace(0.0, 1.0, count)[:, None]
        places.append(start + shares * (end - start))
        speeds_mps.append(np.full(count, leg.top_speed_mps))
        ways.append(np.repeat((end - start)[None] / leg.length_m, count, axis=0))
    return Motion(np.concatenate(places), np.concatenate(speeds_mps), np.concatenate(ways))


def roll_out_m(moving: Motion, rolls_m: NDArray[np.float64], allowed: BaseGeometry) -> NDArray[np.float64]:
    """Return after how far a vehicle that rolls straight on leaves the allowed area, from each place; infinite where it stops within.

    Parameters
    ----------
    moving : Motion
        Places and directions.
    rolls_m : ndarray of float, shape (n,)
        How far it rolls from each.
    allowed : shapely geometry
        Where it may be, metres.
    """
    starts = moving.places
    lines: NDArray[np.object_] = np.asarray(
        shapely.linestrings(np.stack((starts, starts + moving.ways * rolls_m[:, None]), axis=1))
    )
    shapely.prepare(allowed)
    out_m = np.full(len(starts), np.inf)
    leaving = np.flatnonzero(~shapely.covers(allowed, lines))
    outside = shapely.difference(lines[leaving], allowed)
    points, owners = shapely.get_coordinates(outside, return_index=True)
    np.minimum.at(out_m, leaving[owners], np.hypot(*(points - starts[leaving[owners]]).T))
    return out_m


@dataclass(frozen=True, slots=True)
class RollOut:
    """A HOLD that ends beyond a fence.

    Parameters
    ----------
    at : LatLon
        Where the vehicle is when it takes it.
    speed_mps : float
        How fast it is there.
    stopping_m : float
        How far it rolls on.
    to_fence_m : float
        After how far it is at the fence.
    fence : str or None
        The zone that it comes to.
    """

    at: LatLon
    speed_mps: float
    stopping_m: float
    to_fence_m: float
    fence: str | None

    @property
    def beyond_m(self) -> float:
        """How far beyond the fence's line it stands."""
        return self.stopping_m - self.to_fence_m


@dataclass(frozen=True, slots=True)
class HoldCheck:
    """What HOLD does on a drive.

    Parameters
    ----------
    speed_mps : float
        The fastest that it drives.
    stopping_m : float
        How far it rolls on from that.
    source : str
        What that rests on.
    aside_m : float or None
        How far to a side it goes, where HOLD drives a loop; None where it rolls straight on.
    worst : RollOut or None
        The HOLD that would end farthest beyond a fence; None where every HOLD ends within.
    """

    speed_mps: float
    stopping_m: float
    source: str
    worst: RollOut | None
    aside_m: float | None = None

    @property
    def sentence(self) -> str:
        """What it says to people."""
        if self.aside_m is not None:
            return self._loop_sentence(self.aside_m)
        rolls = f"HOLD does not brake: from {self.speed_mps:.2g} m/s the vehicle rolls on {self.stopping_m:.1f} m ({self.source})"
        if self.worst is None:
            return f"{rolls}, inside the fence from anywhere on the route"
        worst = self.worst
        return (
            f"{rolls}; at {worst.at} ({worst.speed_mps:.1f} m/s) it would stop {worst.beyond_m:.1f} m beyond {worst.fence or 'the fence'}, "
            f"which is {worst.to_fence_m:.1f} m ahead there"
        )

    def _loop_sentence(self, aside_m: float) -> str:
        loops = (
            f"HOLD drives a loop: from {self.speed_mps:.2g} m/s up to {self.stopping_m:.1f} m ahead and {aside_m:.1f} m to a side, "
            f"back to where HOLD began ({self.source})"
        )
        if self.worst is None:
            return f"{loops}, inside the fence from anywhere on the route"
        worst = self.worst
        return (
            f"{loops}; at {worst.at} ({worst.speed_mps:.1f} m/s) it would come {worst.beyond_m:.1f} m beyond {worst.fence or 'the fence'}, "
            f"which is {worst.to_fence_m:.1f} m away there"
        )
