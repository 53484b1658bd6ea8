"""A route for a vehicle: drawn lines whose driven band keeps the promised clearance.

The shortest way is drawn first and fitted to the vehicle. Where a corner of it refuses every means, the place is blocked and another
way round is drawn.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
import shapely
from shapely import Point

from missions import drawn
from missions.drawn import Drawing, DrawnPoint
from missions.drive_model import corner_forecast, envelope
from missions.errors import NoRouteError, RouteError
from missions.fitting import Fitting
from missions.local_frame import LocalPoint
from missions.route import find_route

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from shapely import Polygon

    from missions.fitting import Measured
    from missions.ground import Ground
    from missions.route import Route
    from missions.vehicle import Vehicle

SLOW_MPS = 1.0
"""The slowest that a stretch is driven, and the narrowest band."""

_OTHER_WAYS = 5
_DEPARTURES = 24
_DEPARTURE_M = 15.0
_DEPARTURE_SLACK_M = 0.05
_BLOCK_M = 0.5
_BLOCK_AWAY_M = 8.0
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
    targets : tuple of (float, float)
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

    def find(self) -> DrivenRoute:
        """Find the quickest of the routes tried whose band keeps what is required.

        Raises
        ------
        StartBlockedError, TargetBlockedError, NoRouteError
            No route; with the fences or the corner to blame.
        """
        fitting = Fitting(self.ground, self.vehicle, self.heading_deg, self.should_stop)
        fast_m, slow_m = self._bands_m()
        refused: list[tuple[Drawing, Measured]] = []
        found: list[tuple[float, DrivenRoute]] = []
        routes = self._first_routes(fast_m, slow_m)
        for route, _ in routes:
            self._fit(fitting, route, found, refused)
            if found and route is routes[0][0] and len(routes) > 1 and not self._is_shorter(routes):
                break
        blocked: list[Polygon] = []
        while not found and len(blocked) < _OTHER_WAYS and not self._is_stopped():
            drawing, measured = refused[-1]
            blocked.append(_block(route, drawing, measured))
            try:
                route = self._draw(routes[-1][1], blocked)
            except RouteError:
                break
            self._fit(fitting, route, found, refused)
        if not found:
            raise self._refusal(*min(refused, key=lambda one: sum(one[1].missing_m)))
        return min(found, key=lambda one: one[0])[1]

    def _bands_m(self) -> tuple[float, float]:
        fast_m = corner_forecast(0.0, self.vehicle).outside_overshoot_m
        slow_mps = min(SLOW_MPS, self.vehicle.speed_mps)
        return fast_m, corner_forecast(0.0, self.vehicle, speed_mps=slow_mps).outside_overshoot_m

    def _first_routes(self, fast_m: float, slow_m: float) -> list[tuple[Route, float]]:
        """Give the shortest route at full speed's band, and that at the slow one's."""
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

    def _draw(self, band_m: float, blocked: Sequence[Polygon]) -> Route:
        clearance_m = self.required_m + band_m + self.reserve_m
        return find_route(
            self.ground,
            self.start,
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
    ) -> None:
        drawing, measured = fitting.fit(self._drawing(route))
        if not measured.is_enough:
            refused.append((drawing, measured))
            return
        targets = tuple(LocalPoint(*route.points[index].tolist()) for index in route.target_indices)
        driven = DrivenRoute(
            drawing,
            self._lead_away(drawing),
            route.start_clearance_m,
            targets,
            route.blocks,
            self._least_departing_m(route),
        )
        found.append((measured.cost_s, driven))

    def _drawing(self, route: Route) -> Drawing:
        """Give a route's lines with what each point has to keep: where it leads away, no less than the start does."""
        required_m = self.required_m + self.reserve_m
        near_m = self._least_departing_m(route) + self.reserve_m
        line_m = min(required_m, route.start_clearance_m) if route.start_clearance_m >= 0 else -math.inf
        fixed = {0, *route.target_indices} | ({1} if route.start_clearance_m < 0 else set())
        leading = {*range(max(route.lead_away, 1) + 1)} - {*route.target_indices}
        return tuple(
            DrawnPoint(
                east_m,
                north_m,
                near_m if number in leading else required_m,
                line_m if number in leading else required_m,
                is_fixed=number in fixed,
            )
            for number, (east_m, north_m) in enumerate(route.points.tolist())
        )

    @cached_property
    def departure_m(self) -> float:
        """What the band has to keep on the first leg: what is required, or what the vehicle's turning at this start leaves of it.

        A vehicle that stands near a fence, or faces it, can do no better than to leave by the best way.
        """
        ways_rad = np.arange(_DEPARTURES) * (2 * math.pi / _DEPARTURES)
        best_m = -math.inf
        for east, north in np.column_stack((np.sin(ways_rad), np.cos(ways_rad))).tolist():
            there = LocalPoint(
                self.start.east_m + _DEPARTURE_M * east, self.start.north_m + _DEPARTURE_M * north
            )
            course_deg = math.degrees(math.atan2(east, north))
            heading_deg = course_deg if self.heading_deg is None else self.heading_deg
            band = envelope([self.start, there], self.vehicle, heading_deg=heading_deg)
            best_m = max(best_m, float(band.clearances_m(self.ground.edge)[band.waypoints == 0].min()))
            if best_m >= self.required_m + self.reserve_m:
                return self.required_m
        return min(self.required_m, best_m - 2 * self.reserve_m - _DEPARTURE_SLACK_M)

    def _least_departing_m(self, route: Route) -> float:
        """Give what the band has to keep while the route leads away; nothing while it leaves forbidden ground."""
        return self.departure_m if route.start_clearance_m >= 0 else -math.inf

    def _lead_away(self, drawing: Drawing) -> int:
        """Give how many of the first legs lead away."""
        near = [point.required_m < self.required_m for point in drawing[1:]]
        return near.index(False) if False in near else len(near)

    def _is_stopped(self) -> bool:
        return self.should_stop is not None and self.should_stop()

    def _refusal(self, drawing: Drawing, measured: Measured) -> NoRouteError:
        """Say which corner refused, by how much, and at which fence."""
        index = max(range(len(drawing)), key=lambda number: measured.missing_m[number])
        point = drawing[index]
        position = self.ground.frame.to_lat_lon(LocalPoint(*point.place))
        barrier, _ = self.ground.nearest(Point(measured.worst[index]))
        fence = barrier.name if barrier else "no fence in particular"
        turn_deg = drawn.turn_deg(drawing, index) if 0 < index < len(drawing) - 1 else 0.0
        kept_m = point.required_m - self.reserve_m - measured.missing_m[index]
        where = (
            "the start"
            if index == 0
            else "the target"
            if index == len(drawing) - 1
            else f"the corner of {abs(turn_deg):.0f}° at {position}"
        )
        return NoRouteError(
            f"no route keeps {self.required_m:.2f} m while driving: at {where} this vehicle would come as near as "
            f"{max(kept_m, 0.0):.2f} m to {fence}, whatever was tried",
            clearance_m=round(self.required_m, 3),
            corner=list(position),
            turn_deg=round(turn_deg, 1),
            kept_m=round(max(kept_m, 0.0), 3),
            fences=[fence],
        )


def _block(route: Route, drawing: Drawing, measured: Measured) -> Polygon:
    """Give a small square on a route near where most is missing, to send the next one elsewhere."""
    index = max(range(len(drawing)), key=lambda number: measured.missing_m[number])
    place = measured.worst[index] if not math.isnan(measured.worst[index][0]) else drawing[index].place
    line = shapely.LineString(route.points)
    margin_m = min(_BLOCK_AWAY_M, line.length / 3)
    along_m = min(max(line.project(Point(place)), margin_m), line.length - margin_m)
    return line.interpolate(along_m).buffer(_BLOCK_M, cap_style="square")
