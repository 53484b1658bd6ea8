import numpy as np
import pytest
import shapely
from shapely.geometry import MultiPolygon, Point, Polygon

import pbpp
from pbpp.geometry import parse_point, parse_rings

BOW_TIE = [(0, 0), (10, 10), (10, 0), (0, 10)]
PENTAGRAM = [(np.sin(a), np.cos(a)) for a in np.arange(5) * 4 * np.pi / 5]


@pytest.mark.parametrize(
    "ring", [[(0, 0), (1, 1)], [1, 2, 3], [(0, 0, 0)] * 4, [("a", "b")] * 3, [(0, 0), (1,), (2, 2)], []]
)
def test_a_ring_needs_three_pairs_of_numbers(square, ring):
    with pytest.raises(pbpp.InvalidGeometryError, match="exclusion 1") as caught:
        pbpp.Planner([square], [square, ring])
    assert caught.value.part == ("exclusion", 1)


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_a_ring_that_is_not_finite_is_named(square, value):
    bad = [(0, 0), (1, value), (2, 2)]
    with pytest.raises(pbpp.InvalidGeometryError, match="inclusion 1 has a coordinate"):
        pbpp.Planner([square, bad], [])


@pytest.mark.parametrize(
    "polygon",
    [Polygon(), shapely.from_wkb(Polygon([(0, 0), (1, 9), (2, 2)]).wkb.replace(b"\x22@", b"\xf0\x7f"))],
)
def test_a_polygon_must_enclose_something_finite(square, polygon):
    with pytest.raises(pbpp.InvalidGeometryError, match="exclusion 0 is empty or not finite"):
        pbpp.Planner([square], [polygon])


@pytest.mark.parametrize("point", [(1, 2, 3), "ab", (np.nan, 0), None, 5.0, ("x", "y")])
def test_a_point_is_a_pair_of_finite_numbers(point):
    with pytest.raises(pbpp.InvalidGeometryError, match="the start is not a pair of"):
        parse_point(point, "start")


def test_rings_may_be_closed_open_arrays_or_polygons(square):
    forms = [square, [*square, square[0]], np.array(square), Polygon(square), MultiPolygon([Polygon(square)])]
    for form in forms:
        assert pbpp.plan_path([form], [], (10, 10), (90, 90)).length_m == pytest.approx(80 * np.sqrt(2))


def test_a_polygon_may_bring_holes(square):
    ring_road = Polygon(square, [[(20, 20), (80, 20), (80, 80), (20, 80)]])
    inside = pbpp.Planner([square], [ring_road])
    assert inside.plan((30, 30), (70, 70)).length_m == pytest.approx(40 * np.sqrt(2))
    around = pbpp.Planner([ring_road], [])
    assert around.plan((10, 50), (90, 50)).length_m == pytest.approx(60 + 2 * np.hypot(10, 30))


def test_a_self_crossing_exclusion_excludes_what_it_encloses():
    (bow_tie,) = parse_rings([BOW_TIE], "exclusion")
    assert shapely.covers(bow_tie, Point(9, 5))
    assert shapely.covers(bow_tie, Point(1, 5))
    (star,) = parse_rings([PENTAGRAM], "exclusion")
    assert shapely.covers(star, Point(0, 0))


def test_a_self_crossing_inclusion_includes_what_it_encloses_an_odd_number_of_times():
    (star,) = parse_rings([PENTAGRAM], "inclusion")
    assert not shapely.covers(star, Point(0, 0))
    assert shapely.covers(star, Point(0, 0.9))
    with pytest.raises(pbpp.StartBlockedError, match=r"at a clearance of 0 m free space is 30\.9"):
        pbpp.plan_path([np.array(PENTAGRAM) * 100], [], (0, 0), (0, 90))


def test_a_ring_without_area_is_a_wall_once_there_is_a_clearance(square):
    wall = [(50, 20), (50, 80), (50, 50)]
    free = pbpp.plan_path([square], [wall], (10, 50), (90, 50))
    assert free.length_m == pytest.approx(80.0)
    clear = pbpp.plan_path([square], [wall], (10, 50), (90, 50), clearance_m=1.0)
    assert clear.length_m > 80.0
    assert shapely.LineString(clear.points).distance(shapely.LineString(wall)) >= 1.0
    assert clear.length_m < 2 * np.hypot(40, 31) + 0.1


def test_an_inclusion_without_area_is_refused_unless_others_are_united_with_it(square):
    line = [(0, 0), (10, 10), (20, 20)]
    for inclusions, union in [([line], False), ([square, line], False), ([line], True)]:
        with pytest.raises(pbpp.InvalidGeometryError, match="encloses no area"):
            pbpp.Planner(inclusions, [], union=union)
    assert pbpp.plan_path([square, line], [], (1, 2), (3, 4), union=True).length_m == pytest.approx(
        np.sqrt(8)
    )


def test_a_slit_in_an_inclusion_is_a_wall_once_there_is_a_clearance():
    slit = [(0, 0), (50, 0), (50, 50), (50, 0), (100, 0), (100, 100), (0, 100)]
    assert pbpp.plan_path([slit], [], (10, 20), (90, 20)).length_m == pytest.approx(80.0)
    path = pbpp.plan_path([slit], [], (10, 20), (90, 20), clearance_m=2.0)
    assert shapely.LineString(path.points).distance(shapely.LineString([(50, 0), (50, 50)])) >= 2.0


def test_circles_are_enclosed_or_filled():
    circle = Point(3, 4).buffer(5.0, quad_segs=256)
    outer = Polygon(pbpp.circle_ring((3, 4), 5.0, segments=12))
    inner = Polygon(pbpp.circle_ring((3, 4), 5.0, outer=False, segments=12))
    assert outer.covers(circle)
    assert outer.exterior.distance(Point(3, 4)) >= 5.0
    assert inner.exterior.hausdorff_distance(Point(3, 4)) <= 5.0 + 1e-12
    assert inner.area < circle.area < outer.area
