"""The paper's own steps: the block search, the three cases, and the taut path."""

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from random_fields import random_field
from visibility_graph import shortest_length

import pbpp
from pbpp.block_search import BlockGraph, block_sequence
from pbpp.errors import SearchStoppedError
from pbpp.field import Field
from pbpp.free_space import parse_scene
from pbpp.funnel import taut_path
from pbpp.partition.base import Portals
from pbpp.planned_path import length_of, straightened
from pbpp.three_cases import crossing_point, passable

COORDINATE = st.floats(-100.0, 100.0)
POINT = st.tuples(COORDINATE, COORDINATE)


@pytest.fixture
def graph(load_case):
    case = load_case("paper_3")
    return Field(parse_scene([case["inclusion"]], case["exclusions"], union=False), 0.0).graph("blocks")


@pytest.mark.parametrize(
    ("goal", "expected"),
    [
        ((-3, 5), (2, 0)),  # case 1: the angle at A is obtuse
        ((0, 5), (2, 0)),  # case 1: it is right
        ((13, 5), (8, 0)),  # case 2
        ((10, 5), (8, 0)),
        ((4, 5), (4, 0)),  # case 3: the foot of the perpendicular
        ((1, 5), (2, 0)),  # case 3 kept the radius away from A
        ((9.5, 5), (8, 0)),
    ],
)
@pytest.mark.parametrize("turn", [0.0, 0.3, np.pi / 2, np.pi, 4.0])
def test_the_three_cases(goal, expected, turn):
    spin = np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
    a, b, goal_there, expected_there = (tuple(np.array(p) @ spin) for p in ((0, 0), (10, 0), goal, expected))
    assert crossing_point((a, b), goal_there, 2.0) == pytest.approx(expected_there, abs=1e-9)
    assert crossing_point((b, a), goal_there, 2.0) == pytest.approx(expected_there, abs=1e-9)


def test_a_short_edge_is_crossed_in_its_middle_and_not_passable():
    crossing = ((0.0, 0.0), (3.0, 0.0))
    assert crossing_point(crossing, (100.0, 1.0), 2.0) == (1.5, 0.0)
    assert not passable(crossing, 2.0)
    assert passable(crossing, 1.5)
    corner = ((1.0, 1.0), (1.0, 1.0))
    assert crossing_point(corner, (5.0, 5.0), 0.0) == (1.0, 1.0)
    assert passable(corner, 0.0)
    assert not passable(corner, 0.1)


@given(a=POINT, b=POINT, goal=POINT, range_m=st.floats(0.0, 50.0))
@settings(max_examples=300, deadline=None, derandomize=True, database=None)
def test_the_crossing_point_is_on_the_edge_and_the_nearest_allowed_one(a, b, goal, range_m):
    here = np.array(crossing_point((a, b), goal, range_m))
    a, b, goal = np.array(a), np.array(b), np.array(goal)
    length_m = np.hypot(*(b - a))
    share = np.linspace(0.0, 1.0, 201)
    spots = a + share[:, None] * (b - a)
    assert np.hypot(*(spots - here).T).min() <= length_m / 200 + 1e-9
    allowed = (share * length_m >= range_m) & ((1 - share) * length_m >= range_m)
    if allowed.any():
        nearest = np.hypot(*(spots[allowed] - goal).T).min()
        assert np.hypot(*(here - goal)) <= nearest + 1e-6 * (1.0 + nearest)


@pytest.mark.parametrize("cost", ["metric", "literal"])
def test_the_sequence_leads_from_neighbour_to_neighbour(graph, cost):
    start, goal = (160.0, 180.0), (30.0, 30.0)
    sequence, crossings, expanded = block_sequence(graph, start, goal, cost=cost)
    assert sequence[0] in graph.partition.locate(start)
    assert sequence[-1] in graph.partition.locate(goal)
    assert len(set(sequence)) == len(sequence) == len(crossings) + 1
    assert expanded >= len(sequence)
    for here, there, crossing in zip(sequence, sequence[1:], crossings, strict=False):
        assert (there, crossing) in [(other, common) for other, common, _ in graph.neighbours[here]]


def test_metric_cost_is_the_shortest_way_through_the_centres(graph):
    """Check against Dijkstra over all sequences."""
    start, goal = (160.0, 180.0), (30.0, 30.0)
    sequence, *_ = block_sequence(graph, start, goal)
    best = dict.fromkeys(range(len(graph.centers)), np.inf) | {sequence[0]: 0.0}
    for _ in graph.centers:
        for here, ways in enumerate(graph.neighbours):
            for there, _crossing, _step in ways:
                best[there] = min(
                    best[there],
                    best[here] + np.hypot(*np.subtract(graph.centers[there], graph.centers[here])),
                )
    assert length_of(np.array([graph.centers[block] for block in sequence])) == pytest.approx(
        best[sequence[-1]]
    )


def test_literal_cost_counts_steps():
    # From 0 to 3 by way of 1 in two long steps, by way of 2 in two short diagonal ones.
    class Four:
        centers = np.array([(0, 0), (50, 0), (5, 5), (10, 10)], dtype=float)
        portals = Portals(np.array([(0, 1), (1, 3)]), np.zeros((2, 2, 2)))
        diagonals = ((0, 2, (1.0, 1.0)), (2, 3, (2.0, 2.0)))

        def locate(self, point):
            return [int(np.argmin(np.hypot(*(self.centers - point).T)))]

    four = BlockGraph(Four())
    assert block_sequence(four, (0.0, 0.0), (10.0, 10.0))[0] == [0, 2, 3]
    four.centers[1] = (8.0, 7.0)
    four.centers[2] = (1.0, 9.0)
    assert block_sequence(four, (0.0, 0.0), (10.0, 10.0), cost="literal")[0] == [0, 1, 3]


@pytest.mark.parametrize("method", ["pbpp", "pbpp-taut"])
@pytest.mark.parametrize("cost", ["metric", "literal"])
def test_a_path_is_planned_by_either_cost(load_case, graph, method, cost):
    case = load_case("paper_3")
    start, goal = (160.0, 180.0), (30.0, 30.0)
    path = pbpp.plan_path([case["inclusion"]], case["exclusions"], start, goal, method=method, cost=cost)
    assert list(path.sequence) == block_sequence(graph, start, goal, cost=cost)[0]


def test_the_two_costs_look_at_blocks_in_another_order():
    square = [(0, 0), (200, 0), (200, 200), (0, 200)]
    posts = [[(x, 95), (x + 1, 95), (x + 1, 105), (x, 105)] for x in range(60, 144, 7)]
    planner = pbpp.Planner([square], posts)
    looked_at = {
        cost: planner.plan((5, 97), (195, 103), method="pbpp", cost=cost).expanded
        for cost in ("metric", "literal")
    }
    assert looked_at["metric"] > 2 * looked_at["literal"]  # a step counts for 1, however long it is


def test_a_cost_that_is_none():
    with pytest.raises(ValueError, match="cost must be"):
        pbpp.plan_path([], [], (0, 0), (1, 1), cost="steps")


def test_range_alone_keeps_less_than_the_radius():
    """A corner between two edges that are both crossed at the radius from it is passed at radius / √2: the reason for shrinking free space."""
    corner, radius_m = (10.0, 10.0), 2.0
    below = crossing_point((corner, (10.0, 30.0)), (0.0, 10.0), radius_m)
    beside = crossing_point((corner, (30.0, 10.0)), (10.0, 0.0), radius_m)
    leg = shapely.LineString([below, beside])
    assert leg.distance(shapely.Point(corner)) == pytest.approx(radius_m / 2**0.5)


def test_a_block_search_can_be_stopped(graph):
    with pytest.raises(SearchStoppedError, match="stopped before it had found any path"):
        block_sequence(graph, (160.0, 180.0), (30.0, 30.0), should_stop=lambda: True)


def test_no_sequence_between_components(load_case):
    case = load_case("rb_sealed")
    field = Field(parse_scene([case["inclusion"]], case["exclusions"], union=False), 0.0)
    assert block_sequence(field.graph("blocks"), (10.0, 10.0), (50.0, 50.0)) is None


@pytest.mark.parametrize("seed", range(60))
def test_the_taut_path_is_the_shortest_within_its_blocks(seed):
    field = random_field(seed)
    planner = field.planner()
    try:
        path = planner.plan(field.start, field.goal, method="pbpp-taut")
    except pbpp.PlanningError:
        return
    partition = path.drawing.field.blocks
    outlines = [pbpp_polygon(partition.outline(block)) for block in path.sequence]
    corners = [np.array(common) for common in common_points(path)]
    corridor = union_of(outlines, corners)
    expected = shortest_length(corridor, field.start, field.goal)
    assert path.length_m == pytest.approx(expected, rel=1e-5, abs=1e-5)


def pbpp_polygon(outline):
    from shapely.geometry import Polygon

    return Polygon(outline)


def common_points(path):
    graph = path.drawing.field.graph("blocks")
    for here, there in zip(path.sequence, path.sequence[1:], strict=False):
        for other, (first, second), _ in graph.neighbours[here]:
            if other == there and first == second:
                yield first


def union_of(outlines, corners):
    """Return the blocks as one polygon; where two share only a corner, a tiny square joins them."""
    import shapely

    joints = [shapely.box(*(corner - 1e-6), *(corner + 1e-6)) for corner in corners]
    return shapely.union_all([*outlines, *joints], grid_size=1e-9)


def test_a_taut_path_turns_at_the_ends_of_edges():
    crossings = [((10.0, 0.0), (10.0, 2.0)), ((20.0, 6.0), (20.0, 9.0)), ((30.0, 0.0), (30.0, 2.5))]
    centers = [(5.0, 2.0), (15.0, 5.0), (25.0, 5.0), (35.0, 2.0)]
    path = taut_path((0.0, 0.0), (40.0, 0.0), crossings, centers)
    assert path == [(0.0, 0.0), (10.0, 2.0), (20.0, 6.0), (30.0, 2.5), (40.0, 0.0)]
    mirrored = [((-a, b), (-c, d)) for (a, b), (c, d) in crossings]
    back = taut_path((0.0, 0.0), (-40.0, 0.0), mirrored, [(-e, n) for e, n in centers])
    assert back == [(-e, n) for e, n in path]


def test_straightened_leaves_out_what_says_nothing():
    points = np.array([(0, 0), (0, 0), (1, 0), (2, 0), (2, 1), (2, 1), (2, 0.5), (2, 3)], dtype=float)
    assert straightened(points).tolist() == [[0, 0], [2, 0], [2, 1], [2, 0.5], [2, 3]]


def test_block_graph_of_slabs_has_no_diagonals(load_case):
    case = load_case("rand10")
    field = Field(parse_scene([case["inclusion"]], case["exclusions"], union=False), 0.0)
    graph = BlockGraph(field.slabs)
    assert all(step == 1.0 for ways in graph.neighbours for *_, step in ways)
