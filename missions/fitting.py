"""Fitting drawn lines to a vehicle: until the band it is foreseen to drive in keeps what is required, at the least time.

A descent: where the band comes too near, every means is tried at that corner and measured by the drive model; the best is kept. What
is measured decides, not the means.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
import shapely

from missions import corner_means, drawn
from missions.avoidance import with_avoidance
from missions.drive_model import envelope
from missions.geo import rounded
from missions.local_frame import LocalPoint
from missions.neck import find_neck, straight_through

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

    from numpy.typing import NDArray

    from missions.drawn import Drawing, Vector
    from missions.drive_model import Envelope
    from missions.ground import Ground
    from missions.vehicle import Vehicle


ENOUGH_M = 0.002
"""What may be missing: less than rounding to degE7 adds, which is required on top."""

UNBOUNDED_EXTRA_M = 2.0
"""What corners that left the model when measured (by up to 1.6 m) have to keep on top."""

TURN_BACK_DEG, TURN_BACK_EXTRA_M = 165.0, 4.0
"""A turn so sharp may be driven round either side; the model tells of one."""

FIT_MEASUREMENTS, CRAWL_MEASUREMENTS, MOST_MEASUREMENTS = 500, 350, 1500
"""Taken for one route, for a slow one, and for all that are tried: a search that is not done by then is given up."""

_MISSING_COST_S_PER_M = 100.0
_CROSSING_COST_S = 10_000.0
_POINT_COST_S = 0.3
_NEAR_TURNS_COST_S = 3.0
_TURN_DEG = 5.0
_FAR_FROM_ENOUGH_M = 0.7
_SHORT_LEG_M = 12.0
_LEAST_GAIN_S = 0.05
_CONTEXT = 3
_MORE_TRIES = 12
_EASING_STEPS_M = (6.0, 1.6, 0.5)
_TINY_LEG_M = 2.5
_JOINED_TURN_DEG = 80.0
_GRID_TRIES, _GRID_MEASUREMENTS = 4, 150


@dataclass(frozen=True, slots=True)
class Measured:
    """What the drive model says of lines.

    Parameters
    ----------
    missing_m : tuple of float
        What is missing of the required clearance at each point, 0 where nothing is.
    worst : tuple of (float, float)
        Where the band comes nearest to a fence, for each point.
    cost_s : float
        Time, and what is missing as time.
    """

    missing_m: tuple[float, ...]
    worst: tuple[Vector, ...]
    cost_s: float

    @property
    def worst_index(self) -> int:
        """The point where most is missing; the first of several."""
        return max(range(len(self.missing_m)), key=lambda number: self.missing_m[number])

    @property
    def is_enough(self) -> bool:
        """Whether the band keeps what is required."""
        return max(self.missing_m) <= ENOUGH_M


@dataclass(eq=False)
class Fitting:
    """Lines, a vehicle and a field; `fit` betters the lines.

    Parameters
    ----------
    ground : Ground
        The field.
    vehicle : Vehicle
        What drives.
    heading_deg : float or None
        Where it faces at the start; None along its first leg.
    should_stop : callable, optional
        Asked now and then; True ends the search.
    most_measurements : int
        For all lines that are fitted.
    """

    ground: Ground
    vehicle: Vehicle
    heading_deg: float | None
    should_stop: Callable[[], bool] | None = None
    most_measurements: int = MOST_MEASUREMENTS
    measurements: int = field(default=0, init=False)
    _until: int = field(default=0, init=False)

    def fit(self, drawing: Drawing) -> tuple[Drawing, Measured]:
        """Better lines until their band keeps what is required, or nothing helps."""
        drawn_first = _joined(drawing)
        self._allow(FIT_MEASUREMENTS)
        drawing, measured = self._fitted(self._fewer(drawn_first))
        if not measured.is_enough:
            # Many small corners in little room: begin again, slowly all about them.
            spots = [
                drawing[index].place if math.isnan(place[0]) else place
                for index, (missing_m, place) in enumerate(
                    zip(measured.missing_m, measured.worst, strict=True)
                )
                if missing_m > ENOUGH_M
            ]
            slow = corner_means.crawling(drawn_first, spots, self.vehicle.speed_mps)
            self._allow(CRAWL_MEASUREMENTS)
            other, found = self._fitted(slow)
            if sum(found.missing_m) < sum(measured.missing_m):
                drawing, measured = other, found
        return self._on_grid(drawing, measured)

    def _on_grid(self, drawing: Drawing, measured: Measured) -> tuple[Drawing, Measured]:
        """Round lines as the mission's items will be: the model has steps, and a millimetre may be one too many."""
        for _ in range(_GRID_TRIES):
            if not measured.is_enough:
                break
            drawing = tuple(point.at(self._rounded(point.place)) for point in drawing)
            measured = self.measure(drawing)
            if measured.is_enough:
                break
            self._allow(_GRID_MEASUREMENTS)
            drawing = self._descend(drawing, self._all)
            measured = self.measure(drawing)
        return drawing, measured

    def _rounded(self, place: Vector) -> Vector:
        frame = self.ground.frame
        east_m, north_m = frame.to_local(rounded(frame.to_lat_lon(LocalPoint(*place))))
        return (east_m, north_m)

    def _allow(self, measurements: int) -> None:
        self._until = min(self.measurements + measurements, self.most_measurements)

    def _fitted(self, drawing: Drawing) -> tuple[Drawing, Measured]:
        for means in (self._gentle, self._all):
            drawing = self._descend(drawing, means)
            if self.measure(drawing).is_enough:
                drawing = self._eased(self._fewer(drawing))
                break
        return drawing, self.measure(drawing)

    def _plain(self, drawing: Drawing, heading_deg: float | None) -> Envelope:
        """Give the band of lines without the vehicle's avoidance."""
        return envelope(
            drawn.places(drawing),
            self.vehicle,
            heading_deg=heading_deg,
            speeds=drawn.speeds(drawing),
            stops=drawn.stops(drawing),
        )

    def _clearances_m(self, band: Envelope) -> NDArray[np.float64]:
        """Give what each piece keeps; inside a fence less, the deeper it lies."""
        clearances_m = band.clearances_m(self.ground.edge)
        for piece in np.flatnonzero(clearances_m <= -band.bands_m):
            inside = shapely.difference(band.cores[piece], self.ground.allowed)
            clearances_m[piece] -= math.sqrt(inside.area) + inside.length / 10
        return clearances_m

    def measure(self, drawing: Drawing) -> Measured:
        """Measure whole lines."""
        return self._measure(drawing, 0, len(drawing))

    def _measure(self, drawing: Drawing, begin: int, end: int) -> Measured:
        """Measure the points from ``begin`` to before ``end``; ends of it that are no ends of the lines do not count."""
        self.measurements += 1
        part = drawing[begin:end]
        heading_deg = _course_deg(part) if begin or self.heading_deg is None else self.heading_deg
        required_m = np.array([point.required_m for point in part])
        band = self._plain(part, heading_deg)
        clearances_m = self._clearances_m(band)
        if (required_m[band.waypoints] - clearances_m).max() < _FAR_FROM_ENOUGH_M:
            slowed = with_avoidance(band, self.vehicle, self.ground.edge)
            if slowed is not band:
                band, clearances_m = slowed, self._clearances_m(slowed)
        least_m, pieces = np.full(len(part), np.inf), np.full(len(part), -1)
        for piece in np.argsort(-clearances_m):
            least_m[band.waypoints[piece]] = clearances_m[piece]
            pieces[band.waypoints[piece]] = piece
        legs = shapely.linestrings([[a.place, b.place] for a, b in pairwise(part)])
        lines_m = np.array([np.inf, *np.atleast_1d(shapely.distance(legs, self.ground.edge))])
        lines_m[np.isnan(lines_m)] = np.inf
        asked_m = np.array([point.line_m for point in part])
        missing_m = np.maximum(np.maximum(required_m - least_m, asked_m - lines_m), 0.0)
        for corner in band.corners:
            turns_back = abs(corner.turn_deg) > TURN_BACK_DEG and not corner.pivots
            if not corner.bounded or turns_back:
                here = slice(corner.waypoint, corner.waypoint + 2)
                extra_m = TURN_BACK_EXTRA_M if turns_back else UNBOUNDED_EXTRA_M
                room_m = required_m[here] + extra_m - least_m[here]
                missing_m[here] = np.maximum(missing_m[here], room_m)
        if begin:
            missing_m[0] = 0.0
        if end < len(drawing):
            missing_m[-1] = 0.0
        cost_s = (
            band.duration_s
            + _POINT_COST_S * len(part)
            + _NEAR_TURNS_COST_S * _near_turns(part)
            + _MISSING_COST_S_PER_M * float(missing_m.sum())
            + _CROSSING_COST_S * int(((lines_m <= 0) & np.isfinite(asked_m)).sum())
        )
        worst = [
            self._nearest(band, int(piece)) if missing > ENOUGH_M and piece >= 0 else (math.nan, math.nan)
            for piece, missing in zip(pieces, missing_m, strict=True)
        ]
        return Measured(tuple(missing_m.tolist()), tuple(worst), cost_s)

    def _nearest(self, band: Envelope, piece: int) -> Vector:
        line = shapely.shortest_line(band.cores[piece], self.ground.edge)
        east_m, north_m = shapely.get_coordinates(line)[0].tolist()
        return (east_m, north_m)

    def _away(self, place: Vector) -> Vector:
        """Give the unit vector from the nearest fence to a place."""
        line = shapely.shortest_line(self.ground.edge, shapely.Point(place))
        (east_a, north_a), (east_b, north_b) = shapely.get_coordinates(line).tolist()
        length_m = math.dist((east_a, north_a), (east_b, north_b)) or 1.0
        return ((east_b - east_a) / length_m, (north_b - north_a) / length_m)

    def _gentle(self, drawing: Drawing, index: int, measured: Measured) -> Iterator[Drawing]:
        """Give the means that cost little time."""
        missing_m, place = measured.missing_m[index], measured.worst[index]
        yield from corner_means.moved(drawing, index, missing_m)
        if not math.isnan(place[0]):
            ahead = drawn.direction(drawing[max(index - 1, 0)], drawing[max(index, 1)])
            narrow = find_neck(self.ground.edge, place, ahead)
            if narrow is not None:
                yield from straight_through(drawing, index, narrow)
            yield from corner_means.bent(drawing, index, place, self._away(place), missing_m)
        yield from corner_means.together(drawing, index, missing_m)
        yield from corner_means.without(drawing, index)
        yield from corner_means.merged(drawing, index)
        yield from corner_means.merged(drawing, index - 1)
        if _is_corner(drawing, index) and abs(drawn.turn_deg(drawing, index)) > 25.0:
            yield from corner_means.split(drawing, index)
            yield from corner_means.prolonged(drawing, index)
        if index <= 1 and self.heading_deg is not None:
            yield from corner_means.headed(drawing, self.heading_deg)
        if drawing[index].is_fixed:
            yield from corner_means.approached(drawing, index)

    def _all(self, drawing: Drawing, index: int, measured: Measured) -> Iterator[Drawing]:
        place = measured.worst[index]
        if not math.isnan(place[0]):
            yield from corner_means.slowed(drawing, index, place, self.vehicle.speed_mps)
        if _is_corner(drawing, index):
            yield from corner_means.slowed(drawing, index, drawing[index].place, self.vehicle.speed_mps)
            if self.vehicle.can_pivot:
                yield from corner_means.stopped(drawing, index)
        yield from self._gentle(drawing, index, measured)

    def _descend(
        self, drawing: Drawing, means: Callable[[Drawing, int, Measured], Iterable[Drawing]]
    ) -> Drawing:
        """Use means at the worst points until nothing is missing or nothing helps."""
        measured = self.measure(drawing)
        while not measured.is_enough and not self._is_over():
            for index in sorted(range(len(drawing)), key=lambda number: -measured.missing_m[number]):
                if measured.missing_m[index] <= ENOUGH_M:
                    return drawing
                better = self._best(drawing, measured, means(drawing, index, measured))
                if better is not None:
                    drawing, measured = better
                    break
        return drawing

    def _fewer(self, drawing: Drawing) -> Drawing:
        """Leave out and merge points as long as that loses neither time nor clearance."""
        measured = self.measure(drawing)
        index = 1
        while index < len(drawing) - 1 and not self._is_over():
            candidates = list(corner_means.without(drawing, index))
            if math.dist(drawing[index].place, drawing[index + 1].place) < _SHORT_LEG_M:
                candidates += corner_means.merged(drawing, index)
            better = self._best(drawing, measured, candidates)
            if better is None:
                index += 1
            else:
                drawing, measured = better
                index = max(index - 1, 1)
        return drawing

    def _eased(self, drawing: Drawing) -> Drawing:
        """Take back, step by step, what the route does not need."""
        measured = self.measure(drawing)
        for step_m in _EASING_STEPS_M:
            for index in range(1, len(drawing) - 1):
                while not self._is_over():
                    better = self._best(drawing, measured, corner_means.eased(drawing, index, step_m))
                    if better is None:
                        break
                    drawing, measured = better
        return drawing

    def _best(
        self, drawing: Drawing, measured: Measured, candidates: Iterable[Drawing]
    ) -> tuple[Drawing, Measured] | None:
        """Give the lines that gain most, if any do, judged by the part that changes and then on the whole."""
        known: dict[tuple[int, int], float] = {}
        gains: list[tuple[float, int, Drawing]] = []
        solved_at = None
        for number, candidate in enumerate(candidates):
            begin, kept = _changed(drawing, candidate)
            span = (begin, len(drawing) - kept)
            if span not in known:
                known[span] = self._measure(drawing, *span).cost_s
            found = self._measure(candidate, begin, len(candidate) - kept)
            gain_s = known[span] - found.cost_s
            if gain_s > _LEAST_GAIN_S:
                gains.append((gain_s, -number, candidate))
                solved_at = number if found.is_enough and solved_at is None else solved_at
            # The means come with the cheapest first: once one has done it, a few more are looked at.
            if self._is_over() or (solved_at is not None and number >= solved_at + _MORE_TRIES):
                break
        for _, _, candidate in sorted(gains, reverse=True)[:3]:
            found = self.measure(candidate)
            more_m = sum(found.missing_m) - sum(measured.missing_m)
            if found.cost_s < measured.cost_s - _LEAST_GAIN_S and more_m <= ENOUGH_M:
                return candidate, found
        return None

    def _is_over(self) -> bool:
        stop = self.should_stop is not None and self.should_stop()
        return stop or self.measurements > self._until


def _joined(drawing: Drawing) -> Drawing:
    """Give lines without tiny legs: pairs of points become one where the outer legs meet, or half-way."""
    while True:
        pairs = [
            (math.dist(drawing[index].place, drawing[index + 1].place), index)
            for index in range(1, len(drawing) - 2)
            if not (drawing[index].is_fixed or drawing[index + 1].is_fixed)
        ]
        for length_m, index in sorted(pairs):
            turn_deg = drawn.turn_deg(drawing, index) + drawn.turn_deg(drawing, index + 1)
            if length_m < _TINY_LEG_M and abs(turn_deg) < _JOINED_TURN_DEG:
                drawing = next(iter(corner_means.merged(drawing, index)), drawing)
                break
        else:
            return drawing


def _is_corner(drawing: Drawing, index: int) -> bool:
    return 0 < index < len(drawing) - 1


def _course_deg(drawing: Drawing) -> float:
    east, north = drawn.direction(drawing[0], drawing[1])
    return math.degrees(math.atan2(east, north))


def _near_turns(drawing: Drawing) -> int:
    """Count turns so near to the next that a rover drives them as one."""
    turns = [abs(drawn.turn_deg(drawing, index)) > _TURN_DEG for index in range(1, len(drawing) - 1)]
    return sum(
        math.dist(drawing[index + 1].place, drawing[index + 2].place) < corner_means.APART_M
        for index, (turn, following) in enumerate(pairwise(turns))
        if turn and following
    )


def _changed(old: Drawing, new: Drawing) -> tuple[int, int]:
    """Give where the part begins in which lines differ, some points before, and how many points after it are the same."""
    shorter = min(len(old), len(new))
    same = next((i for i in range(shorter) if old[i] != new[i]), shorter)
    rest = next((i for i in range(shorter - same) if old[-1 - i] != new[-1 - i]), shorter - same)
    return max(0, same - _CONTEXT), max(0, rest - _CONTEXT)
