"""A route for a vehicle: drawn lines whose driven band keeps the promised clearance.

**How.** `pbpp` draws the shortest path for a disc; a vehicle's band is wider at corners, and how wide depends on the corners, which depend on
the path. So the path is drawn with room for the band of a straight line only, and `fitting.local_search` bends and slows it until the band at
its corners keeps the promise too. Two paths are drawn, with room for the band at full speed and at `SLOW_MPS`: the second passes narrower
places, and is fitted only where the first fails or is longer by some per cent. Where neither can be fitted, in this order: first legs that the
vehicle can drive as it faces, if it is the start that refuses; the whole route at a slow speed; and other ways round, each drawn with a small
square laid over the place where most was missing so far. Of those found the one of least cost is the answer.

**Why.** A path that is exact for the vehicle would need a search over position, heading and speed. Shortest paths of a disc are exact and
quick, and fitting them loses little (docs/drive-bench.md: 590 of 600 found, in the median 0.6 to 1.7 % longer than the shortest).
The square works because shortest paths leave nothing between: what is nearly as short passes the same place, so another try has to be kept off
it. Each stage has its allowance of measurements, so that a refusal comes in bounded time. It is a heuristic: a refusal names the
corner that refused; it does not prove that no route exists.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from shapely import Point

from missions.drive_model import corner_forecast
from missions.errors import RouteError
from missions.fitting.local_search import MOST_MEASUREMENTS, Fitting
from missions.fitting.polyline import Drawing, DrawnPoint
from missions.routing.departure import ROOM_M, departures
from missions.routing.drawn_route import find_route
from missions.routing.refusal import AT_START, block, refusal

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from shapely import Polygon

    from missions.fitting.cost import Measured
    from missions.geo import LocalPoint
    from missions.ground.ground import Ground
    from missions.routing.departure import Departure
    from missions.routing.drawn_route import Route
    from missions.vehicle import Vehicle

SLOW_MPS = 1.0
"""The slowest that a stretch is driven, and the narrowest band: steered rovers below 1 m/s swing out farther (docs/drive-model.md)."""

SLOW_ALL_THE_WAY_MPS = (2.0, 1.0)
"""Where slow stretches do not suffice: the whole route at such a speed, so that none changes at corners. Both speeds were measured."""

LATER_MEASUREMENTS = 500
"""For each kind of route that is tried after the first ones. Chosen, not measured: it bounds the time until a refusal."""

# Chosen, not measured, but the turn at the end of a first leg.
_OTHER_WAYS = 5  # squares laid over refusing places before the search gives up
# Missing at the start beyond what a slower, narrower band could win back: nothing else is tried
_HELD_M = 0.05
_DEPARTURES_TRIED = 8  # of the first legs, the shortest routes
# What the first leg may keep less than the best departure, for rounding and bending
_DEPARTURE_SLACK_M = 0.05
_TURN_COST_M_PER_DEG = 0.1  # orders the departures: a turn of 90° counts as 9 m
_MOST_TURN_DEG = 100.0
"""At the end of a first leg: tried with more, rovers that came back the way they went left the band."""
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
    """

    drawing: Drawing
    lead_away: int
    start_clearance_m: float
    targets: tuple[LocalPoint, ...]
    blocks: int
    lead_away_m: float | None = None


@dataclass(frozen=True, eq=False)
class RouteSearch:
    """What is looked for.

    Parameters
    ----------
    ground : Ground
        The field.
    start, targets : LocalPoint
        Where from, and where to.
    required_m : float
        What the driven band has to keep to any fence.
    reserve_m : float
        For rounding the drawn lines.
    vehicle : Vehicle
        What drives.
    heading_deg : float or None
        Where it faces.
    snap_m : float
        A blocked target is moved to free ground within this distance.
    method : str
        ``optimal``, ``pbpp-taut`` or ``pbpp``.
    should_stop : callable, optional
        Asked now and then; True ends the search.
    escape : bool
        Whether a start on forbidden ground may be left.
    measurements : int, optional
        How often the drive model may be asked.
    """

    ground: Ground
    start: LocalPoint
    targets: Sequence[LocalPoint]
    required_m: float
    reserve_m: float
    vehicle: Vehicle
    heading_deg: float | None
    snap_m: float = 0.0
    method: str = "optimal"
    should_stop: Callable[[], bool] | None = None
    escape: bool = False
    measurements: int | None = None

    def find(self) -> DrivenRoute:
        """Find the quickest of the routes tried whose band keeps what is required.

        Raises
        ------
        StartBlockedError, TargetBlockedError, NoRouteError
            No route; with the fences or the corner to blame.
        """
        fitting = self._fitting(MOST_MEASUREMENTS)
        fast_m, slow_m = self._bands_m()
        refused: list[tuple[Drawing, Measured]] = []
        found: list[tuple[float, DrivenRoute]] = []
        routes = self._first_routes(fast_m, slow_m)
        for route, _ in routes:
            self._fit(fitting, route, found, refused)
            if found and route is routes[0][0] and len(routes) > 1 and not self._is_shorter(routes):
                break
        if not found and refused[-1][1].worst_index <= AT_START:
            fitting = self._fitting(LATER_MEASUREMENTS)
            for departing in self._departing_routes(slow_m):
                self._fit(fitting, departing, found, refused)
                if found or self._is_stopped():
                    break
        is_held = not found and self._is_held_at_start(refused, fast_m - slow_m)
        if not found and not is_held:
            self._fit_slowly(routes[-1][0], found, refused)
            self._fit_other_ways(routes[-1], found, refused)
        if not found:
            drawing, measured = min(refused, key=lambda one: sum(one[1].missing_m))
            raise refusal(
                self.ground, self.required_m, self.reserve_m, drawing, measured, held_at_start=is_held
            )
        return min(found, key=lambda one: one[0])[1]

    def _is_held_at_start(self, refused: Sequence[tuple[Drawing, Measured]], narrower_m: float) -> bool:
        """Return whether nothing more is worth trying, as the vehicle cannot turn at its start.

        However slowly it drives it swings as far where it starts with its heading wrong; only its band becomes narrower.
        """
        return all(
            measured.worst_index <= AT_START and measured.missing_m[0] > narrower_m + _HELD_M
            for _, measured in refused
        )

    def _fit_slowly(
        self,
        route: Route,
        found: list[tuple[float, DrivenRoute]],
        refused: list[tuple[Drawing, Measured]],
    ) -> None:
        """Drive a route slowly all the way, so that nothing changes at corners."""
        for speed_mps in SLOW_ALL_THE_WAY_MPS:
            if not found and speed_mps < self.vehicle.speed_mps and not self._is_stopped():
                self._fit(self._fitting(LATER_MEASUREMENTS), route, found, refused, speed_mps)

    def _fit_other_ways(
        self,
        refusing: tuple[Route, float],
        found: list[tuple[float, DrivenRoute]],
        refused: list[tuple[Drawing, Measured]],
    ) -> None:
        """Keep away from where routes were refused, and draw others with the same band."""
        route, band_m = refusing
        fitting = self._fitting(LATER_MEASUREMENTS)
        blocked: list[Polygon] = []
        while not found and len(blocked) < _OTHER_WAYS and not self._is_stopped():
            drawing, measured = refused[-1]
            blocked.append(block(route, drawing, measured))
            try:
                route = self._draw(band_m, blocked)
            except RouteError:
                break
            self._fit(fitting, route, found, refused)

    def _fitting(self, measurements: int) -> Fitting:
        most = min(measurements, self.measurements or measurements)
        return Fitting(self.ground, self.vehicle, self.heading_deg, self.should_stop, most)

    def _bands_m(self) -> tuple[float, float]:
        fast_m = corner_forecast(0.0, self.vehicle).outside_overshoot_m
        slow_mps = min(SLOW_MPS, self.vehicle.speed_mps)
        return fast_m, corner_forecast(0.0, self.vehicle, speed_mps=slow_mps).outside_overshoot_m

    def _first_routes(self, fast_m: float, slow_m: float) -> list[tuple[Route, float]]:
        """Return the shortest route at full speed's band, and the one at the slow speed's."""
        routes = []
        try:
            routes.append((self._draw(fast_m, ()), fast_m))
        except RouteError:
            if slow_m == fast_m:
                raise
        if slow_m < fast_m:
            try:
                routes.append((self._draw(slow_m, ()), slow_m))
            except RouteError:
                if not routes:
                    raise
        return routes

    @staticmethod
    def _is_shorter(routes: list[tuple[Route, float]]) -> bool:
        return routes[1][0].length_m < _SHORTER_SHARE * routes[0][0].length_m

    def _draw(self, band_m: float, blocked: Sequence[Polygon], start: LocalPoint | None = None) -> Route:
        clearance_m = self.required_m + band_m + self.reserve_m
        return find_route(
            self.ground,
            start or self.start,
            list(self.targets),
            clearance_m,
            promised_m=self.required_m,
            blocked=blocked,
            snap_m=self.snap_m,
            method=self.method,
            escape=self.escape,
            should_stop=self.should_stop,
        )

    def _fit(
        self,
        fitting: Fitting,
        route: Route,
        found: list[tuple[float, DrivenRoute]],
        refused: list[tuple[Drawing, Measured]],
        speed_mps: float | None = None,
    ) -> None:
        drawing, measured = fitting.fit(
            tuple(replace(point, speed_mps=speed_mps) for point in self._drawing(route))
        )
        if not measured.is_enough:
            refused.append((drawing, measured))
            return
        driven = DrivenRoute(
            drawing,
            self._lead_away(drawing),
            route.start_clearance_m,
            route.targets,
            route.blocks,
            self._least_departing_m(route),
        )
        found.append((measured.cost_s, driven))

    def _drawing(self, route: Route) -> Drawing:
        """Return a route's lines with what each point has to keep: where the route leads away, no less than the start does."""
        required_m = self.required_m + self.reserve_m
        near_m = self._least_departing_m(route) + self.reserve_m
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
    def departure_m(self) -> float:
        """What the band has to keep on the first leg: what is required, or what the vehicle's turning at this start leaves of it.

        A vehicle that stands near a fence, or faces it, can do no better than to leave by the best way.
        """
        if self.ground.clearance_m(Point(self.start)) >= self.required_m + ROOM_M:
            return self.required_m
        best_m = self._departures[0].kept_m
        if best_m >= self.required_m + self.reserve_m:
            return self.required_m
        return min(self.required_m, best_m - 2 * self.reserve_m - _DEPARTURE_SLACK_M)

    @cached_property
    def _departures(self) -> list[Departure]:
        return departures(self.ground, self.vehicle, self.start, self.heading_deg)

    def _departing_routes(self, band_m: float) -> Iterator[Route]:
        """Return routes by the first legs that the vehicle can drive as it faces, the shortest first."""
        keeps_m = self.departure_m + self.reserve_m
        routes = []
        for departure in self._departures:
            if departure.kept_m < keeps_m:
                break
            try:
                onward = self._draw(band_m, (), departure.there)
            except RouteError:
                continue
            if onward.lead_away or _turn_at_deg(self.start, onward) > _MOST_TURN_DEG:
                continue
            route = replace(
                onward,
                points=np.vstack([self.start, onward.points]),
                lead_away=int(self.departure_m < self.required_m),
                start_clearance_m=self.ground.clearance_m(Point(self.start)),
                target_indices=tuple(index + 1 for index in onward.target_indices),
            )
            routes.append((route.length_m + _TURN_COST_M_PER_DEG * _turned_deg(route), route))
        routes.sort(key=lambda one: one[0])
        yield from (route for _, route in routes[:_DEPARTURES_TRIED])

    def _least_departing_m(self, route: Route) -> float:
        """Return what the band has to keep while the route leads away; nothing while it leaves forbidden ground."""
        return self.departure_m if route.start_clearance_m >= 0 else -math.inf

    def _lead_away(self, drawing: Drawing) -> int:
        """Return how many of the first legs lead away."""
        near = [point.required_m < self.required_m for point in drawing[1:]]
        return near.index(False) if False in near else len(near)

    def _is_stopped(self) -> bool:
        return self.should_stop is not None and self.should_stop()


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
