import re

import numpy as np
import pytest
from field_check import connected, fence
from random_fields import random_field
from shapely.geometry import Point, Polygon

import pbpp

GATE = [[(0, 40), (45, 40), (45, 60), (0, 60)], [(52, 40), (100, 40), (100, 60), (52, 60)]]


def test_a_gate_limits_the_clearance(square):
    way = pbpp.widest([square], GATE, (50, 10), (50, 90))
    assert 3.49 <= way.clearance_m <= 3.5
    assert way.limited_by == "gap"
    assert way.gap_m == pytest.approx(7.0, abs=1e-6)
    assert sorted(way.parts) == [("exclusion", 0), ("exclusion", 1)]
    assert sorted(way.points[:, 0].tolist()) == pytest.approx([45, 52])
    assert way.points[0, 1] == pytest.approx(way.points[1, 1], abs=1e-6)
    assert 40 <= way.points[0, 1] <= 60


def test_a_gap_between_an_obstacle_and_the_edge(square):
    bar = [(8, 40), (97, 40), (97, 60), (8, 60)]
    way = pbpp.Planner([square], [bar], clearance_m=30.0).widest((50, 10), (50, 90))
    assert 3.99 <= way.clearance_m <= 4.0
    assert sorted(way.parts) == [("exclusion", 0), ("inclusion", 0)]


def test_a_gap_from_corner_to_corner_is_measured_as_it_is(square):
    exclusions = [[(0, 30), (40, 30), (40, 40), (0, 40)], [(43, 44), (100, 44), (100, 60), (43, 60)]]
    way = pbpp.widest([square], exclusions, (10, 10), (10, 90))
    assert 2.49 <= way.clearance_m <= 2.5
    assert way.gap_m == pytest.approx(5.0, abs=1e-3)
    assert {tuple(np.round(point, 2)) for point in way.points.tolist()} == {(40, 40), (43, 44)}


@pytest.mark.parametrize(
    ("start", "goal", "end"), [((3, 10), (50, 20), "start"), ((50, 10), (97.5, 20), "goal")]
)
def test_an_end_near_the_fence_limits_the_clearance(square, start, goal, end):
    way = pbpp.widest([square], [], start, goal)
    assert way.limited_by == end
    assert way.parts == (("inclusion", 0),)
    assert way.clearance_m == pytest.approx(way.gap_m, abs=0.01)
    assert way.gap_m == pytest.approx(3.0 if end == "start" else 2.5)
    assert way.points[0].tolist() == list(start if end == "start" else goal)


def test_an_end_on_the_boundary_leaves_no_clearance(square):
    way = pbpp.widest([square], GATE, (0, 10), (50, 90))
    assert (way.clearance_m, way.limited_by) == (0.0, "start")


def test_within_a_union_its_inner_edges_bound_nothing(square):
    east = [(90, 40), (160, 40), (160, 60), (90, 60)]
    way = pbpp.widest([square, east], [], (20, 50), (150, 50), union=True)
    assert way.clearance_m == pytest.approx(10.0, abs=0.01)


def test_the_open_plane_has_no_narrowest_place():
    assert pbpp.widest([], [], (0, 0), (1, 1)).clearance_m == np.inf
    way = pbpp.widest([], GATE, (50, 10), (-500, 10))
    assert way.limited_by == "start"


def test_no_way_at_all(square):
    wall = [(-10, 40), (110, 40), (110, 60), (-10, 60)]
    with pytest.raises(pbpp.NoPathError, match="no path joins start and goal"):
        pbpp.widest([square], [wall], (50, 10), (50, 90))
    with pytest.raises(
        pbpp.StartBlockedError, match=r"the start .* is blocked: .* free space is 10\.000 m away"
    ):
        pbpp.widest([square], [wall], (50, 50), (50, 90))
    with pytest.raises(
        pbpp.GoalBlockedError, match=r"the goal .* is blocked: .* free space is 10\.000 m away"
    ):
        pbpp.widest([square], [wall], (50, 10), (50, 50))


def test_stopped_it_tells_what_is_proven(square):
    way = pbpp.widest([square], GATE, (50, 10), (50, 90), should_stop=lambda: True)
    assert way.clearance_m == 0.0
    assert way.limited_by == "gap"
    hugging = pbpp.widest([square], GATE, (44, 10), (44, 90), should_stop=lambda: True)
    assert hugging.clearance_m == 0.0


@pytest.mark.parametrize("east", [3.498, 3.5, 3.5012, 3.502, 3.505])
def test_a_gap_and_an_end_of_nearly_the_same_width(square, east):
    way = pbpp.widest([square], GATE, (east, 10), (50, 90))
    assert way.clearance_m == pytest.approx(min(east, 3.5), abs=0.01)
    assert way.limited_by in {"gap", "start"}


@pytest.mark.parametrize("seed", range(120))
def test_it_is_right_to_a_centimetre(seed):
    field = random_field(7_000 + seed)
    ends = field.start, field.goal
    try:
        way = pbpp.widest(field.inclusions, field.exclusions, *ends, union=field.union)
    except pbpp.PlanningError as refused:
        with pytest.raises(type(refused), match=re.escape(str(refused))):
            pbpp.plan_path(field.inclusions, field.exclusions, *ends, union=field.union)
        return
    included, excluded = fence(field)
    pbpp.plan_path(field.inclusions, field.exclusions, *ends, union=field.union, clearance_m=way.clearance_m)
    assert not connected(included, excluded, way.clearance_m + 0.01, *ends)
    lines = {("inclusion", i): Polygon(ring).exterior for i, ring in enumerate(field.inclusions)}
    lines |= {("exclusion", i): Polygon(ring).exterior for i, ring in enumerate(field.exclusions)}
    if way.limited_by == "gap":
        assert way.gap_m / 2 == pytest.approx(way.clearance_m, abs=0.015)
        for point, part in zip(way.points, way.parts, strict=True):
            assert lines[part].distance(Point(point)) < 1e-6
    else:
        assert way.gap_m == pytest.approx(way.clearance_m, abs=0.01)
        assert lines[way.parts[0]].distance(Point(way.points[1])) < 1e-6
