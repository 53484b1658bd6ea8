"""A route for a vehicle: drawn lines whose driven band keeps the promised clearance.

**How.** `pbpp` draws the shortest path for a disc; a vehicle's band is wider at corners, and how wide depends on the corners, which depend on
the path. So the path is drawn with room for the band of a straight line only, and `fitting.local_search` bends and slows it until the band at
its corners keeps the promise too. Two paths are drawn, with room for the band at full speed and at `SLOW_MPS`: the second passes narrower
places, and is fitted only where the first fails or is longer by some per cent. Where neither can be fitted, in this order: first legs that the
vehicle can drive as it faces, if it is the start that refuses; the whole route at a slow speed; and other ways round, each drawn with a small
square laid over the place where most was missing so far. Of those found the one of least cost is the answer.

**Why.** A path that is exact for the vehicle would need a search over position, heading and speed. Shortest paths of a disc are exact and
quick, and fitting them loses little (docs/drive-bench.md: 176 of 180 found, in the median 0.7 to 2.6 % longer than the shortest).
The square works because shortest paths leave nothing between: what is nearly as short passes the same place, so another try has to be kept off
it. Each stage has its allowance of measurements, so that a refusal comes in bounded time. It is a heuristic: a refusal names the
corner that refused; it does not prove that no route exists.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from shapely import Point

from missions.drive_model import corner_forecast
from missions.fitting import polyline
from missions.fitting.cost import ENOUGH_M, Gauge
from missions.fitting.local_search import MOST_MEASUREMENTS, Fitting
from missions.fitting.polyline import Drawing, DrawnPoint
from missions.geo import rounded
from missions.ground.legs import ROUNDING_RESERVE_M, reserve_m
from missions.routing.departure import ROOM_M, Departures, least_turning_m
from missions.routing.drawn_route import DrawnRoutes, Route
from missions.routing.no_route import NoRoute
from missions.routing.refusal import AT_START, block, refusal

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from missions.fitting.cost import Measured
    from missions.geo import LocalPoint
    from missions.routing.departure import Departure
    from missions.routing.drawn_route import Sought
    from missions.vehicle import Vehicle

SLOW_MPS = 1.0
"""The slowest that a stretch is driven, and the narrowest band: steered rovers below 1 m/s swing out farther (docs/drive-model.md)."""

SLOW_ALL_THE_WAY_MPS = (2.0, 1.0)
"""Where slow stretches do not suffice: the whole route at such a speed, so that none changes at corners. Both speeds were measured."""

LATER_MEASUREMENTS = 500
"""For each kind of route that is tried after the first ones. Chosen, not measured: it bounds the time until a refusal."""

# Chosen, not measured, but the turn at the end of a first leg.
_SLOW_SHARE = 1.6  # of the time at full speed: beyond it the lines that leave as they are drawn are tried beside those that turn in the open
_OTHER_WAY_DEG = 45.0  # between first legs that leave the start another way
_OTHER_WAYS = 5  # squares laid over refusing places before the search gives up
# Missing at the start beyond what a slower, narrower band could win back: nothing else is tried
_HELD_M = 0.05
_DEPARTURES_TRIED = 8  # of the first legs, the shortest routes
# What the first leg may keep less than the best departure, for rounding and bending; and as a share of it: with 5 cm alone lines that
# could be driven were refused for a centimetre at the start, or crept all the way (the recorded maze, 4.3 m to 7.7 m)
_DEPARTURE_SLACK_M, _DEPARTURE_SLACK_SHARE = 0.05, 0.1
_LINE_SLACK_M = (
    0.5 * ROUNDING_RESERVE_M
)  # and the drawn line there: half of what the finished lines are let off
_MISSED_AT_START_M = 0.05  # so much less the first legs may keep, where no lines keep all of that; it is said (`DrivenRoute.lead_away_m`)
_TURN_COST_M_PER_DEG = 0.1  # orders the departures: a turn of 90° counts as 9 m
_MOST_TURN_DEG = 100.0
"""At the end of a first leg: tried with more, rovers that came back the way they went left the band."""
_SAME_M = 0.02  # rounding to degE7 moves a target by 5.6 mm at the most
# The slow speed's path is fitted too where it is shorter than this share of the fast one's
_SHORTER_SHARE = 0.97


@dataclass(frozen=True, eq=False)
class DrivenRoute:
    """Lines fitted to a vehicle.

    Parameters
    ----------
    drawing : tuple of DrawnPoint
        The lines, start first.
    lead_away : int
        How many of the first legs lead away from a fence that the start stands nearer to than is required.
    start_clearance_m : float
        The start's distance to the nearest fence.
    targets : tuple of LocalPoint
        The targets as reached, in order.
    blocks : int
        Blocks of the partition that was searched.
    lead_away_m : float or None
        What the band has to keep while the route leads away; None where the lines were not fitted to a vehicle.
    kept_m : float or None
        What the band has to keep beyond; None as above.
    is_whole : bool
        Whether that is all that was aimed at.
    cost_s : float
        The predicted time, and a little for each waypoint (`fitting.cost`).
    is_slow : bool
        Whether it takes much longer than its lines would at full speed, so that others may be quicker.
    outlook : Measured or None
        How its lines measured as they were drawn; None where they were not fitted to a vehicle.
    """

    drawing: Drawing
    lead_away: int
    start_clearance_m: float
    targets: tuple[LocalPoint, ...]
    blocks: int
    lead_away_m: float | None = None
    kept_m: float | None = None
    is_whole: bool = True
    cost_s: float = 0.0
    is_slow: bool = False
    outlook: Measured | None = None

    @property
    def is_slow_somewhere(self) -> bool:
        """Whether a stretch is driven slower than the vehicle's own speed."""
        return any(point.speed_mps is not None for point in self.drawing)


@dataclass(frozen=True, eq=False)
class _Attempt:
    """One route fitted to the vehicle: what became of its lines, the driven route that they are, and whether it keeps enough."""

    drawing: Drawing
    measured: Measured
    driven: DrivenRoute | None
    is_enough: bool

    @property
    def is_refused_at_start(self) -> bool:
        """Whether most is missing because of how it begins."""
        return not self.is_enough and self.measured.worst_index <= AT_START


@dataclass(eq=False)
class SharedWork:
    """What searches for one vehicle on one field share, whatever is required: nothing is drawn or fitted twice."""

    drawn: dict[float, DrawnRoutes] = field(default_factory=dict)
    """By the clearance of the drawn lines."""
    fitted: dict[tuple[Drawing, int, int, float], tuple[Drawing, Measured, Measured, int]] = field(
        default_factory=dict
    )
    """By the lines, the measurements taken before and allowed, and what ends a round; with how they measured before, and the measurements taken after."""
    departures: Departures | None = None
    gauge: Gauge | None = None


@dataclass(frozen=True, eq=False)
class RouteSearch:
    """What is looked for.

    Parameters
    ----------
    sought : Sought
        The field, the ends, and how to search.
    required_m : float
        What the driven band has to keep to any fence: what is aimed at.
    vehicle : Vehicle
        What drives.
    heading_deg : float or None
        Where it faces at the start, clockwise from north; None is along the first leg.
    enough_m : float, optional
        What is enough of it, where what is aimed at cannot be kept all the way. Default: all of it.
    known : SharedWork, optional
        What other searches for the vehicle on the field know already.
    any_speed : bool
        Whether a slow route does, so that no quicker one is sought.
    measurements : int
        For the first routes.
    departure_limit_m : float
        What the best first leg keeps that a route leads on from, where that is known.
    good_share : float, optional
        What ends a round of fitting (`fitting.local_search.Fitting`).
    """

    sought: Sought
    required_m: float
    vehicle: Vehicle
    heading_deg: float | None
    enough_m: float | None = None
    known: SharedWork = field(default_factory=SharedWork)
    any_speed: bool = False
    measurements: int = MOST_MEASUREMENTS
    departure_limit_m: float = math.inf
    good_share: float = 0.0

    def find(self, *, briefly: bool = False) -> DrivenRoute | NoRoute:
        """Find the quickest of the routes tried whose band keeps enough; ``briefly`` tries the first ones only."""
        routes = self._first_routes
        if isinstance(routes, NoRoute):
            return routes
        found = self._first_attempts if briefly else self._attempts
        if enough := _found(found):
            return min(enough, key=lambda one: one[0])[1]
        least = min(found, key=lambda one: sum(one.measured.missing_m))
        return refusal(
            self.sought,
            self.required_m,
            self._reserve_m,
            least.drawing,
            least.measured,
            vehicle=self.vehicle,
            held_at_start=self._is_held_at_start(found),
        )

    def widest(self, *, briefly: bool = False) -> DrivenRoute | NoRoute:
        """Find the route that keeps most of what is aimed at."""
        found = self.find(briefly=briefly)
        if isinstance(found, DrivenRoute) or isinstance(self._first_routes, NoRoute):
            return found
        attempts = self._first_attempts if briefly else self._attempts
        driven = [one.driven for one in attempts if one.driven is not None]
        return max(driven, key=lambda one: (one.kept_m or 0.0, -one.cost_s), default=found)

    def nearer_start(self) -> DrivenRoute | None:
        """Leave as well as can be on the way, where the first legs that would keep all that is required lead nowhere; None where that does not help."""
        kept = (one for one in self._departures.best_first() if one.kept_m > 0)
        departure = next((one for one in kept if self._onward(one, self._bands_m[1]) is not None), None)
        if departure is None or departure.kept_m >= self.required_m + self._reserve_m:
            return None
        nearer = replace(self, departure_limit_m=departure.kept_m)
        found = nearer.find(briefly=True) if nearer._is_limited_by_start else None  # noqa: SLF001 - of its own kind
        return found if isinstance(found, DrivenRoute) else None

    @property
    def least_s(self) -> float:
        """What the shortest route takes at full speed and without corners, from standing to standing; 0 where there is none."""
        if isinstance(self._first_routes, NoRoute):
            return 0.0
        length_m = min(route.length_m for route, _ in self._first_routes)
        return length_m / self.vehicle.speed_mps + self.vehicle.speed_mps / self.vehicle.accel_max_mps2

    def combined(self) -> DrivenRoute | None:
        """Return a route that is made of those which were fitted for the vehicle so far, whatever they aimed at; None where none keeps enough."""
        routes = self._first_routes
        if isinstance(routes, NoRoute) or routes[0][0].start_clearance_m < 0:
            return None
        route = routes[0][0]
        lines = {}
        for drawing, *_ in self.known.fitted.values():
            if _meets(drawing, route):
                asked = self._asked_anew(route, drawing)
                lines[asked] = asked == drawing
        if not lines:
            return None
        fitting = self._fitting(MOST_MEASUREMENTS)
        made = self._judged(fitting, route, *fitting.combine(lines), self.outlook)
        return made.driven if made.is_enough else None

    def _asked_anew(self, route: Route, drawing: Drawing) -> Drawing:
        """Return lines that were fitted to something else with what this search asks of them."""
        required_m = self.required_m + self._reserve_m
        near_m = self._least_departing_m(route) + self._reserve_m
        line_m = min(required_m, route.start_clearance_m) if route.start_clearance_m >= 0 else -math.inf
        leads = max(self._lead_away(drawing), 1)
        near = [
            not number or (number <= leads and not point.is_fixed) for number, point in enumerate(drawing)
        ]
        return tuple(
            point._replace(
                required_m=near_m if is_near else required_m,
                line_m=line_m if is_near else required_m,
            )
            for point, is_near in zip(drawing, near, strict=True)
        )

    def begins_otherwise(self, other: RouteSearch) -> bool:
        """Return whether the shortest route leaves the start another way than that of another search, or leads away first where that does not."""
        here, there = self._first_routes, other._first_routes
        if isinstance(here, NoRoute) or isinstance(there, NoRoute):
            return True
        (route, _), (that, _) = here[0], there[0]
        turn_deg = abs(_course_deg(route) - _course_deg(that))
        return route.lead_away != that.lead_away or min(turn_deg, 360.0 - turn_deg) > _OTHER_WAY_DEG

    @cached_property
    def outlook(self) -> Measured | None:
        """How the quicker of the first routes measures before it is fitted; None where none is drawn."""
        routes = self._first_routes
        if isinstance(routes, NoRoute):
            return None
        fitting = self._fitting(self.measurements)
        looks = (fitting.outlook(self._drawing(route)) for route, _ in routes)
        return min(looks, key=lambda look: look.kept_cost_s)

    @cached_property
    def _attempts(self) -> list[_Attempt]:
        routes = self._first_routes
        assert not isinstance(routes, NoRoute)
        _, slow_m = self._bands_m
        attempts = [*self._first_attempts]
        if attempts[-1].is_refused_at_start and not _found(attempts) and not self._is_limited_by_start:
            attempts += self._until_found(self._departing(slow_m))
        is_held = not _found(attempts) and self._is_held_at_start(attempts)
        if not _found(attempts) and not is_held:
            attempts += self._until_found(self._slowly(routes[-1][0]))
        if not _found(attempts) and not is_held:
            attempts += self._until_found(self._other_ways(*routes[-1], attempts[-1]))
        return attempts

    @cached_property
    def _bands_m(self) -> tuple[float, float]:
        fast_m = corner_forecast(0.0, self.vehicle).outside_overshoot_m
        slow_mps = min(SLOW_MPS, self.vehicle.speed_mps)
        return fast_m, corner_forecast(0.0, self.vehicle, speed_mps=slow_mps).outside_overshoot_m

    @cached_property
    def _first_routes(self) -> list[tuple[Route, DrawnRoutes]] | NoRoute:
        """The shortest route at full speed's band, and the one at the slow speed's; why there is none where there is neither."""
        fast_m, slow_m = self._bands_m
        all_drawn = [
            self._drawn_at(band_m) for band_m in sorted({fast_m, slow_m}, reverse=True) if band_m <= fast_m
        ]
        tried = [(drawn.find(), drawn) for drawn in all_drawn]
        found = [(route, drawn) for route, drawn in tried if isinstance(route, Route)]
        last = tried[-1][0]
        return last if isinstance(last, NoRoute) and not found else found

    @cached_property
    def _first_attempts(self) -> list[_Attempt]:
        """The first routes, fitted: the second only where the first fails, or is longer by some per cent."""
        assert not isinstance(self._first_routes, NoRoute)
        routes = [route for route, _ in self._first_routes]
        attempts = []
        if self._is_limited_by_start:
            # Lines that turn in the open are quicker than those that creep away, and to fit.
            attempts = self._until_found(self._departing(self._bands_m[1]))
            if (driven := _found(attempts)) and (self.any_speed or not driven[-1][1].is_slow):
                return attempts
        fitting = self._fitting(self.measurements)
        attempts.append(self._fit(fitting, routes[0]))
        is_shorter = routes[-1].length_m < _SHORTER_SHARE * routes[0].length_m
        if len(routes) > 1 and (is_shorter or not _found(attempts)):
            attempts.append(self._fit(fitting, routes[1]))
        return attempts

    def _until_found(self, attempts: Iterator[_Attempt]) -> list[_Attempt]:
        """Return attempts up to the first that succeeds."""
        made = []
        for attempt in attempts:
            made.append(attempt)
            if attempt.is_enough or self._is_stopped():
                break
        return made

    def _is_held_at_start(self, attempts: Sequence[_Attempt]) -> bool:
        """Return whether nothing more is worth trying, as the vehicle cannot turn at its start.

        However slowly it drives it swings as far where it starts with its heading wrong; only its band becomes narrower.
        """
        fast_m, slow_m = self._bands_m
        narrower_m = fast_m - slow_m
        return all(
            one.is_refused_at_start and one.measured.missing_m[0] > narrower_m + _HELD_M for one in attempts
        )

    def _departing(self, band_m: float) -> Iterator[_Attempt]:
        """Leave by first legs that the vehicle can drive as it faces."""
        fitting = self._fitting(LATER_MEASUREMENTS)
        return (self._fit(fitting, route) for route in self._departing_routes(band_m))

    def _slowly(self, route: Route) -> Iterator[_Attempt]:
        """Drive a route slowly all the way, so that nothing changes at corners."""
        for speed_mps in SLOW_ALL_THE_WAY_MPS:
            if speed_mps < self.vehicle.speed_mps:
                yield self._fit(self._fitting(LATER_MEASUREMENTS), route, speed_mps)

    def _other_ways(self, route: Route, drawn: DrawnRoutes, refused: _Attempt) -> Iterator[_Attempt]:
        """Keep away from where routes were refused, and draw others with the same band."""
        fitting = self._fitting(LATER_MEASUREMENTS)
        for _ in range(_OTHER_WAYS):
            drawn = drawn.around(block(route, refused.drawing, refused.measured))
            other = drawn.find()
            if isinstance(other, NoRoute):
                return
            route, refused = other, self._fit(fitting, other)
            yield refused

    def _fitting(self, measurements: int) -> Fitting:
        if self.known.gauge is None:
            self.known.gauge = Gauge(self.sought.ground, self.vehicle, self.heading_deg)
        return Fitting(self.known.gauge, self.sought.should_stop, measurements, self.good_share)

    def _drawn_at(self, band_m: float) -> DrawnRoutes:
        """Return the routes drawn with room for a band; what is free at it is computed once."""
        clearance_m = self.required_m + band_m + self._reserve_m
        if clearance_m not in self.known.drawn:
            self.known.drawn[clearance_m] = DrawnRoutes.at(self.sought, clearance_m)
        return self.known.drawn[clearance_m]

    def _fit(self, fitting: Fitting, route: Route, speed_mps: float | None = None) -> _Attempt:
        drawn_lines = tuple(point._replace(speed_mps=speed_mps) for point in self._drawing(route))
        key = (drawn_lines, fitting.measurements, fitting.most_measurements, fitting.good_share)
        if key not in self.known.fitted:
            fitted = fitting.fit(drawn_lines)
            self.known.fitted[key] = (*fitted, fitting.outlook(drawn_lines), fitting.measurements)
        drawing, measured, outlook, fitting.measurements = self.known.fitted[key]
        return self._judged(fitting, route, drawing, measured, outlook)

    def _judged(
        self, fitting: Fitting, route: Route, drawing: Drawing, measured: Measured, outlook: Measured | None
    ) -> _Attempt:
        """Return what became of a route's lines."""
        departing_m = self._least_departing_m(route)
        kept, kept_m, lead_m = measured, self.required_m, departing_m
        if not measured.is_enough:
            lower = self._lowered(fitting, drawing)
            if lower is None:
                return _Attempt(drawing, measured, None, is_enough=False)
            drawing, kept, missed_m, missed_at_start_m = lower
            kept_m, lead_m = kept_m - missed_m, lead_m - missed_at_start_m
        driven = DrivenRoute(
            drawing,
            self._lead_away(drawing),
            route.start_clearance_m,
            route.targets,
            route.blocks,
            lead_m,
            kept_m,
            measured.is_enough,
            kept.cost_s,
            kept.cost_s * self.vehicle.speed_mps > _SLOW_SHARE * polyline.distances_m(drawing)[-1],
            outlook,
        )
        enough_m = self.required_m if self.enough_m is None else self.enough_m
        return _Attempt(drawing, measured, driven, is_enough=kept_m >= min(enough_m, self.required_m))

    def _lowered(self, fitting: Fitting, drawing: Drawing) -> tuple[Drawing, Measured, float, float] | None:
        """Return lines that miss some of what is required, as they are rounded and with no more required than they keep; what they miss, and on the first legs.

        None where the first legs miss more than a little, or nothing is kept.
        """
        frame = self.sought.ground.frame
        drawing = tuple(point.at(frame.to_local(rounded(frame.to_lat_lon(point.place)))) for point in drawing)
        missing_m = fitting.measure(drawing).missing_m
        first = self._lead_away(drawing) + 1 if self._lead_away(drawing) else 0
        missed_m, missed_at_start_m = (
            missed if missed > ENOUGH_M else 0.0
            for missed in (max(missing_m[first:], default=0.0), max(missing_m[:first], default=0.0))
        )
        if missed_at_start_m > _MISSED_AT_START_M or missed_m >= self.required_m:
            return None
        drawing = tuple(
            point._replace(
                required_m=point.required_m - (missed_m if number >= first else missed_at_start_m),
                line_m=point.line_m
                - (missed_m if number >= first else min(missed_at_start_m, _LINE_SLACK_M)),
            )
            for number, point in enumerate(drawing)
        )
        measured = fitting.measure(drawing)
        # Where no leg leads away, the start is one of the points that miss as much.
        missed = (missed_m, missed_at_start_m if first else missed_m)
        return (drawing, measured, *missed) if measured.is_enough else None

    def _drawing(self, route: Route) -> Drawing:
        """Return a route's lines with what each point has to keep: where the route leads away, no less than the start does."""
        required_m = self.required_m + self._reserve_m
        near_m = self._least_departing_m(route) + self._reserve_m
        line_m = min(required_m, route.start_clearance_m) if route.start_clearance_m >= 0 else -math.inf
        fixed = {0, *route.target_indices} | ({1} if route.start_clearance_m < 0 else set())
        leading = {*range(max(route.lead_away, 1) + 1)} - {*route.target_indices}
        return tuple(
            DrawnPoint(
                place,
                near_m if number in leading else required_m,
                line_m if number in leading else required_m,
                is_fixed=number in fixed,
            )
            for number, place in enumerate(route.places)
        )

    @cached_property
    def _reserve_m(self) -> float:
        return reserve_m(self.sought.ground)

    @cached_property
    def departure_m(self) -> float:
        """What the band has to keep on the first leg: what is required, or what the vehicle's turning at this start leaves of it.

        A vehicle that stands near a fence, or faces it, can do no better than to leave by the best way; where that takes it to where its own
        avoidance backs it into the fence, it is not sent.
        """
        if self.sought.ground.clearance_m(Point(self.sought.start)) >= self.required_m + ROOM_M:
            return self.required_m
        enough_m = self.required_m + self._reserve_m
        if self.departure_limit_m >= enough_m and self._departures.any_keeps(enough_m):
            return self.required_m
        best_m = min(self._departures.best_first()[0].kept_m, self.departure_limit_m)
        slack_m = max(_DEPARTURE_SLACK_M, _DEPARTURE_SLACK_SHARE * best_m)
        left_m = best_m - 2 * self._reserve_m - slack_m
        least_m = least_turning_m(self.sought.ground, self.sought.start, self.vehicle)
        return min(self.required_m, max(left_m, least_m))

    @property
    def _is_limited_by_start(self) -> bool:
        """Whether the vehicle's turning at this start leaves less than is required."""
        return 0 <= self.departure_m < self.required_m

    @property
    def _departures(self) -> Departures:
        if self.known.departures is None:
            self.known.departures = Departures(
                self.sought.ground, self.vehicle, self.sought.start, self.heading_deg
            )
        return self.known.departures

    def _departing_routes(self, band_m: float) -> Iterator[Route]:
        """Return routes by the first legs that the vehicle can drive as it faces, the shortest first."""
        keeps_m = self.departure_m + self._reserve_m
        routes = []
        for departure in self._departures.best_first():
            if departure.kept_m < keeps_m:
                break
            onward = self._onward(departure, band_m)
            if onward is None:
                continue
            route = replace(
                onward,
                points=np.vstack([self.sought.start, onward.points]),
                lead_away=int(self.departure_m < self.required_m),
                start_clearance_m=self.sought.ground.clearance_m(Point(self.sought.start)),
                target_indices=tuple(index + 1 for index in onward.target_indices),
            )
            routes.append((route.length_m + _TURN_COST_M_PER_DEG * _turned_deg(route), route))
        routes.sort(key=lambda one: one[0])
        yield from (route for _, route in routes[:_DEPARTURES_TRIED])

    def _onward(self, departure: Departure, band_m: float) -> Route | None:
        """Return the route on from a first leg, None where it does not lead on: from where less is free than is drawn with, it would first lead away."""
        drawn = self._drawn_at(band_m)
        if not drawn.is_free(departure.there):
            return None
        onward = drawn.find(departure.there)
        if isinstance(onward, NoRoute) or onward.lead_away:
            return None
        return onward if _turn_at_deg(self.sought.start, onward) <= _MOST_TURN_DEG else None

    def _least_departing_m(self, route: Route) -> float:
        """Return what the band has to keep while the route leads away; nothing while it leaves forbidden ground."""
        return self.departure_m if route.start_clearance_m >= 0 else -math.inf

    def _lead_away(self, drawing: Drawing) -> int:
        """Return how many of the first legs lead away: one at least where the start keeps less, as it does when fitting drops the leg's end."""
        most_m = max(point.required_m for point in drawing)
        near = [point.required_m < most_m - self._reserve_m for point in drawing]
        leading = near.index(False) if False in near else len(near)
        return max(leading - 1, int(near[0]))

    def _is_stopped(self) -> bool:
        return self.sought.should_stop is not None and self.sought.should_stop()


def _found(attempts: Sequence[_Attempt]) -> list[tuple[float, DrivenRoute]]:
    """Return the routes that were found, with what each costs."""
    return [(one.driven.cost_s, one.driven) for one in attempts if one.is_enough and one.driven is not None]


def _meets(drawing: Drawing, route: Route) -> bool:
    """Return whether lines meet the same targets as a route, which a blocked target's may not at another clearance."""
    fixed = [point.place for point in drawing[1:] if point.is_fixed]
    return len(fixed) == len(route.targets) and all(
        math.dist(*ends) < _SAME_M for ends in zip(fixed, route.targets, strict=True)
    )


def _course_deg(route: Route) -> float:
    """Return where the first leg leads, clockwise from north."""
    east_m, north_m = route.points[1] - route.points[0]
    return math.degrees(math.atan2(east_m, north_m))


def _turn_at_deg(start: LocalPoint, onward: Route) -> float:
    """Return how far a route turns where a first leg from the start ends."""
    here, after = onward.points[0], onward.points[1]
    turn_rad = math.atan2(*(after - here)) - math.atan2(*(here - np.array(start)))
    return abs(math.degrees((turn_rad + math.pi) % (2 * math.pi) - math.pi))


def _turned_deg(route: Route) -> float:
    """Return how far the lines turn in all."""
    east_m, north_m = np.diff(route.points, axis=0).T
    turns_rad = np.diff(np.arctan2(east_m, north_m))
    return float(np.degrees(np.abs((turns_rad + np.pi) % (2 * np.pi) - np.pi)).sum())
