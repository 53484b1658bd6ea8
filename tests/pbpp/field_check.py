"""Check one random field against shapely and the visibility graph; the campaign and the tests use the same check."""

import numpy as np
import shapely
from shapely.geometry import LineString, Point, Polygon
from visibility_graph import pinches, shortest_length

import pbpp

RELATIVE = 1e-6
TOUCH_M = 1e-7


def enclosed(ring):
    polygon = Polygon(ring)
    return polygon if polygon.is_valid else shapely.make_valid(polygon, method="linework")


def surrounded(ring):
    """Return all that a ring's line goes around."""
    line = shapely.union_all([LineString([*ring, ring[0]])])
    return shapely.union_all(shapely.get_parts(shapely.polygonize(shapely.get_parts([line]))))


def fence(field):
    """Return what is included and what is excluded, by shapely alone."""
    areas = [enclosed(ring) for ring in field.inclusions]
    included = shapely.union_all(areas) if field.union else shapely.intersection_all(areas)
    excluded = shapely.union_all([surrounded(ring) for ring in field.exclusions])
    # A union loses lines and slivers now and then, so they stand beside it.
    lines = [LineString([*ring, ring[0]]) for ring in field.exclusions]
    bare = [line for line in lines if not excluded.buffer(1e-9).covers(line)]
    if bare:
        excluded = shapely.GeometryCollection([excluded, *bare, *[Point(line.coords[0]) for line in bare]])
    return included, excluded


def connected(included, excluded, clearance_m, start, goal):
    """Return whether start and goal share a component of what keeps the clearance, corners round to a part in a million."""
    room = included.buffer(-clearance_m, quad_segs=256).difference(
        excluded.buffer(clearance_m, quad_segs=256)
    )
    parts = [part for part in shapely.get_parts(room) if isinstance(part, Polygon)]
    return any(part.distance(Point(start)) == 0.0 and part.distance(Point(goal)) == 0.0 for part in parts)


def verdict_of(planner, start, goal, method="optimal"):
    try:
        return "path", planner.plan(start, goal, method=method)
    except pbpp.StartBlockedError as error:
        return "start", error
    except pbpp.GoalBlockedError as error:
        return "goal", error
    except pbpp.NoPathError as error:
        return "none", error


def check_field(field, *, other_methods=True):
    """Assert that the planner is right about a field; return its verdict."""
    planner = field.planner()
    verdict, found = verdict_of(planner, field.start, field.goal)
    included, excluded = fence(field)
    if verdict in {"start", "goal"}:
        _check_blocked(field, found, included, excluded)
        return verdict
    back, returned = verdict_of(planner, field.goal, field.start)
    assert back == verdict
    if verdict == "none":
        _check_no_path(field, planner, included, excluded)
        return verdict
    _check_safe(found, field, included, excluded)
    assert np.isclose(found.length_m, returned.length_m, rtol=1e-9)
    assert found.lower_bound_m == found.length_m
    if "rounded" not in planner._space.__dict__:
        expected = shortest_length(planner.free_space, field.start, field.goal)
        tolerance = RELATIVE if not pinches(planner.free_space) else 10.0 * RELATIVE
        assert np.isclose(found.length_m, expected, rtol=tolerance, atol=tolerance)
        if field.clearance_m == 0.0:
            _check_free_space(planner.free_space, included, excluded)
    if other_methods:
        _check_methods(field, planner, found, included, excluded)
    return verdict


def check_safe(path, field):
    """Assert that a path keeps the field's clearance, by shapely alone."""
    _check_safe(path, field, *fence(field))


def _check_safe(path, field, included, excluded):
    assert tuple(path.points[0]) == field.start
    assert tuple(path.points[-1]) == field.goal
    line = LineString(path.points)
    if field.clearance_m > 0.0:
        assert line.distance(excluded) >= field.clearance_m - TOUCH_M
        assert line.distance(included.boundary) >= field.clearance_m - TOUCH_M
        assert included.covers(line)
    else:
        assert line.difference(included.buffer(TOUCH_M)).is_empty
        assert line.intersection(excluded.buffer(-TOUCH_M)).is_empty


def _check_blocked(field, error, included, excluded):
    point = Point(error.point_m)
    room = point.distance(excluded) if included.covers(point) else -1.0
    room = min(room, point.distance(included.boundary)) if room >= 0.0 else room
    # Blocked: outside, or nearer to the fence than the clearance and the excess of a round offset.
    assert room <= field.clearance_m + 0.003
    if error.nearest_free_m is not None:
        nearest = Point(error.nearest_free_m)
        assert np.isclose(point.distance(nearest), error.distance_m, atol=1e-6)
        assert nearest.distance(excluded) >= field.clearance_m - TOUCH_M
        assert nearest.distance(included) <= TOUCH_M


def _check_no_path(field, planner, included, excluded):
    if field.clearance_m > 0.0:
        # Right to a centimetre: a centimetre more clearance would part them for certain.
        assert not connected(included, excluded, field.clearance_m + 0.01, field.start, field.goal)
    else:
        assert shortest_length(planner.free_space, field.start, field.goal) == np.inf


def _check_free_space(free, included, excluded):
    independent = included.area - included.intersection(excluded).area
    assert np.isclose(free.area, independent, rtol=1e-9, atol=1e-9)


def _check_methods(field, planner, optimal, included, excluded):
    lengths = []
    for method in ("pbpp-taut", "pbpp"):
        verdict, path = verdict_of(planner, field.start, field.goal, method)
        assert verdict == "path"
        _check_safe(path, field, included, excluded)
        lengths.append(path.length_m)
    taut_m, paper_m = lengths
    assert optimal.length_m <= taut_m * (1.0 + 1e-9)
    assert taut_m <= paper_m * (1.0 + 1e-9)
