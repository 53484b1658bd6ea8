"""Measuring drawn lines by the drive model, step by step: what they cost in time, and what their band misses of what is required.

Most lines that a search tries are worse than those it has, and mostly the first look shows it: a line through a fence, a way round. So
the steps go from the cheapest to the dearest, each can only make lines cost more, and who compares stops as soon as the answer is sure.

**The steps.** The drawn lines against the fence (distances of legs, remembered leg by leg); the time; the band's pieces against the fence,
taken as convex hulls; pieces that lie inside a fence, the deeper the worse, so that a search is led out of it; and what the vehicle's own
avoidance adds, only where the rest is nearly enough. After any of them ``cost_s`` is a lower bound of the finished cost.

**The cost** is one number in seconds, so that candidates can be ordered while clearance is still missing: the predicted time, a little for each
waypoint and for turns that follow at once, and prices for missing clearance and for drawn legs through a fence. The prices only order the
candidates of a search. What is promised does not rest on them: `is_enough` asks for the clearance itself.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
import shapely

from missions.drive_model import plan_drive
from missions.drive_model.avoidance import ground_behind
from missions.drive_model.fence_ahead import FenceEdges
from missions.fitting import moves
from missions.fitting import polyline as drawn
from missions.geo import LocalPoint

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from numpy.typing import NDArray

    from missions.drive_model import Drive
    from missions.drive_model.from_points import KnownCorners
    from missions.fitting.polyline import Drawing
    from missions.ground.ground import Ground
    from missions.vehicle import Vehicle

ENOUGH_M = 0.002
"""What may be missing: less than rounding to degE7 adds, which is required on top."""

MOST_KNOWN = 3000
"""Parts of lines that a gauge remembers, some 10 kB each: of more it begins anew, and measures the same again."""

UNBOUNDED_EXTRA_M = 2.0
"""What unbounded corners have to keep on top: measured ones left the band by up to 1.6 m (docs/drive-model.md, "Where it does not hold")."""

TURN_BACK_DEG, TURN_BACK_EXTRA_M = 165.0, 4.0
"""A turn so sharp may be driven round either side, and the model predicts one; a steered rover that came back at 1 m/s swung out by 3.6 m (docs/drive-model.md)."""

# Chosen, not measured: prices that order the candidates of a search.
# A slow stretch costs 8 to 18 s when measured: worth it for some 0.1 m that would else be missing
_MISSING_COST_S_PER_M = 100.0
_CROSSING_COST_S = 10_000.0  # more than any drive takes or misses: a leg through a fence is never worth it
_POINT_COST_S = 0.3  # between equal lines the one with fewer waypoints
_NEAR_TURNS_COST_S = 3.0  # two turns within `moves.APART_M`: driven as one, and less surely predicted
_TURN_DEG = 5.0  # what counts as a turn for that
# With more than this missing the avoidance is not reckoned: it is the dearest step and can only add
_FAR_FROM_ENOUGH_M = 0.7


_Looked = tuple["NDArray[np.object_]", "NDArray[np.float64]", "NDArray[np.int64]", "NDArray[np.float64]"]
"""What was looked at of one way to drive: convex pieces, their bands, their waypoints, what they keep."""


@dataclass(frozen=True, slots=True)
class Measured:
    """What the drive model predicts for drawn lines.

    Parameters
    ----------
    missing_m : tuple of float
        What is missing of the required clearance at each point, 0 where nothing is.
    worst : tuple of LocalPoint
        Where the band comes nearest to a fence, for each point; nan where nothing is missing.
    cost_s : float
        Time, and what is missing as time.
    """

    missing_m: tuple[float, ...]
    worst: tuple[LocalPoint, ...]
    cost_s: float

    @property
    def worst_index(self) -> int:
        """The point where most is missing; the first of several."""
        return max(range(len(self.missing_m)), key=lambda number: self.missing_m[number])

    @property
    def is_enough(self) -> bool:
        """Whether the band keeps what is required."""
        return max(self.missing_m) <= ENOUGH_M

    @property
    def kept_cost_s(self) -> float:
        """What the lines would cost if nothing were missing."""
        return self.cost_s - _MISSING_COST_S_PER_M * sum(self.missing_m)


class Gauge:
    """Measures lines on a field; what was measured once, whole lines or one leg of them, is known.

    Parameters
    ----------
    ground : Ground
        The field.
    vehicle : Vehicle
        What drives.
    heading_deg : float or None
        Where it faces at the start; None along its first leg.
    """

    def __init__(self, ground: Ground, vehicle: Vehicle, heading_deg: float | None) -> None:
        self.ground, self.vehicle, self.heading_deg = ground, vehicle, heading_deg
        # Trials hold this and not the gauge, which holds them: that would be a cycle, which only garbage collection frees.
        self._surroundings = Surroundings(ground, vehicle, heading_deg)
        self._trials: dict[tuple[Drawing, bool, bool], Trial] = {}

    def trial(self, drawing: Drawing, begin: int, end: int) -> Trial:
        """Return the points from ``begin`` to before ``end``, for measuring; its ends that are not ends of the lines do not count."""
        key = (drawing[begin:end], begin == 0, end == len(drawing))
        trial = self._trials.get(key)
        if trial is None:
            if len(self._trials) >= MOST_KNOWN:
                self._trials.clear()
            trial = self._trials[key] = Trial(self._surroundings, *key)
        return trial

    def look_at_legs(self, parts: Iterable[Drawing]) -> None:
        """Measure the drawn legs of parts of lines, at once, which takes less than one part after another."""
        self._surroundings.look_at(itertools.chain.from_iterable(map(drawn.legs, parts)))

    def measure(self, drawing: Drawing) -> Measured:
        """Measure whole lines."""
        return self.trial(drawing, 0, len(drawing)).measured()


class Surroundings:
    """What lines are measured against: a field and a vehicle, as `Gauge` takes them; how far legs are from the fence is known.

    Parameters
    ----------
    ground : Ground
    vehicle : Vehicle
    heading_deg : float or None
    """

    def __init__(self, ground: Ground, vehicle: Vehicle, heading_deg: float | None) -> None:
        self.ground, self.vehicle = ground, vehicle
        self.edges = FenceEdges(ground.avoided_edge)
        self.corners: dict[int, KnownCorners] = {}
        self._heading_deg = heading_deg
        self._legs_m: dict[tuple[LocalPoint, LocalPoint], float] = {}

    def part_heading_deg(self, part: Drawing, *, is_first: bool) -> float:
        """Return the vehicle's heading where a part of the lines begins."""
        if is_first and self._heading_deg is not None:
            return self._heading_deg
        east, north = drawn.direction(part[0], part[1])
        return math.degrees(math.atan2(east, north))

    def legs_m(self, part: Drawing) -> list[float]:
        """Return the distance of each drawn leg from the fence."""
        legs = drawn.legs(part)
        self.look_at(legs)
        return [self._legs_m[leg] for leg in legs]

    def look_at(self, legs: Iterable[tuple[LocalPoint, LocalPoint]]) -> None:
        """Measure those of some drawn legs that are not known."""
        known = self._legs_m
        new = list(dict.fromkeys(leg for leg in legs if leg not in known))
        if new:
            lines = np.asarray(shapely.linestrings(np.array(new)))
            known |= zip(new, self.distances_m(lines).tolist(), strict=True)

    def distances_m(self, shapes: NDArray[np.object_]) -> NDArray[np.float64]:
        """Return the distance of shapes from the fence; infinite without one."""
        edge = self.ground.edge
        return np.full(len(shapes), np.inf) if edge.is_empty else np.asarray(shapely.distance(shapes, edge))


class Trial:
    """Lines, or a part of them, as far as they were measured.

    Parameters
    ----------
    surroundings : Surroundings
        What they are measured against.
    part : tuple of DrawnPoint
        The points.
    is_first, is_last : bool
        Whether the part begins and ends where the lines do; else its first and last point do not count.
    """

    __slots__ = (
        "_bands_m",
        "_clearances_m",
        "_cores",
        "_drive",
        "_duration_s",
        "_is_first",
        "_is_last",
        "_looked",
        "_measured",
        "_missing_by_lines_m",
        "_near_turns",
        "_other_cost_s",
        "_part",
        "_required_m",
        "_steps",
        "_surroundings",
        "_waypoints",
        "cost_s",
        "may_be_enough",
        "missing_m",
    )

    missing_m: NDArray[np.float64]
    """What is missing at each point by the steps taken; more may be."""

    may_be_enough: bool
    """Whether nothing is known to be missing; with all steps taken, whether the band keeps what is required."""

    cost_s: float
    """What the lines cost by the steps taken, or more."""

    _drive: Drive
    _cores: NDArray[np.object_]
    _bands_m: NDArray[np.float64]
    _waypoints: NDArray[np.int64]
    _clearances_m: NDArray[np.float64]

    def __init__(self, surroundings: Surroundings, part: Drawing, is_first: bool, is_last: bool) -> None:  # noqa: FBT001 - two of a kind
        self._surroundings, self._part = surroundings, part
        self._is_first, self._is_last = is_first, is_last
        self._duration_s = 0.0
        self._near_turns = _near_turns(part)
        self._measured: Measured | None = None
        # Functions of any trial: bound to this one they would be a cycle, which only garbage collection frees.
        self._steps: list[Callable[[Trial], None]] = [Trial._avoid, Trial._dive, Trial._time]
        self._look_at_lines()

    def refine(self) -> bool:
        """Take the next step; False where all are taken."""
        if self._steps:
            self._steps.pop()(self)
        return not self.is_finished

    @property
    def is_finished(self) -> bool:
        """Whether all steps are taken."""
        return not self._steps

    @property
    def missing_in_all_m(self) -> float:
        """All together of what is missing at the points."""
        return float(np.add.reduce(self.missing_m))

    def finish(self) -> Trial:
        """Take all steps."""
        while self.refine():
            pass
        return self

    def measured(self) -> Measured:
        """Return the measured lines once all steps are done: their time, and where the band comes too near."""
        if self._measured is None:
            self.finish()
            self._measured = Measured(tuple(self.missing_m.tolist()), self._worst(), self.cost_s)
        return self._measured

    def _look_at_lines(self) -> None:
        missing_m, crossings = [0.0], 0
        for point, line_m in zip(self._part[1:], self._surroundings.legs_m(self._part), strict=True):
            missing_m.append(max(point.line_m - line_m, 0.0))
            crossings += line_m <= 0 and math.isfinite(point.line_m)
        self._missing_by_lines_m = np.array(missing_m)
        self._other_cost_s = _CROSSING_COST_S * crossings
        self._miss(self._missing_by_lines_m.copy())

    def _time(self) -> None:
        part = self._part
        self._required_m = np.array([point.required_m for point in part])
        self._drive = plan_drive(
            drawn.places(part),
            self._surroundings.vehicle,
            heading_deg=self._surroundings.part_heading_deg(part, is_first=self._is_first),
            speeds=drawn.speeds(part),
            stops=drawn.stops(part),
            known=self._surroundings.corners,
        )
        self._duration_s = float(self._drive.arrivals_s[-1])
        # Of an unknown firmware the older one's band comes last here, so first there: it is mostly the wider.
        self._steps += [partial(Trial._look_at_band, way=way) for way in range(len(self._drive.ways))]
        self._looked: list[_Looked] = []
        self._add_up()

    def _look_at_band(self, way: int) -> None:
        pieces = self._drive.pieces(way)
        cores, bands_m = pieces.convex(), np.array(pieces.bands_m)
        clearances_m = self._surroundings.distances_m(cores) - bands_m
        self._looked.insert(0, (cores, bands_m, np.array(pieces.waypoints, dtype=np.int64), clearances_m))
        if len(self._looked) == 1:
            self._cores, self._bands_m, self._waypoints, self._clearances_m = self._looked[0]
        else:
            self._cores, self._bands_m, self._waypoints, self._clearances_m = (
                np.concatenate(column) for column in zip(*self._looked, strict=True)
            )
        self._settle(way)

    def _dive(self, begin: int = 0) -> None:
        """Count pieces inside a fence for more, the deeper they lie."""
        inside = begin + (self._clearances_m[begin:] <= -self._bands_m[begin:]).nonzero()[0]
        if len(inside):
            beyond = shapely.difference(self._cores[inside], self._surroundings.ground.allowed)
            self._clearances_m[inside] -= np.sqrt(shapely.area(beyond)) + shapely.length(beyond) / 10
            self._settle()

    def _avoid(self) -> None:
        """Count what the vehicle's avoidance adds, where the band is not far from enough without it."""
        around = self._surroundings
        if (self._required_m[self._waypoints] - self._clearances_m).max() >= _FAR_FROM_ENOUGH_M:
            return
        drive = self._drive
        behind = ground_behind(drive.points, drive.plan(0), drive.middles_m, around.vehicle, around.edges)
        if behind:
            plain = len(self._cores)
            own = (self._cores, self._bands_m, self._waypoints)
            self._cores, self._bands_m, self._waypoints = (
                np.concatenate(column) for column in zip(own, *behind, strict=True)
            )
            more_m = around.distances_m(self._cores[plain:]) - self._bands_m[plain:]
            self._clearances_m = np.concatenate([self._clearances_m, more_m])
            self._steps.append(partial(Trial._dive, begin=plain))
            self._settle()

    def _settle(self, first_way: int = 0) -> None:
        """Count what the band misses at each point, of the ways looked at."""
        required_m = self._required_m
        least_m = np.full(len(required_m), np.inf)
        np.minimum.at(least_m, self._waypoints, self._clearances_m)
        missing_m = np.maximum(required_m - least_m, self._missing_by_lines_m)
        ways = range(first_way, len(self._drive.ways))
        for corner in (corner for way in ways for corner in self._drive.plan(way).corners):
            turns_back = abs(corner.turn_deg) > TURN_BACK_DEG and not corner.pivots
            if not corner.bounded or turns_back:
                here = slice(corner.waypoint, corner.waypoint + 2)
                extra_m = TURN_BACK_EXTRA_M if turns_back else UNBOUNDED_EXTRA_M
                missing_m[here] = np.maximum(missing_m[here], required_m[here] + extra_m - least_m[here])
        self._miss(missing_m)

    def _miss(self, missing_m: NDArray[np.float64]) -> None:
        if not self._is_first:
            missing_m[0] = 0.0
        if not self._is_last:
            missing_m[-1] = 0.0
        self.missing_m = missing_m
        self.may_be_enough = bool(np.maximum.reduce(missing_m) <= ENOUGH_M)
        self._add_up()

    def _add_up(self) -> None:
        self.cost_s = (
            self._duration_s
            + _POINT_COST_S * len(self._part)
            + _NEAR_TURNS_COST_S * self._near_turns
            + _MISSING_COST_S_PER_M * self.missing_in_all_m
            + self._other_cost_s
        )

    def _worst(self) -> tuple[LocalPoint, ...]:
        pieces = np.full(len(self._part), -1)
        for piece in np.argsort(-self._clearances_m):
            pieces[self._waypoints[piece]] = piece
        return tuple(
            self._nearest(int(piece)) if missing > ENOUGH_M and piece >= 0 else LocalPoint(math.nan, math.nan)
            for piece, missing in zip(pieces, self.missing_m, strict=True)
        )

    def _nearest(self, piece: int) -> LocalPoint:
        line = shapely.shortest_line(self._cores[piece], self._surroundings.ground.edge)
        return LocalPoint(*shapely.get_coordinates(line)[0].tolist())


def _near_turns(drawing: Drawing) -> int:
    """Count turns so near to the next that a rover drives them as one."""
    return sum(
        math.dist(drawing[index].place, drawing[index + 1].place) < moves.APART_M
        and all(abs(drawn.turn_deg(drawing, turn)) > _TURN_DEG for turn in (index, index + 1))
        for index in range(1, len(drawing) - 2)
    )
