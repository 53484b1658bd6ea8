import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from random_fields import slanted
from shapely.geometry import LineString, Point, Polygon

import pbpp
from pbpp import clearance
from pbpp.clearance import ROUND_EXCESS_M, grow, shrink


def random_polygons(seed, count=40):
    rng = np.random.default_rng(seed)
    polygons = [Polygon(slanted(rng, 40)) for _ in range(count)]
    return np.array([one for one in polygons if one.is_valid], dtype=object)


@given(seed=st.integers(0, 2**32 - 1), clearance_m=st.floats(0.01, 8.0), rounded=st.booleans())
@settings(max_examples=60, deadline=None, derandomize=True, database=None)
def test_offsets_are_never_nearer_than_the_clearance(seed, clearance_m, rounded):
    polygons = random_polygons(seed)
    grown = grow(polygons, clearance_m, rounded=rounded)
    assert (shapely.distance(shapely.boundary(grown), polygons) >= clearance_m).all()
    assert shapely.covers(grown, polygons).all()
    for polygon in polygons[:5]:
        left = shrink(polygon, clearance_m, rounded=rounded)
        assert left.is_empty or left.distance(polygon.boundary) >= clearance_m


def test_geos_alone_comes_nearer_so_the_mending_is_needed():
    ring = [(17.93, 39.38), (8.25, 36.62), (10.07, 29.59), (11.3, 24.82)]
    shrunk = Polygon(ring).buffer(-1.0, join_style="mitre", mitre_limit=2.0)
    assert shrunk.distance(Polygon(ring).exterior) < 1.0 - 1e-7
    assert shrink(Polygon(ring), 1.0).distance(Polygon(ring).exterior) >= 1.0


def test_mitred_corners_end_at_the_limit():
    sharp = np.array([Polygon([(0, 0), (20, 1), (20, -1)])], dtype=object)
    (grown,) = grow(sharp, 1.0)
    assert 1.0 <= -grown.bounds[0] <= 2.0 + 1e-6
    right = np.array([shapely.box(0, 0, 10, 10)], dtype=object)
    assert grow(right, 1.0)[0].bounds == pytest.approx((-1, -1, 11, 11))
    assert grow(right, 1.0)[0].area == pytest.approx(144.0, abs=1e-6)


@pytest.mark.parametrize("clearance_m", [0.001, 0.5, 3.0, 40.0])
def test_round_corners_are_right_to_the_excess(clearance_m):
    (grown,) = grow(np.array([shapely.box(0, 0, 10, 10)], dtype=object), clearance_m, rounded=True)
    exact = shapely.box(0, 0, 10, 10).buffer(clearance_m, quad_segs=2000)
    assert grown.hausdorff_distance(exact) <= ROUND_EXCESS_M + 1e-4
    assert grown.buffer(1e-9).covers(exact)


def test_lines_are_grown_round_beside_areas():
    geometries = np.array([LineString([(0, 0), (10, 0)]), shapely.box(0, 0, 1, 1)], dtype=object)
    line, area = grow(geometries, 1.0)
    assert line.covers(LineString([(-0.999, 0), (10.999, 0)]))
    assert not line.covers(Point(-1.01, 0))
    assert area.bounds == pytest.approx((-1, -1, 2, 2))


def too_near(geometries, *_):
    return geometries.copy()


@pytest.mark.parametrize("rounded", [False, True])
def test_an_offset_that_stays_too_near_is_put_together_from_strips(monkeypatch, rounded):
    polygons = random_polygons(5)
    boxes = np.array([shapely.box(0, 0, 10, 10), LineString([(0, 0), (3, 4)]), Point(1, 1)], dtype=object)
    expected = grow(np.concatenate((polygons, boxes)), 1.0, rounded=True)
    inner = shrink(boxes[0], 1.0)
    monkeypatch.setattr(clearance, "_offset", too_near)
    found = grow(np.concatenate((polygons, boxes)), 1.0, rounded=rounded)
    assert (shapely.distance(shapely.boundary(found), [*polygons, *boxes]) >= 1.0).all()
    assert shapely.covers(found, [*polygons, *boxes]).all()
    excess_m = ROUND_EXCESS_M + 1e-3 if rounded else 0.5  # a square's corner stands off by a half-root of 2
    assert shapely.covers(shapely.buffer(expected, excess_m), found).all()
    assert shrink(boxes[0], 1.0, rounded=rounded).equals_exact(inner, 2.0 * ROUND_EXCESS_M, normalize=True)


def test_an_offset_that_stays_too_near_even_so_is_refused(monkeypatch):
    monkeypatch.setattr(clearance, "_offset", too_near)
    monkeypatch.setattr(clearance, "_in_strips", lambda geometry, *_: geometry)
    with pytest.raises(pbpp.InvalidGeometryError, match="expanded by 1 m"):
        grow(np.array([shapely.box(0, 0, 1, 1)], dtype=object), 1.0)
    with pytest.raises(pbpp.InvalidGeometryError, match="shrunk by 1 m"):
        shrink(shapely.box(0, 0, 9, 9), 1.0)


def test_a_gap_that_mitres_close_is_passed_with_round_corners(square):
    # Corner to corner the gap is 5 m wide, less than two mitres of 2.4 m and more than twice the clearance.
    exclusions = [[(0, 30), (40, 30), (40, 40), (0, 40)], [(43, 44), (100, 44), (100, 60), (43, 60)]]
    path = pbpp.plan_path([square], exclusions, (10, 10), (10, 90), clearance_m=2.4)
    line = LineString(path.points)
    assert min(line.distance(Polygon(one)) for one in exclusions) >= 2.4
    with pytest.raises(pbpp.NoPathError, match=r"2\.51 m"):
        pbpp.plan_path([square], exclusions, (10, 10), (10, 90), clearance_m=2.51)
