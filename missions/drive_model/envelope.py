"""The envelope: the band a rover stays in while it drives a list of waypoints, and how long it takes."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
import shapely

from missions.drive_model.speeds import speeds_along_mps

if TYPE_CHECKING:
    from numpy.typing import NDArray
    from shapely.geometry.base import BaseGeometry

    from missions.drive_model.legs_and_corners import DrivePlan

# Chords in a quarter circle of a buffered band, which is widened so that they lie outside the circle
QUARTER_SEGMENTS = 8
_ROUNDING_M = 2e-6
"""What joining many polygons may take from their outline."""


@dataclass(frozen=True, slots=True)
class Corner:
    """The prediction at one waypoint between two legs.

    Parameters
    ----------
    waypoint : int
        Its number in the list of points, from 0 (the last of several that lie on one another).
    turn_deg : float
        How the course changes, to the right positive.
    stops, pivots : bool
        Whether the rover comes to rest there; whether it then turns on the spot.
    inside_cut_m, outside_overshoot_m : float
        How far it may get off its two legs to the inside and to the outside of the turn, the band included.
    reach_m : float
        How far before and after the waypoint it may leave the legs for the cut.
    middle_m, least_middle_m : float
        How far before and after the waypoint the middle of the cut lies along each leg, at the most and at the least; 0 where it stops.
    time_lost_s : float
        Against driving on at full speed.
    bounded : bool
        False at a sharp turn between short legs (measured rovers with steered wheels left the model's bounds there), at a turn
        where the speed changes, which was not measured, and before ArduPilot 4.6 at any that was not.
    """

    waypoint: int
    turn_deg: float
    stops: bool
    pivots: bool
    inside_cut_m: float
    outside_overshoot_m: float
    reach_m: float
    middle_m: float
    least_middle_m: float
    time_lost_s: float
    bounded: bool


@dataclass(frozen=True, slots=True)
class Leg:
    """The prediction on one leg, between two points of the list.

    Parameters
    ----------
    first : int
        The number of the point it leaves; it leads to the next.
    length_m : float
    top_speed_mps : float
        The highest speed reached; short legs do not reach the speed asked for.
    half_width_m : float
        The straight-line band.
    left_m, right_m : float
        The farthest the rover may be to either side of it outside its corners, the band and tails of corners included.
    """

    first: int
    length_m: float
    top_speed_mps: float
    half_width_m: float
    left_m: float
    right_m: float


@dataclass(frozen=True)
class Envelope:
    """The band a rover stays in while it drives a list of points, and when it comes to each.

    Parameters
    ----------
    points : ndarray of float, shape (n, 2)
        What is driven, east and north in metres, the vehicle's own place first.
    cores : ndarray of shapely geometries, shape (m,)
        Convex pieces; the envelope is each grown by its band.
    bands_m : ndarray of float, shape (m,)
        How far each piece is to be grown.
    waypoints : ndarray of int, shape (m,)
        The waypoint each piece belongs to: a corner's, or the one its leg leads to.
    corners : tuple of Corner
    legs : tuple of Leg
    arrivals_s : ndarray of float, shape (n,)
        When the rover passes each point, from its start on.
    motion : DrivePlan
        The legs and corners that tell these times.
    """

    points: NDArray[np.float64]
    cores: NDArray[np.object_]
    bands_m: NDArray[np.float64]
    waypoints: NDArray[np.int64]
    corners: tuple[Corner, ...]
    legs: tuple[Leg, ...]
    arrivals_s: NDArray[np.float64]
    motion: DrivePlan

    @property
    def duration_s(self) -> float:
        """The time from the start to rest at the last point."""
        return float(self.arrivals_s[-1])

    def speeds_mps(self, along_m: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the predicted speed at places so far along the lines through the points, shape (m,)."""
        return speeds_along_mps(self.motion, self.points, along_m)

    @cached_property
    def area(self) -> BaseGeometry:
        """The whole band as one geometry (polygons), in metres."""
        return shapely.union_all(self.pieces)

    @cached_property
    def pieces(self) -> NDArray[np.object_]:
        """The band piece by piece, in the order of `waypoints`."""
        # Buffers of few segments lie inside the true circle; grown a little they hold it.
        grown_m = self.bands_m / np.cos(np.pi / (4 * QUARTER_SEGMENTS)) + _ROUNDING_M
        pieces: NDArray[np.object_] = shapely.buffer(self.cores, grown_m, quad_segs=QUARTER_SEGMENTS)
        return pieces

    def clearances_m(self, obstacle: BaseGeometry) -> NDArray[np.float64]:
        """Return the distance of each piece from a geometry, negative by its band at most where they meet.

        Parameters
        ----------
        obstacle : shapely geometry
            What must not be touched: forbidden areas, or the boundary of the allowed one; metres.

        Returns
        -------
        ndarray of float, shape (m,)
            In the order of `waypoints`; infinite for an empty geometry.
        """
        if obstacle.is_empty:
            return np.full(len(self.cores), np.inf)
        return np.asarray(shapely.distance(self.cores, obstacle) - self.bands_m, dtype=np.float64)

    def clearance_m(self, obstacle: BaseGeometry) -> float:
        """Return the least distance of the driven track from a geometry: the least of `clearances_m`."""
        return float(self.clearances_m(obstacle).min(initial=np.inf))
