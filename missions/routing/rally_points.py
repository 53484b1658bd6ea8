"""Rally points for the day on which the companion computer fails: RTL is then the autopilot's, which drives straight to the nearest of them.

**What is free.** From every point of the route the straight line to the rally point that the autopilot would choose keeps what the route's own straight
legs have to keep: the promised clearance, the error of the position, and beside it the band that a straight leg is predicted to be driven in. Where the
route itself leads nearer to a fence, as it leaves its start, the line is at least no nearer than the route is there. The line begins anywhere between the
point and where the vehicle could stop ahead of it, as far as that keeps as much. The vehicle may be off the route by band and error when it chooses:
all places that may be the nearest from there count.

**How that is known.** The route is cut into pieces, never sampled. A distance changes by no more than the way between two points, so of a piece only
places count whose distance from its middle is the least one or little more (`rtl_lines.may_choose`); and all lines from a piece to a place fill a
triangle, which keeps the distance as a whole.

Home takes no part (RALLY_INCL_HOME 0, RALLY_LIMIT_KM 0): where it is the autopilot decides anew with each arming. It is one of the rally points where it can be.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
import shapely

from missions.checking.check import forecast_band_m
from missions.checking.rtl_lines import Metric, RoutePieces, swept
from missions.errors import NoRouteError, RouteError
from missions.geo import LocalPoint, rounded
from missions.ground.frame import bow_m
from missions.ground.from_situation import route_ground
from missions.ground.legs import ROUNDING_RESERVE_M
from missions.promise import promise
from missions.routing.rally_search import Candidates, fewest
from missions.vehicle import Autopilot
from missions.words import metres

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray
    from shapely.geometry.base import BaseGeometry

    from missions.checking.check import MissionCheck
    from missions.geo import LatLon
    from missions.ground.ground import Ground
    from missions.request import Request
    from missions.situation import Situation

RTL_PARAMETERS = {"RALLY_INCL_HOME": 0.0, "RALLY_LIMIT_KM": 0.0}
"""What the vehicle has to be set to, so that it chooses among the rally points alone."""

MOST_POINTS = 10
"""Rally points that are chosen at most: no board of ArduPilot's stores fewer than that."""

_PIECE_M, _MOST_PIECES = 1.0, 600
_GRID, _ON_ROUTE, _AT_CORNERS, _IN_FIELD = 260, 80, 120, 400
"""How many places are candidates, on a grid, on the route and at the corners of free ground; and how many of the field are looked at. Chosen: they bound the
work to a second or two."""
_CORNER_M = 0.25  # candidates at corners stand so far inside, so that rounding leaves them there
_CHORD_SHARE = 1.002
"""By so much a band of few chords must be wider to keep its distance all along: 16 a quarter circle need 1.0012."""
_LESS_SHARES = (0.75, 0.5, 0.25, 0.0)
"""Of the clearance, where less is accepted; 0 is the corridor alone: it touches no forbidden ground. Chosen."""
_NEAR_SHARES = (25.0, 100.0)
_MIDDLES, _DIRECTIONS = 12, 8
"""Where no set was found: places about those that were, and about what is left, within these shares of the field. Chosen, as above."""
_SHOWN = 40  # lines in a picture; chosen
_AHEAD_SHARES = (1.0, 0.75, 0.5, 0.25)  # of the way to a stop that may be cut short


@dataclass(frozen=True, eq=False)
class RallyChoice:
    """Rally points, and what holds with them.

    Parameters
    ----------
    points : tuple of LatLon
        As rounded into the items.
    clearance_m : float
        What the lines keep, as the route's promise; the corridor and the position's error come on top.
    keep_m : float
        How far the lines stay from any fence with all that.
    asked_m : float
        The clearance that was asked for.
    route_m, left_out_m : float
        How long the route is, and how much of it lies on forbidden ground: from there nothing can be free.
    field_share : float
        From what share of the free ground the line is free too: counted on a grid.
    has_home : bool
        Whether home is one of the points.
    lines : tuple of pairs of LatLon
        Some of the lines, from the route to the point that is chosen: for pictures.
    borders : tuple of (n, 2) arrays
        Where the nearest point changes, on free ground: for pictures.
    ground : Ground
        The field.
    """

    points: tuple[LatLon, ...]
    clearance_m: float
    keep_m: float
    asked_m: float
    route_m: float
    left_out_m: float
    field_share: float
    has_home: bool
    lines: tuple[tuple[LatLon, LatLon], ...]
    borders: tuple[NDArray[np.float64], ...]
    ground: Ground


def choose_rally_points(
    checked: MissionCheck,
    situation: Situation,
    request: Request,
    most: int = MOST_POINTS,
    should_stop: Callable[[], bool] | None = None,
) -> RallyChoice:
    """Choose the fewest rally points found with which RTL's straight line is free from every point of a mission's route.

    Parameters
    ----------
    checked : MissionCheck
        The mission, followed as the autopilot drives it.
    situation : Situation
        Fence, home and what is known of the vehicle.
    request : Request
        The clearance, and whether less is accepted.
    most : int
        How many points there may be.
    should_stop : callable, optional
        Asked now and then; True ends the search with what was found.

    Raises
    ------
    RouteError
        The vehicle is no ArduPilot.
    NoRouteError
        No set was found; it says how much of the route is left and what may help.
    MissionError
        As `missions.checking.check.check_mission`.
    """
    if checked.vehicle.autopilot is not Autopilot.ARDUPILOT:
        raise RouteError(
            f"rally points are chosen for ArduPilot's RTL; the vehicle is {checked.vehicle.autopilot}, which takes them otherwise",
            advice="draw them in the ground station, and upload them with pbpp upload",
        )
    asked = promise(situation, request, checked.vehicle)
    shares = (1.0, *_LESS_SHARES) if request.accepts_less else (1.0,)
    for share in shares:
        promised = replace(asked, promised_m=share * asked.promised_m)
        field = _RallyField(checked, situation, promised.promised_m, promised.required_m)
        found, chosen, left_m = _searched(field, most, should_stop)
        if left_m == 0.0 and chosen:
            return found.choice(found.best_for_field(chosen), asked.promised_m)
    raise _nothing_found(found, chosen, left_m, most, accepts_less=request.accepts_less)


def _searched(
    field: _RallyField, most: int, should_stop: Callable[[], bool] | None
) -> tuple[_Search, list[int], float]:
    """Search among places all over the field, and once more with many about what was found and what is left."""
    found = _Search(field, field.spread())
    chosen, left_m = fewest(found.candidates, most, should_stop)
    for reach_m in field.reaches_m:
        if not chosen or left_m == 0.0:
            break
        spoilt = np.flatnonzero(found.candidates.spoilt(chosen))
        kept = [found.places[one] for one in chosen]
        middles = np.vstack([field.at(kept), field.pieces.starts[spoilt], field.pieces.ends[spoilt]])
        found = _Search(field, [*kept, *found.places, *field.around(middles, reach_m)])
        before = [found.places.index(place) for place in kept]
        chosen, left_m = fewest(found.candidates, most, should_stop, before)
    return found, chosen, left_m


def _nothing_found(
    found: _Search, chosen: list[int], left_m: float, most: int, *, accepts_less: bool
) -> NoRouteError:
    field = found.field
    route_m = float(field.pieces.lengths_m.sum())
    spoilt = np.flatnonzero(found.candidates.spoilt(chosen)) if chosen else np.arange(1)
    first = field.position(field.pieces.starts[spoilt[0]])
    less = "" if accepts_less else "accept less clearance (--accept-less), "
    return NoRouteError(
        f"no set of at most {most} rally points was found with which RTL's straight line keeps {metres(field.promised_m)} from the whole route: "
        f"with the best set found the line is not free from {left_m:.0f} m of the {route_m:.0f} m, first at {first}",
        most=most,
        clearance_m=round(field.promised_m, 3),
        left_m=round(left_m, 1),
        route_m=round(route_m, 1),
        first_at=list(first),
        advice=f"{less}allow more points (--most), or set the failsafes to Hold (FS_ACTION 2)",
    )


class _RallyField:
    """A field at one clearance: the route in pieces, and what lines from each have to keep.

    Parameters
    ----------
    checked, situation
        As `choose_rally_points`.
    promised_m, required_m : float
        What the lines keep; with the error of the position.
    """

    def __init__(
        self, checked: MissionCheck, situation: Situation, promised_m: float, required_m: float
    ) -> None:
        vehicle = checked.vehicle
        self.ground = route_ground(situation, vehicle, checked.path)
        self.promised_m = promised_m
        band_m = forecast_band_m(checked.envelope)
        east_min_m, north_min_m, east_max_m, north_max_m = self.ground.allowed.bounds
        self.span_m = float(np.hypot(east_max_m - east_min_m, north_max_m - north_min_m))
        bowed_m = bow_m(self.span_m, self.ground.frame.origin.lat_deg)
        self.keep_m = required_m + band_m + ROUNDING_RESERVE_M + bowed_m
        self.metric = Metric.of(self.ground, self.span_m)
        self.off_m = band_m + required_m - promised_m
        self.free = _eroded(self.ground.allowed, self.ground.edge, self.keep_m)
        route = RoutePieces.of(self.at(checked.path), _PIECE_M, _MOST_PIECES)
        lines = np.asarray(shapely.linestrings(np.stack([route.starts, route.ends], axis=1)))
        allowed = shapely.covers(self.ground.allowed, lines)
        self.left_out_m = float(route.lengths_m[~allowed].sum())
        self.pieces = RoutePieces(route.starts[allowed], route.ends[allowed], route.legs[allowed])
        clear_m = _distances_m(self.ground, lines[allowed])
        self.need_m = np.minimum(self.keep_m, np.maximum(clear_m - ROUNDING_RESERVE_M, 0.0))
        speeds_mps = np.array([leg.speed_mps or vehicle.speed_mps for leg in checked.course.legs])
        stops_m = speeds_mps**2 / (2 * vehicle.accel_max_mps2)
        self.ahead = self._stopping(stops_m[self.pieces.legs])
        home = situation.home.value if situation.home else None
        self.home = self.position(self.at([home])[0]) if home else None

    def at(self, places: Sequence[LatLon]) -> NDArray[np.float64]:
        """Return places as points, (n, 2)."""
        return self.ground.frame.to_local_array(places)

    def position(self, point: NDArray[np.float64]) -> LatLon:
        """Return a point on Earth, as items hold it."""
        east_m, north_m = point.tolist()
        return rounded(self.ground.frame.to_lat_lon(LocalPoint(east_m, north_m)))

    def spread(self) -> list[LatLon]:
        """Return where rally points may be: at home, on a grid, on the route, at corners of free ground."""
        every = max(1, len(self.pieces) // _ON_ROUTE)
        corners = shapely.get_coordinates(self.free.buffer(-_CORNER_M).simplify(_CORNER_M))
        some = corners[:: max(1, len(corners) // _AT_CORNERS)]
        points = np.vstack(
            [_grid(self.free, _GRID), self.pieces.starts[::every], self.pieces.ends[-1:], some]
        )
        return [*([self.home] if self.home else []), *map(self.position, points)]

    @property
    def reaches_m(self) -> tuple[float, ...]:
        """How far about places others are looked for, wide and then near."""
        return tuple(self.span_m / share for share in _NEAR_SHARES)

    def around(self, middles: NDArray[np.float64], reach_m: float) -> list[LatLon]:
        """Return places about some of the middles."""
        some = middles[:: max(1, len(middles) // _MIDDLES)]
        turns = np.linspace(0.0, 2 * np.pi, _DIRECTIONS, endpoint=False)
        ways = np.column_stack((np.cos(turns), np.sin(turns)))
        rings = [some] + [(some[:, None, :] + share * reach_m * ways).reshape(-1, 2) for share in (1.0, 0.4)]
        return list(map(self.position, np.vstack(rings)))

    def are_free(self, shapes: NDArray[np.object_], need_m: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Return which shapes keep what they need."""
        free = shapely.covers(self.free, shapes)
        near = np.flatnonzero((need_m < self.keep_m) & ~free)
        free[near] = _distances_m(self.ground, shapes[near]) >= need_m[near]
        return np.asarray(free)

    def _stopping(self, stops_m: NDArray[np.float64]) -> RoutePieces:
        """Return the pieces with the way to a stop ahead of each, as far as it is free."""
        pieces = self.pieces
        ways = (pieces.ends - pieces.starts) / np.maximum(pieces.lengths_m, 1e-9)[:, None]
        ends = pieces.ends.copy()
        todo = np.ones(len(pieces), dtype=bool)
        for share in _AHEAD_SHARES:
            ahead = pieces.ends + ways * (share * stops_m)[:, None]
            lines = np.asarray(shapely.linestrings(np.stack([pieces.ends, ahead], axis=1)))
            free = todo & self.are_free(lines, self.need_m)
            ends[free] = ahead[free]
            todo &= ~free
        return RoutePieces(pieces.starts, ends, pieces.legs)


class _Search:
    """What places of a field see of the route, and of the field.

    Parameters
    ----------
    field : _RallyField
        The field.
    places : sequence of LatLon
        Where rally points may be; those that stand too near a fence are left out.
    """

    def __init__(self, field: _RallyField, places: Sequence[LatLon]) -> None:
        self.field = field
        found = list(dict.fromkeys(places))
        points = field.at(found)
        free = np.asarray(shapely.covers(field.free, shapely.points(points)))
        self.places = tuple(place for place, is_free in zip(found, free, strict=True) if is_free)
        self._points = field.at(self.places)

    @cached_property
    def candidates(self) -> Candidates:
        """What the places see of the route."""
        field = self.field
        everything = np.ones((len(self.places), len(field.pieces)), dtype=bool)
        hulls, place, piece = swept(field.ahead, self._points, everything)
        sees = everything.copy()
        sees[place, piece] = field.are_free(hulls, field.need_m[piece])
        within_m = field.pieces.lengths_m * field.metric.steepest + field.metric.slack_m
        middles = (field.pieces.starts + field.pieces.ends) / 2
        return Candidates(
            field.metric.distances_m(self._points, middles),
            sees,
            within_m + 2 * field.off_m * field.metric.steepest,
            field.pieces.lengths_m,
        )

    def best_for_field(self, chosen: list[int]) -> list[int]:
        """Exchange places, as long as the route stays free: home among them, then more of the field."""
        left, best = self.candidates, list(chosen)
        home = [number for number, place in enumerate(self.places) if place == self.field.home]
        if home and home[0] not in best:
            ways = [[*home, *best[:place], *best[place + 1 :]] for place in range(len(best))]
            free = [way for way in ways if left.left_m(way) == 0.0]
            best = max(free, key=self._share, default=best)
        for place in range(len(best)):
            if best[place] in home:
                continue
            others = best[:place] + best[place + 1 :]
            free_too = np.flatnonzero(left.with_each(others) == 0.0)
            best[place] = max((best[place], *free_too.tolist()), key=lambda one: self._share([*others, one]))
        return best

    def choice(self, chosen: list[int], asked_m: float) -> RallyChoice:
        """Return what was chosen."""
        field = self.field
        nearest = np.array(chosen)[self.candidates.away_m[chosen].argmin(axis=0)]
        some = np.unique(np.linspace(0, len(nearest) - 1, min(len(nearest), _SHOWN)).astype(int))
        points = tuple(self.places[one] for one in chosen)
        return RallyChoice(
            points=points,
            clearance_m=field.promised_m,
            keep_m=field.keep_m,
            asked_m=asked_m,
            route_m=float(field.pieces.lengths_m.sum()) + field.left_out_m,
            left_out_m=field.left_out_m,
            field_share=self._share(chosen),
            has_home=field.home in points,
            lines=tuple(
                (field.position(field.pieces.starts[one]), self.places[nearest[one]]) for one in some
            ),
            borders=_borders(field, self._points[chosen]),
            ground=field.ground,
        )

    @cached_property
    def _of_field(self) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
        """How far places of the field are from the candidates, and whether the line is free."""
        points = _grid(self.field.free, _IN_FIELD)
        ends = np.repeat(self._points, len(points), axis=0), np.tile(points, (len(self._points), 1))
        sees = shapely.covers(self.field.free, shapely.linestrings(np.stack(ends, axis=1)))
        return self.field.metric.distances_m(self._points, points), sees.reshape(
            len(self._points), len(points)
        )

    def _share(self, chosen: list[int]) -> float:
        """Return from what share of free ground the line to the nearest place is free."""
        away_m, sees = self._of_field
        nearest = np.array(chosen)[away_m[chosen].argmin(axis=0)]
        return float(sees[nearest, np.arange(sees.shape[1])].mean()) if sees.shape[1] else 0.0


def _borders(field: _RallyField, points: NDArray[np.float64]) -> tuple[NDArray[np.float64], ...]:
    """Return the lines on free ground on which two rally points are as near as each other to the autopilot."""
    if len(points) < 2:
        return ()
    scale = np.array([field.metric.east, field.metric.north])
    box = shapely.transform(field.free.envelope, lambda xy: xy * scale)
    edges = shapely.voronoi_polygons(shapely.multipoints(points * scale), extend_to=box, only_edges=True)
    parts = shapely.get_parts(shapely.transform(edges, lambda xy: xy / scale).intersection(field.free))
    return tuple(shapely.get_coordinates(part) for part in parts if part.length > 0)


def _distances_m(ground: Ground, shapes: NDArray[np.object_]) -> NDArray[np.float64]:
    """Return the distance of each shape to forbidden ground, -1 where it touches it."""
    if ground.edge.is_empty:
        return np.full(len(shapes), np.inf)
    away_m = np.asarray(shapely.distance(shapes, ground.edge))
    return np.where(shapely.covers(ground.allowed, shapes), away_m, -1.0)


def _eroded(allowed: BaseGeometry, edge: BaseGeometry, keep_m: float) -> BaseGeometry:
    """Return allowed ground without what is nearer to its edge; prepared."""
    free = allowed if edge.is_empty else allowed.difference(edge.buffer(keep_m * _CHORD_SHARE, quad_segs=16))
    shapely.prepare([free, allowed, edge])
    return free


def _grid(free: BaseGeometry, count: int) -> NDArray[np.float64]:
    """Return about so many points of free ground, evenly spread."""
    if free.is_empty:
        return np.empty((0, 2))
    step_m = float(np.sqrt(free.area / count))
    west_m, south_m, east_m, north_m = free.bounds
    axes = (np.arange(low + step_m / 2, high, step_m) for low, high in ((west_m, east_m), (south_m, north_m)))
    points = np.stack(np.meshgrid(*axes), axis=-1).reshape(-1, 2)
    return np.asarray(points[shapely.covers(free, shapely.points(points))])
