"""Fitting drawn lines to a vehicle, until the band it is predicted to drive in keeps what is required, in the least time that is found.

**How.** A greedy descent over whole drawings. Each round takes the point where most clearance is missing, tries every move of `moves` (and
of `gap`) there, measures the lines that result with the drive model, and keeps those that lower the cost most (`cost`: the predicted time,
with missing clearance priced as time). Where no move gains at that point, the next worst one is tried. The descent ends when nothing is
missing, when no move gains anywhere, or when the measurements allowed are used up.

Moves that cost little time come first (`_gentle`); slower stretches and stops (`_all`) only where those do not suffice. What has become
enough is then made cheaper: points are left out (`_fewer`), slow stretches driven faster and several corners made one (`_quickened`), and
corners taken back towards the straight line (`_eased`). What has not is begun again from the first lines, driven slowly around each place where clearance was missing. At the end the points are rounded to degE7, as
the mission will hold them, and measured and mended once more.

**Why.** The band is no smooth function of the points: a corner pivots or blends, a leg is too short for two ramps, a rounded coordinate
decides, and what is left of a swing reaches the corners behind it. There is no gradient to follow, and no formula for one corner decides;
so moves only propose, and the drive model judges. Since nearly all candidates lose, only the part of the lines that changes is measured,
with some points before and after it, and only as far as needed: the steps of a measurement can only add cost, so the first candidate that
comes out of the heap fully measured is the best one, as in A*. The winner is then measured as a whole, and what is returned always was.

Every change that is kept lowers the cost by a least gain, so the descent ends. It is a heuristic: lines that fail here do not show that no
route exists, and `routing.route_search` tries others.
"""

from __future__ import annotations

import heapq
import itertools
import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import shapely

from missions.fitting import moves
from missions.fitting import polyline as drawn
from missions.fitting.cost import ENOUGH_M
from missions.fitting.gap import find_gap, straight_through
from missions.fitting.splice import splices
from missions.geo import rounded
from missions.vehicle import Autopilot

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping

    from missions.fitting.cost import Gauge, Measured, Trial
    from missions.fitting.polyline import Drawing
    from missions.geo import LocalPoint, Vector


FIT_MEASUREMENTS, CRAWL_MEASUREMENTS, QUICKEN_MEASUREMENTS, MOST_MEASUREMENTS = 500, 350, 300, 1500
"""Taken for one route, for a slow one, to make one quicker that was found, and for all that are tried: a search that is not done by then is given up.

Chosen, not measured: they bound the planning time, which docs/drive-bench.md reports.
"""

COMBINE_MEASUREMENTS = 300
"""Taken to make one route of several, and as many to mend it. Chosen, not measured, as those above."""

# Chosen, not measured: no experiment is recorded for any of these. They bound the search; whether lines are enough is always measured.
_SHORT_LEG_M = 12.0  # corners farther apart are not merged to save a point
_LEAST_GAIN_S = 0.05  # what a change must gain to be kept: it ends the descent
# Points before and after a change that are measured with it; the whole lines are measured afterwards
_CONTEXT = 3
_MORE_TRIES = 12  # candidates still looked at after the first that suffices: the gentle ones come first
_TRIED_WHOLE = 3  # candidates that gained in part and are measured whole
_EASING_STEPS_M = (6.0, 1.6, 0.5)  # coarse to fine; what is left over is at most the last
# Shorter legs within gentle turns become one corner before the search. Measured on the recorded maze, 21 clearances from 1.8 to 7.8 m: with
# 2.5 m five routes crept (more than twice the time of wider ones), with 3 m three, with 4 m one, with 5 m four
_TINY_LEG_M = 4.0
_JOINED_TURN_DEG = 80.0  # both corners together; sharper ones stay two
# What slows a rover most is made two corners, or moved so far at the most, in `moves.MOVES`, for what it gains. A skid-steered one stops for turns
# above WP_PIVOT_ANGLE, 60° mostly: on four of 264 routes one such turn more or less was 6 to 13 % of the time
_SHARP_DEG, _ASIDE_M = 45.0, 1.5
_GRID_TRIES, _GRID_MEASUREMENTS = 4, 150  # to mend what rounding to degE7 (at most 5.6 mm) broke


@dataclass(eq=False)
class Fitting:
    """The search for one vehicle on one field; `fit` improves drawn lines.

    Parameters
    ----------
    gauge : Gauge
        What measures lines for the vehicle on the field; what it measured for other lines is known.
    should_stop : callable, optional
        Asked now and then; True ends the search.
    most_measurements : int
        For all lines that are fitted.
    good_share : float
        A round ends soon after a candidate that leaves no more than this share of what its part missed: above 0 rounds are short, and end elsewhere.
    """

    gauge: Gauge
    should_stop: Callable[[], bool] | None = None
    most_measurements: int = MOST_MEASUREMENTS
    good_share: float = 0.0
    measurements: int = field(default=0, init=False)
    _until: int = field(default=0, init=False)

    def fit(self, drawing: Drawing) -> tuple[Drawing, Measured]:
        """Return lines improved until their band keeps what is required or nothing helps, and how they measure."""
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
            slow = moves.crawling(drawn_first, spots, self.gauge.vehicle.speed_mps)
            self._allow(CRAWL_MEASUREMENTS)
            other, found = self._fitted(slow)
            if sum(found.missing_m) < sum(measured.missing_m):
                drawing, measured = other, found
        return self._finished(drawing) if measured.is_enough else (drawing, measured)

    def combine(self, drawings: Mapping[Drawing, bool]) -> tuple[Drawing, Measured]:
        """Return the best lines that are made of several, improved as any others are, and how they measure.

        Parameters
        ----------
        drawings : mapping of Drawing to bool
            The lines, and whether they were improved for what is asked of them now.
        """
        ranked = sorted(drawings, key=lambda lines: self.measure(lines).cost_s)
        self._allow(COMBINE_MEASUREMENTS)
        drawing, measured = ranked[0], self.measure(ranked[0])
        while True:
            spliced = (
                lines
                for other in ranked
                if other != drawing
                for lines in (*splices(drawing, other), *splices(other, drawing))
            )
            better = self._best(drawing, measured, spliced)
            if better is None:
                break
            drawing, measured = better
        if measured.is_enough and drawings.get(drawing):
            return drawing, measured
        if not measured.is_enough:
            self._allow(FIT_MEASUREMENTS)
            drawing, measured = self._fitted(drawing)
        return self._finished(drawing) if measured.is_enough else (drawing, measured)

    def _finished(self, drawing: Drawing) -> tuple[Drawing, Measured]:
        """Return lines that are enough made quicker, and on the grid."""
        quicker = self._on_grid(self._eased(self._quickened(drawing)))
        # What is made quicker keeps no more than it must, and rounding may break what cannot be mended.
        return quicker if quicker[1].is_enough else self._on_grid(self._eased(drawing))

    def outlook(self, drawing: Drawing) -> Measured:
        """Return how lines measure before anything is bent; `fit` begins with the same, so it costs nothing beside it."""
        return self.gauge.measure(_joined(drawing))

    def _on_grid(self, drawing: Drawing) -> tuple[Drawing, Measured]:
        """Round lines as the mission's items will be: the model has steps, and a millimetre may be one too many."""
        measured = self.measure(drawing)
        for _ in range(_GRID_TRIES):
            if not measured.is_enough:
                break
            drawing = tuple(point.at(self._rounded(point.place)) for point in drawing)
            measured = self.measure(drawing)
            if measured.is_enough:
                break
            self._until = self.measurements + _GRID_MEASUREMENTS
            drawing = self._descend(drawing, self._all)
            measured = self.measure(drawing)
        return drawing, measured

    def _rounded(self, place: LocalPoint) -> LocalPoint:
        frame = self.gauge.ground.frame
        return frame.to_local(rounded(frame.to_lat_lon(place)))

    def _allow(self, measurements: int) -> None:
        self._until = min(self.measurements + measurements, self.most_measurements)

    def _fitted(self, drawing: Drawing) -> tuple[Drawing, Measured]:
        for propose in (self._gentle, self._all):
            drawing = self._descend(drawing, propose)
            if self.measure(drawing).is_enough:
                drawing = self._fewer(drawing)
                break
        return drawing, self.measure(drawing)

    def measure(self, drawing: Drawing) -> Measured:
        """Measure whole lines."""
        self.measurements += 1
        return self.gauge.measure(drawing)

    def _away(self, place: LocalPoint) -> Vector:
        """Return the unit vector from the nearest fence to a place."""
        line = shapely.shortest_line(self.gauge.ground.edge, shapely.Point(place))
        (east_a, north_a), (east_b, north_b) = shapely.get_coordinates(line).tolist()
        length_m = math.dist((east_a, north_a), (east_b, north_b)) or 1.0
        return ((east_b - east_a) / length_m, (north_b - north_a) / length_m)

    def _gentle(self, drawing: Drawing, index: int, measured: Measured) -> Iterator[Drawing]:
        """Return the moves that cost little time."""
        missing_m, place = measured.missing_m[index], measured.worst[index]
        yield from moves.moved(drawing, index, missing_m)
        if not math.isnan(place[0]):
            ahead = drawn.direction(drawing[max(index - 1, 0)], drawing[max(index, 1)])
            narrow = find_gap(self.gauge.ground.edge, place, ahead)
            if narrow is not None:
                yield from straight_through(drawing, index, narrow)
            yield from moves.bent(drawing, index, place, self._away(place), missing_m)
        yield from moves.together(drawing, index, missing_m)
        yield from moves.without(drawing, index)
        yield from moves.merged(drawing, index)
        yield from moves.merged(drawing, index - 1)
        # Chosen, not measured: gentler corners hardly cut, and splitting them only adds waypoints.
        if _is_corner(drawing, index) and abs(drawn.turn_deg(drawing, index)) > 25.0:
            yield from moves.split(drawing, index)
            yield from moves.prolonged(drawing, index)
        if index <= 1 and self.gauge.heading_deg is not None:
            yield from moves.headed(drawing, self.gauge.heading_deg)
        if drawing[index].is_fixed:
            yield from moves.approached(drawing, index)

    def _all(self, drawing: Drawing, index: int, measured: Measured) -> Iterator[Drawing]:
        place = measured.worst[index]
        if not math.isnan(place[0]):
            yield from moves.slowed(drawing, index, place, self.gauge.vehicle.speed_mps)
        if _is_corner(drawing, index):
            yield from moves.slowed(drawing, index, drawing[index].place, self.gauge.vehicle.speed_mps)
            # PX4 ignores the hold time of a waypoint, and stops before it turns on the spot by itself.
            if self.gauge.vehicle.can_pivot and self.gauge.vehicle.autopilot is Autopilot.ARDUPILOT:
                yield from moves.stopped(drawing, index)
        yield from self._gentle(drawing, index, measured)

    def _descend(
        self, drawing: Drawing, propose: Callable[[Drawing, int, Measured], Iterable[Drawing]]
    ) -> Drawing:
        """Return the lines after moves at the worst points, until nothing is missing or nothing helps."""
        measured = self.measure(drawing)
        while not measured.is_enough and not self._is_over():
            for index in sorted(range(len(drawing)), key=lambda number: -measured.missing_m[number]):
                if measured.missing_m[index] <= ENOUGH_M:
                    return drawing
                better = self._best(drawing, measured, propose(drawing, index, measured))
                if better is not None:
                    drawing, measured = better
                    break
        return drawing

    def _fewer(self, drawing: Drawing) -> Drawing:
        """Return the lines with points left out and merged as long as that loses neither time nor clearance."""
        measured = self.measure(drawing)
        index = 1
        while index < len(drawing) - 1 and not self._is_over():
            candidates = list(moves.without(drawing, index))
            if math.dist(drawing[index].place, drawing[index + 1].place) < _SHORT_LEG_M:
                candidates += moves.merged(drawing, index)
            better = self._best(drawing, measured, candidates)
            if better is None:
                index += 1
            else:
                drawing, measured = better
                index = max(index - 1, 1)
        return drawing

    def _quickened(self, drawing: Drawing) -> Drawing:
        """Return the lines with slow stretches driven faster, and several corners made one, as far as clearance allows.

        Round and round, until no point of them helps.
        """
        measured = self.measure(drawing)
        self._until += QUICKEN_MEASUREMENTS
        index, without = 1, 0
        while without < len(drawing) - 1 and not self._is_over():
            candidates = [
                *moves.quickened(drawing, index, self.gauge.vehicle.speed_mps),
                *moves.rejoined(drawing, index),
            ]
            if _is_corner(drawing, index) and abs(drawn.turn_deg(drawing, index)) > _SHARP_DEG:
                candidates += moves.split(drawing, index, moves.NEAR_SPACINGS_M)
                candidates += moves.moved(drawing, index, _ASIDE_M)
            better = self._best(drawing, measured, candidates)
            if better is not None:
                drawing, measured = better
                index, without = min(index, len(drawing) - 1), 0
            else:
                index, without = index % (len(drawing) - 1) + 1, without + 1
        return drawing

    def _eased(self, drawing: Drawing) -> Drawing:
        """Return the lines with their moves taken back, step by step, as far as clearance and time allow."""
        measured = self.measure(drawing)
        for step_m in _EASING_STEPS_M:
            for index in range(1, len(drawing) - 1):
                while not self._is_over():
                    better = self._best(drawing, measured, moves.eased(drawing, index, step_m))
                    if better is None:
                        break
                    drawing, measured = better
        return drawing

    def _best(
        self, drawing: Drawing, measured: Measured, candidates: Iterable[Drawing]
    ) -> tuple[Drawing, Measured] | None:
        """Return the lines that gain most, if any do, judged by the part that changes and then on the whole."""
        trials: list[_Tried] = []
        known: dict[tuple[int, int], Trial] = {}
        solved_at = None
        for number, (candidate, begin, kept) in enumerate(self._looked_at(drawing, candidates)):
            span = (begin, len(drawing) - kept)
            if span not in known:
                self.measurements += 1
                known[span] = self.gauge.trial(drawing, *span).finish()
            self.measurements += 1
            trial = self.gauge.trial(candidate, begin, len(candidate) - kept)
            tried = _Tried(known[span].cost_s, number, trial, candidate)
            missing_m = self.good_share * known[span].missing_in_all_m
            # Those after the first that does are measured only as far as ranking them takes.
            if solved_at is None and tried.misses_at_most(missing_m):
                solved_at = number
            trials.append(tried)
            # The moves come with the cheapest first: once one does, a few more are looked at.
            if self._is_over() or (solved_at is not None and number >= solved_at + _MORE_TRIES):
                break
        for tried in itertools.islice(_best_first(trials), _TRIED_WHOLE):
            found = self.measure(tried.drawing)
            more_m = sum(found.missing_m) - sum(measured.missing_m)
            if found.cost_s < measured.cost_s - _LEAST_GAIN_S and more_m <= ENOUGH_M:
                return tried.drawing, found
        return None

    def _looked_at(
        self, drawing: Drawing, candidates: Iterable[Drawing]
    ) -> Iterator[tuple[Drawing, int, int]]:
        """Return candidates with where they differ from lines (`_changed`); the legs of several are measured at once."""
        waiting = iter(candidates)
        while some := tuple(itertools.islice(waiting, _MORE_TRIES + 1)):
            changed = [(candidate, *_changed(drawing, candidate)) for candidate in some]
            self.gauge.look_at_legs(lines[begin : len(lines) - kept] for lines, begin, kept in changed)
            yield from changed

    def _is_over(self) -> bool:
        stop = self.should_stop is not None and self.should_stop()
        return stop or self.measurements > self._until


def _joined(drawing: Drawing) -> Drawing:
    """Return lines without tiny legs: pairs of points become one where the outer legs meet, or half-way."""
    while True:
        pairs = [
            (math.dist(drawing[index].place, drawing[index + 1].place), index)
            for index in range(1, len(drawing) - 2)
            if not (drawing[index].is_fixed or drawing[index + 1].is_fixed)
        ]
        for length_m, index in sorted(pairs):
            turn_deg = drawn.turn_deg(drawing, index) + drawn.turn_deg(drawing, index + 1)
            if length_m < _TINY_LEG_M and abs(turn_deg) < _JOINED_TURN_DEG:
                drawing = next(iter(moves.merged(drawing, index)), drawing)
                break
        else:
            return drawing


def _is_corner(drawing: Drawing, index: int) -> bool:
    return 0 < index < len(drawing) - 1


@dataclass(frozen=True, slots=True)
class _Tried:
    """Lines tried in the place of others, as far as they were measured.

    Parameters
    ----------
    known_s : float
        What the part costs that changes.
    number : int
        Which of those that are tried.
    trial : Trial
        What the part becomes.
    drawing : tuple of DrawnPoint
        The whole lines.
    """

    known_s: float
    number: int
    trial: Trial
    drawing: Drawing

    @property
    def gain_s(self) -> float:
        """What is gained, at most: steps not yet taken can only lower it."""
        return self.known_s - self.trial.cost_s

    def misses_at_most(self, missing_m: float) -> bool:
        """Measure only as far as needed; return whether the part gains and its band misses no more in all, or keeps what is required."""
        trial = self.trial
        while self.gain_s > _LEAST_GAIN_S and (trial.may_be_enough or trial.missing_in_all_m <= missing_m):
            if trial.is_finished:
                return True
            trial.refine()
        return False


def _best_first(trials: Iterable[_Tried]) -> Iterator[_Tried]:
    """Return the candidates that gain, best first; a candidate is measured only as far as it takes to decide."""
    waiting = [(-tried.gain_s, tried.number, tried) for tried in trials]
    heapq.heapify(waiting)
    while waiting:
        lost_s, number, tried = heapq.heappop(waiting)
        if -lost_s <= _LEAST_GAIN_S:
            return
        if tried.trial.is_finished:
            yield tried
        else:
            tried.trial.refine()
            heapq.heappush(waiting, (-tried.gain_s, number, tried))


def _changed(old: Drawing, new: Drawing) -> tuple[int, int]:
    """Return where the part begins in which two lines differ, some points before, and how many points after it are the same."""
    shorter = min(len(old), len(new))
    # Mostly they are the very same points, which takes less to see than that they are equal.
    same = 0
    while same < shorter and (old[same] is new[same] or old[same] == new[same]):
        same += 1
    rest, most = 0, shorter - same
    while rest < most and (old[-1 - rest] is new[-1 - rest] or old[-1 - rest] == new[-1 - rest]):
        rest += 1
    return max(0, same - _CONTEXT), max(0, rest - _CONTEXT)
