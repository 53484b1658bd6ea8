import gc
import subprocess
import sys

import numpy as np
import pytest
import shapely
from shapely.geometry import LineString, Point, Polygon

import pbpp

INSIDE, BELOW = np.array([50.0, 31.0]), np.array([50.0, 29.0])
BOX_WEST, BOX_EAST = np.array([10.0, 50.0]), np.array([90.0, 50.0])
BOX = [(30.0, 30.0), (70.0, 30.0), (70.0, 70.0), (30.0, 70.0)]


@pytest.mark.parametrize("clearance_m", [-1.0, np.nan, np.inf])
def test_a_clearance_is_a_length(square, clearance_m):
    with pytest.raises(pbpp.InvalidGeometryError, match="clearance"):
        pbpp.Planner([square], [], clearance_m=clearance_m)


def test_unknown_methods_and_partitions_are_refused(square):
    with pytest.raises(ValueError, match="partition"):
        pbpp.Planner([square], [], partition="triangles")
    with pytest.raises(ValueError, match="method"):
        pbpp.plan_path([square], [], (1, 1), (2, 2), method="best")


def test_a_path_carries_its_certificate(square):
    path = pbpp.plan_path([square], [BOX], (10, 50), (90, 50))
    assert path.points.tolist() == [[10, 50], [30, 70], [70, 70], [90, 50]] or path.points.tolist() == [
        [10, 50],
        [30, 30],
        [70, 30],
        [90, 50],
    ]
    assert path.length_m == path.lower_bound_m == pytest.approx(2 * np.hypot(20, 20) + 40)
    assert (path.method, path.blocks) == ("optimal", 4)
    assert path.expanded > 0
    assert path.sequence == ()


@pytest.mark.parametrize("method", ["pbpp", "pbpp-taut"])
@pytest.mark.parametrize("partition", [None, "blocks", "slabs"])
def test_block_methods_tell_their_blocks(square, method, partition):
    planner = pbpp.Planner([square], [BOX], partition=partition)
    path = planner.plan((10, 50), (90, 51), method=method)
    assert path.method == method
    assert path.blocks == (4 if partition == "slabs" else 8)
    assert len(path.sequence) >= 3
    assert path.lower_bound_m == pytest.approx(np.hypot(80, 1))
    assert path.length_m >= 2 * np.hypot(20, 20) + 40 - 1.0


def test_clearance_is_kept_everywhere(square):
    path = pbpp.plan_path([square], [BOX], (10, 50), (90, 50), clearance_m=5.0)
    line = LineString(path.points)
    assert line.distance(Polygon(BOX)) >= 5.0
    assert line.distance(Polygon(square).exterior) >= 5.0


def test_blocked_ends_carry_where_to_go_instead(square):
    planner = pbpp.Planner([square], [BOX], clearance_m=2.0)
    assert planner.clearance_m == 2.0
    with pytest.raises(pbpp.StartBlockedError, match="the start") as caught:
        planner.plan((33, 50), (90, 50))
    assert caught.value.nearest_free_m == pytest.approx((28.0, 50.0), abs=0.003)
    assert caught.value.distance_m == pytest.approx(5.0, abs=0.003)
    assert caught.value.point_m == (33.0, 50.0)
    assert caught.value.clearance_m == 2.0
    assert planner.plan(caught.value.nearest_free_m, (90, 50)).length_m > 0.0
    with pytest.raises(pbpp.GoalBlockedError, match="the goal"):
        planner.plan((10, 50), (120, 50))


def test_nothing_free_is_told(square):
    with pytest.raises(pbpp.StartBlockedError, match="no free space") as caught:
        pbpp.plan_path([square], [square], (50, 50), (60, 60))
    assert caught.value.nearest_free_m is None
    assert caught.value.distance_m == np.inf
    with pytest.raises(pbpp.StartBlockedError, match="there is no free space at a clearance of 60 m"):
        pbpp.plan_path([square], [], (50, 50), (60, 60), clearance_m=60.0)


def test_unreachable_is_told_without_a_search(square):
    wall = [(-10, 40), (110, 40), (110, 60), (-10, 60)]
    planner = pbpp.Planner([square], [wall])
    assert len(planner.free_space.geoms) == 2
    with pytest.raises(
        pbpp.NoPathError, match="no path joins start and goal at a clearance of 0 m"
    ) as caught:
        planner.plan((50, 10), (50, 90), should_stop=lambda: pytest.fail("there is nothing to search"))
    assert caught.value.clearance_m == 0.0


def test_all_errors_have_one_root():
    errors = (pbpp.InvalidGeometryError, pbpp.NoPathError, pbpp.StartBlockedError, pbpp.GoalBlockedError)
    assert all(
        issubclass(one, pbpp.PlanningError)
        for one in (*errors, pbpp.SearchStoppedError, pbpp.TooManyBlocksError)
    )


def test_inclusions_are_intersected_or_united(square):
    east = [(60, 40), (160, 40), (160, 60), (60, 60)]
    both = pbpp.Planner([square, east], [], union=True)
    assert both.plan((10, 50), (150, 50)).length_m == pytest.approx(140.0)
    common = pbpp.Planner([square, east], [])
    assert common.free_space.area == pytest.approx(800.0)
    with pytest.raises(
        pbpp.StartBlockedError,
        match=r"the start \(10\.000, 50\.000\) m is blocked: .* free space is 50\.000 m away",
    ):
        common.plan((10, 50), (70, 50))


def test_without_inclusions_the_plane_is_open():
    planner = pbpp.Planner([], [BOX], clearance_m=1.0)
    near = planner.plan((20, 50), (80, 50))
    assert near.length_m == pytest.approx(2 * np.hypot(9, 21) + 42, abs=1e-3)
    far = planner.plan((-5_000, 50), (9_000, 50))
    line = LineString(far.points)
    assert line.distance(Polygon(BOX)) >= 1.0
    assert far.length_m < 14_001.0
    assert planner.plan((20, 50), (80, 50)).length_m == pytest.approx(near.length_m)
    assert pbpp.plan_path([], [], (0, 0), (3, 4)).length_m == 5.0


def test_map_coordinates_keep_their_origin(square):
    shift = np.array([5e5, 4.6e6])
    planner = pbpp.Planner([np.array(square) + shift], [np.array(BOX) + shift], clearance_m=1.0)
    path = planner.plan(shift + BOX_WEST, shift + BOX_EAST)
    assert Polygon(np.array(square) + shift).covers(LineString(path.points))
    assert planner.free_space.bounds == pytest.approx((*(shift + 1), *(shift + 99)), abs=1e-6)
    with pytest.raises(pbpp.StartBlockedError, match=r"at a clearance of 1 m free space is 2\.00") as caught:
        planner.plan(shift + INSIDE, shift)
    assert caught.value.nearest_free_m == pytest.approx(tuple(shift + BELOW), abs=0.003)
    more = planner.with_exclusion(np.array([(5, 40), (25, 40), (25, 60), (5, 60)]) + shift)
    with pytest.raises(pbpp.StartBlockedError, match=r"at a clearance of 1 m free space is 6\.00"):
        more.plan(shift + BOX_WEST, shift + BOX_EAST)


@pytest.mark.parametrize("clearance_m", [0.0, 1.5])
def test_adding_and_removing_an_obstacle_is_as_from_scratch(square, clearance_m):
    boxes = [BOX, [(5, 40), (25, 40), (25, 45), (5, 45)], [(80, 10), (90, 10), (90, 60), (80, 60)]]
    planner = pbpp.Planner([square], boxes[:2], clearance_m=clearance_m)
    scratch = pbpp.Planner([square], boxes, clearance_m=clearance_m)
    added = planner.with_exclusion(boxes[2])
    query = (10, 30), (95, 50)
    assert added.plan(*query).points.tolist() == scratch.plan(*query).points.tolist()
    assert added.without_exclusion(2).plan(*query).points.tolist() == planner.plan(*query).points.tolist()
    assert len(planner.free_space.geoms[0].interiors) == 2
    with pytest.raises(IndexError, match="index 2 is out of bounds"):
        planner.without_exclusion(2)
    with pytest.raises(pbpp.InvalidGeometryError, match="needs at least three"):
        planner.with_exclusion([(0, 0)])


def test_a_stopped_search_gives_what_it_has_with_its_bound(load_case):
    case = load_case("rand100")
    planner = pbpp.Planner([case["inclusion"]], case["exclusions"])
    query = case["queries"][0]
    best = planner.plan(query[:2], query[2:])
    at_once = planner.plan(query[:2], query[2:], should_stop=lambda: True)
    assert at_once.lower_bound_m <= best.length_m < at_once.length_m
    assert planner.free_space.buffer(1e-7).covers(LineString(at_once.points))
    never = planner.plan(query[:2], query[2:], should_stop=lambda: False)
    assert never.points.tolist() == best.points.tolist()
    for method in ("pbpp", "pbpp-taut"):
        with pytest.raises(pbpp.SearchStoppedError, match="stopped before it had found any path"):
            planner.plan(query[:2], query[2:], method=method, should_stop=lambda: True)


def test_a_search_stopped_after_it_saw_the_goal_returns_that_path(load_case):
    case = load_case("rand1000")
    planner = pbpp.Planner([case["inclusion"]], case["exclusions"])
    gaps = set()
    for query in case["queries"][:6]:
        best = planner.plan(query[:2], query[2:])
        for asked in range(1, 40):
            answers = iter([False] * asked + [True] * 1000)
            path = planner.plan(query[:2], query[2:], should_stop=lambda answers=answers: next(answers))
            assert path.lower_bound_m <= best.length_m * (1 + 1e-12) <= path.length_m * (1 + 2e-12)
            gaps.add(path.lower_bound_m < path.length_m)
    assert gaps == {True, False}


def test_planning_loads_no_more_than_numpy_and_shapely():
    code = (
        "import sys, pbpp; pbpp.plan_path([[(0,0),(9,0),(9,9)]], [], (5,1), (8,2));"
        "print([m for m in ('matplotlib','scipy','numba','networkx') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_free_space_helps_to_find_free_points(square):
    free = pbpp.Planner([square], [BOX], clearance_m=2.0).free_space
    assert isinstance(free, shapely.MultiPolygon)
    assert free.distance(Point(50, 50)) == pytest.approx(22.0, abs=1e-6)


def test_building_leaves_garbage_collection_as_it_was(square, monkeypatch):
    seen = []
    monkeypatch.setattr("pbpp.planner.Field", lambda *_, **__: seen.append(gc.isenabled()) or 1 / 0)
    try:
        for switch in (gc.enable, gc.disable):
            switch()
            before = gc.isenabled()
            with pytest.raises(ZeroDivisionError):
                pbpp.Planner([square], [])
            assert gc.isenabled() == before
    finally:
        gc.enable()
    assert seen == [False, False]
