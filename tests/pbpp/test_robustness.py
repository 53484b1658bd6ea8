"""One test for each rule that makes the search exact, and for the inputs on which known planners fail."""

import numpy as np
import pytest
import shapely
from visibility_graph import shortest_length

import pbpp
from pbpp.any_angle import shortest_path
from pbpp.field import Field
from pbpp.free_space import parse_scene


def turned(rings, angle_rad, middle=(50.0, 50.0)):
    spin = np.array([[np.cos(angle_rad), np.sin(angle_rad)], [-np.sin(angle_rad), np.cos(angle_rad)]])
    return [(np.asarray(ring) - middle) @ spin + middle for ring in rings]


def box(west, south, east, north):
    return [(west, south), (east, south), (east, north), (west, north)]


LATTICE = [box(e + 2, n + 2, e + 8, n + 8) for e in range(0, 100, 10) for n in range(0, 100, 10)]


@pytest.mark.parametrize("angle_deg", [0.0, 1.0, 30.0, 45.0, 77.7, 90.0])
def test_rays_are_cast_by_vertices_not_by_interpolated_points(square, angle_deg):
    # A lattice has hundreds of corners on common lines in many directions: rounding decides what is seen past them.
    angle_rad = np.radians(angle_deg)
    inclusions, exclusions = turned([square], angle_rad), turned(LATTICE[::3], angle_rad)
    planner = pbpp.Planner(inclusions, exclusions)
    for start, goal in [((1, 1), (99, 99)), ((1, 50), (99, 41)), ((9, 1), (31, 99)), ((0, 0), (60, 20))]:
        ends = [tuple(turned([[end]], angle_rad)[0][0]) for end in (start, goal)]
        expected = shortest_length(planner.free_space, *ends)
        assert planner.plan(*ends).length_m == pytest.approx(expected, rel=1e-9)


def test_paths_turn_at_tangent_vertices_only(load_case):
    # The path hugs obstacles: on the inside of every turn lies an obstacle.
    case = load_case("rand100")
    planner = pbpp.Planner([case["inclusion"]], case["exclusions"])
    for query in case["queries"]:
        points = planner.plan(query[:2], query[2:]).points
        for before, here, after in zip(points, points[1:], points[2:], strict=False):
            back, on = before - here, after - here
            inside = shapely.Polygon(
                [here, here + 0.1 * back / np.hypot(*back), here + 0.1 * on / np.hypot(*on)]
            )
            assert inside.difference(planner.free_space).area > 1e-6 * inside.area


def test_equal_ways_to_a_corner_are_followed_once():
    # Behind each diamond two equally long ways meet: followed both, the work doubles with every diamond.
    diamonds = [[(x, 0.0), (x + 5, -5.0), (x + 10, 0.0), (x + 5, 5.0)] for x in range(0, 400, 20)]
    planner = pbpp.Planner([box(-10, -5.5, 410, 5.5)], diamonds)
    path = planner.plan((-5.0, 0.0), (405.0, 0.0))
    assert path.expanded < 40 * len(diamonds)
    assert path.length_m == pytest.approx(
        shortest_length(planner.free_space, (-5.0, 0.0), (405.0, 0.0)), rel=1e-9
    )


def test_the_goal_is_final_only_when_it_is_taken_from_the_queue(square):
    # A corridor leads the first cone straight on to the goal by the long way round; the short way has more branches.
    walls = [box(10, 45, 90, 55), box(48, 0, 52, 38), box(60, 20, 100, 22), box(55, 30, 80, 32)]
    planner = pbpp.Planner([square], walls)
    for start, goal in [
        ((50.0, 44.0), (50.0, 56.0)),
        ((20.0, 44.0), (80.0, 56.0)),
        ((53.0, 10.0), (30.0, 60.0)),
    ]:
        expected = shortest_length(planner.free_space, start, goal)
        assert planner.plan(start, goal).length_m == pytest.approx(expected, rel=1e-9)


def test_duplicate_vertices_and_tiny_edges_say_nothing(square):
    ring = [(30, 30), (70, 30), (70, 30), (70, 30 + 1e-11), (70, 70), (30, 70), (30, 70 - 1e-12)]
    path = pbpp.plan_path([square], [ring, ring], (10, 50), (90, 50))
    assert path.length_m == pytest.approx(2 * np.hypot(20, 20) + 40, rel=1e-9)


@pytest.mark.parametrize("angle_deg", [0.0, 45.0, 90.0])
def test_touching_corners_are_impassable(square, angle_deg):
    boxes = turned([box(0, 30, 50, 50), box(50, 50, 100, 70)], np.radians(angle_deg))
    area = turned([square], np.radians(angle_deg))
    ends = [tuple(turned([[end]], np.radians(angle_deg))[0][0]) for end in ((50.0, 20.0), (50.0, 80.0))]
    if angle_deg == 45.0:  # rounding may leave a gap of some 1e-15 m: it is closed
        boxes[0][2] = boxes[1][0]
    with pytest.raises(pbpp.NoPathError, match="no path joins start and goal"):
        pbpp.plan_path(area, boxes, *ends)


@pytest.mark.parametrize("method", ["pbpp", "pbpp-taut"])
def test_no_diagonal_step_leads_through_touching_corners(square, method):
    exclusions = [box(10, 30, 50, 50), box(50, 50, 90, 70)]
    planner = pbpp.Planner([square], exclusions)
    path = planner.plan((49.0, 52.0), (51.0, 48.0), method=method)
    assert path.length_m >= planner.plan((49.0, 52.0), (51.0, 48.0)).length_m > 50.0


def test_a_path_along_aligned_edges_does_not_slip_through_a_pinch():
    # Both obstacles touch the line x = 5, on either side of the pinch at (5, 4).
    exclusions = [box(3, 3, 5, 4), box(5, 4, 7, 5)]
    planner = pbpp.Planner([box(0, 0, 10, 10)], exclusions)
    path = planner.plan((5, 6), (5, 2))
    assert path.length_m == pytest.approx(planner.plan((5, 2), (5, 6)).length_m)
    assert path.length_m == pytest.approx(shortest_length(planner.free_space, (5, 6), (5, 2)), rel=1e-5)
    assert path.length_m > 4.5


def test_an_end_on_a_pinch_leaves_it_to_either_side():
    exclusions = [box(0, 4, 5, 6), box(5, 6, 10, 8)]
    planner = pbpp.Planner([box(0, 0, 10, 10)], exclusions)
    assert len(planner.free_space.geoms) == 2
    assert planner.plan((5, 6), (5, 1)).length_m == pytest.approx(5.0)
    assert planner.plan((5, 6), (5, 9)).length_m == pytest.approx(3.0)
    assert planner.plan((9, 1), (5, 6)).length_m == pytest.approx(np.hypot(4, 5))


def test_three_obstacles_may_meet_in_one_point():
    spikes = [[(5, 5), (9, 4), (9, 6)], [(5, 5), (1, 6), (1, 4)], [(5, 5), (6, 9), (4, 9)]]
    planner = pbpp.Planner([box(0, 0, 10, 10)], spikes)
    for goal in [(5, 1), (3, 8), (7, 8)]:
        for start in [(2, 2), (8, 2), (2, 8.5), (9.5, 5)]:
            expected = shortest_length(planner.free_space, start, goal)
            assert planner.plan(start, goal).length_m == pytest.approx(expected, rel=1e-5)


@pytest.mark.parametrize("start", [(30, 30), (30, 50), (70, 70), (50, 70), (30, 10), (70, 95)])
@pytest.mark.parametrize("goal", [(70, 30), (50, 30), (70, 50), (30, 70), (0, 0), (100, 50), (30, 90)])
def test_ends_on_corners_edges_and_their_lines(square, start, goal):
    planner = pbpp.Planner([square], [box(30, 30, 70, 70)])
    expected = shortest_length(planner.free_space, start, goal)
    assert planner.plan(start, goal).length_m == pytest.approx(expected, rel=1e-9)


def test_start_and_goal_may_be_the_same_point(square):
    path = pbpp.plan_path([square], [], (5, 5), (5, 5))
    assert path.length_m == 0.0
    assert path.points.tolist() == [[5, 5], [5, 5]]


def test_aligned_obstacles_are_passed_straight_along_their_edges():
    column = [box(3, n, 5, n + 1) for n in range(1, 20, 3)] + [box(5, n, 7, n + 1) for n in range(2, 20, 6)]
    planner = pbpp.Planner([box(0, 0, 10, 25)], column)
    for start, goal in [
        ((5, 0), (5, 24)),
        ((4, 0.5), (4, 22)),
        ((3, 0), (3, 25)),
        ((7, 25), (7, 0)),
        ((7, 8), (5, 24)),
    ]:
        expected = shortest_length(planner.free_space, start, goal)
        assert planner.plan(start, goal).length_m == pytest.approx(expected, rel=1e-6)


def test_the_bound_never_exceeds_the_length_and_meets_it_at_the_end(load_case):
    case = load_case("rand100")
    scene = parse_scene([case["inclusion"]], case["exclusions"], union=False)
    field = Field(scene, 0.0)
    start, goal = (tuple(case["queries"][0][i : i + 2]) for i in (0, 2))
    full = shortest_path(field.slabs, start, goal)
    bounds = []
    for steps in range(1, 6):
        answers = iter([False] * steps + [True] * 1000)
        part = shortest_path(field.slabs, start, goal, lambda answers=answers: next(answers))
        bounds.append(part.lower_bound_m)
        assert part.stopped or part.lower_bound_m == full.lower_bound_m
    assert bounds == sorted(bounds)
    assert bounds[-1] <= full.lower_bound_m
