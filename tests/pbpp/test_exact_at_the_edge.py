"""Ends on edges and vertices and a rounding beside them, and slivers: the shortest path all the same, both ways the same."""

from collections import Counter
from importlib.util import find_spec
from math import inf

import numpy as np
import pytest
import shapely
from exact_reference import ExactReference
from field_check import verdict_of
from hunt_edges import check

import pbpp

# A ring that crosses itself, in UTM coordinates; the start stands on the edge from its western tip to the south-east.
CROSSED = [
    (501200.0, 4500100.0),
    (501000.0, 4500500.0),
    (500000.0, 4501100.0),
    (500800.0, 4500800.0),
    (501600.0, 4500100.0),
]
ON_THE_EDGE = (500005.6252542378, 4501096.624847458)  # 3.6e-10 m inside
BEHIND_THE_TIP = (501100.0, 4500900.0)
AROUND_THE_TIP_M = 1124.594106


@pytest.mark.parametrize("off_m", [0.0, 1e-9, -1e-9, 1e-8, -1e-8, 5e-8, -1e-7, -1e-6, -1e-3])
def test_an_end_beside_an_edge_sees_around_the_edges_tip(off_m):
    planner = pbpp.Planner([], [CROSSED])
    start = ON_THE_EDGE[0], ON_THE_EDGE[1] + off_m
    slack_m = 1e-6 + abs(off_m)
    for ends in ((start, BEHIND_THE_TIP), (BEHIND_THE_TIP, start)):
        path = planner.plan(*ends)
        assert path.length_m == pytest.approx(AROUND_THE_TIP_M, abs=slack_m)
        assert path.lower_bound_m == path.length_m


@pytest.mark.parametrize(
    "part", [0, *(pytest.param(part, marks=pytest.mark.campaign) for part in range(1, 4))]
)
def test_no_length_is_off_and_no_error_comes_one_way_only(part):
    counts = Counter()
    for seed in range(25 * part, 25 * (part + 1)):
        check(seed, counts, compiled=False)
    assert counts["path"] > 50


@pytest.mark.parametrize("seed", [304_791, 510_924, 508_853])
def test_ends_that_may_stand_on_several_sides(seed):
    # In an obstacle, as near to free space above as beside; on one edge of a corner of 9 degrees, 1e-9 m from the other; in the tip of a
    # wedge, where it is put to one side and was still within 1e-9 m of the other.
    counts = Counter()
    check(seed, counts, compiled=False)
    assert counts["path"] >= 1


@pytest.mark.skipif(find_spec("numba") is None, reason="the extra fast is not installed")
def test_the_compiled_search_takes_such_ends_as_the_plain_one_does():
    counts = Counter()
    for seed in range(200, 240):
        check(seed, counts, compiled=True)
    assert counts["path"] > 50


@pytest.mark.parametrize("aside_m", [0.0, 3e-10, -3e-10, 9e-10])
@pytest.mark.parametrize("along_m", [0.0, 5e-10, 2e-9, 1e-8, 1e-6, 1e-3])
@pytest.mark.parametrize("angle_deg", [0.0, 30.0, 45.0, 90.0, 89.9999])
def test_an_end_beside_a_corner_turns_around_it(along_m, aside_m, angle_deg):
    # The nearer the corner, the more a rounding beside the edge turns the way to it.
    angle_rad = np.radians(angle_deg)
    turn = np.array([[np.cos(angle_rad), np.sin(angle_rad)], [-np.sin(angle_rad), np.cos(angle_rad)]])
    wall = np.array([(0.0, 0.0), (-300.0, 0.0), (-300.0, -2.0), (0.0, -2.0)]) @ turn
    start = tuple(np.array([-along_m, -aside_m]) @ turn)
    goal = tuple(np.array([-250.0, -3.0]) @ turn)
    planner = pbpp.Planner([], [wall])
    expected = along_m + 2.0 + np.hypot(250.0, 1.0)
    for ends in ((start, goal), (goal, start)):
        assert planner.plan(*ends).length_m == pytest.approx(expected, rel=1e-9)


def test_an_end_in_a_wedge_too_narrow_to_stand_in_is_put_between_its_edges():
    wedge = (
        [(0.0, 0.0), (10.0, 0.0), (10.0, -5.0), (0.0, -5.0)],
        [(0.0, 0.0), (10.0, 1e-7), (10.0, 5.0), (0.0, 5.0)],
    )
    planner = pbpp.Planner([], list(wedge))
    for east in (9.999, 5.0, 1.0):
        for ends in (((east, east * 5e-9), (20.0, 0.0)), ((20.0, 0.0), (east, east * 5e-9))):
            assert planner.plan(*ends).length_m == pytest.approx(20.0 - east, rel=1e-9)


@pytest.mark.parametrize("upright", [False, True])
def test_an_end_in_a_closed_gap_has_no_way_in_either_direction(square, upright):
    boxes = np.array(
        [
            [(20, 40), (80, 40), (80, 50), (20, 50)],
            [(20, 50 + 5e-10), (80, 50 + 5e-10), (80, 60), (20, 60)],
        ]
    )
    inside, outside = np.array([50, 50 + 2e-10]), (10.0, 10.0)
    if upright:
        boxes, inside = boxes[:, :, ::-1], inside[::-1]
    planner = pbpp.Planner([square], list(boxes))
    assert verdict_of(planner, tuple(inside), outside)[0] == ("start" if upright else "none")
    assert verdict_of(planner, outside, tuple(inside))[0] == ("goal" if upright else "none")


@pytest.mark.parametrize(
    "name",
    [
        "spike_on_a_corner",  # its two feet, 1e-12 m apart, are one point of the boundary
        "tip_on_one_line",  # a needle whose edges lie on each other where vertices are taken together
        "tip_above_a_corner",
        "needle_on_one_line",  # thinner than what is taken as one line: it is put on the grid, and gone
        "bundle_of_needles",
        "needles_in_one_another",
        "corner_a_nanometre_aside",
        "turned_inside_out",  # by taking out repeated points
        "tips_on_the_grid",
        "crossed_by_joining",
        "turned_over_on_one_line",
    ],
)
def test_slivers_take_no_path_away(load_case, name):
    case = load_case("slivers")[name]
    square = [(0.0, 0.0), (20.0, 0.0), (20.0, 20.0), (0.0, 20.0)]
    planner = pbpp.Planner([square], case["exclusions"])
    reference = ExactReference(planner.free_space)
    fat = shapely.union_all(
        [shapely.make_valid(shapely.Polygon(ring)) for ring in case["exclusions"]]
    ).buffer(-1e-7)
    for query in case["queries"]:
        start, goal = tuple(query[:2]), tuple(query[2:])
        expected = reference.length(start, goal)
        assert expected < inf
        paths = [planner.plan(*ends) for ends in ((start, goal), (goal, start))]
        for path in paths:
            assert path.length_m == pytest.approx(expected, rel=1e-9)
            assert shapely.LineString(path.points).intersection(fat).is_empty
        assert planner.plan(start, goal, method="pbpp").length_m >= paths[0].length_m * (1.0 - 1e-9)
        # The block methods leave free space as it was.
        assert planner.plan(start, goal).length_m == paths[0].length_m


NEEDS_NUMBA = pytest.mark.skipif(find_spec("numba") is None, reason="the extra fast is not installed")
GAP_M = 6e-11
CLOSED_POCKETS = {
    "behind_an_upright_edge": (
        [(0, 0), (12, 0), (0, 12)],
        [(2, 1), (6, 1), (6, 6 - GAP_M), (3, 6 - GAP_M), (3, 11), (2, 11)],
        ((3, 0.5), (4, 7)),
    ),
    "behind_a_tip": (
        [(0, 0), (10, 0), (10, 5 + GAP_M), (0, 5 + GAP_M)],
        [(5, 5), (11, 4), (11, 3)],
        ((5, 1), (9, 4.8)),
    ),
}
FLIPS = [
    np.array(flip)
    for flip in ([[1, 0], [0, 1]], [[-1, 0], [0, 1]], [[1, 0], [0, -1]], [[0, 1], [1, 0]], [[0, -1], [1, 0]])
]


@pytest.mark.parametrize("compiled", [False, pytest.param(True, marks=NEEDS_NUMBA)])
@pytest.mark.parametrize("name", CLOSED_POCKETS)
@pytest.mark.parametrize("flip", FLIPS, ids=str)
def test_a_closed_gap_lets_nothing_through_from_either_side(name, flip, compiled):
    inclusion, exclusion, ends = (np.array(points, dtype=float) @ flip for points in CLOSED_POCKETS[name])
    planner = pbpp.Planner([inclusion], [exclusion], compiled=compiled)
    for start, goal in (ends, ends[::-1]):
        with pytest.raises(pbpp.NoPathError, match="no path"):
            planner.plan(start, goal)
