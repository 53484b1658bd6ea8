"""Rings that enclose next to nothing: walls all the same, kept clear of like any other fence."""

import math
from collections import Counter

import numpy as np
import pytest
import shapely
from field_check import check_field, check_safe, verdict_of
from hunt_walls import BACKWARDS, CLEAR_OF_WALLS_M, THICK_M, assert_shortest, check
from hypothesis import HealthCheck, Phase, assume, example, given, settings
from hypothesis import strategies as st
from random_fields import RandomField

import pbpp
from pbpp.clearance import MITRE_LIMIT, grow
from pbpp.geometry import parse_rings

SIZE_M = 20.0
SQUARE = [(0.0, 0.0), (SIZE_M, 0.0), (SIZE_M, SIZE_M), (0.0, SIZE_M)]
NEEDLE = [(0.0, 10.0), (1e-15, -10.0), (0.0, 0.0)]
"""Wide as a rounding: a mitred offset loses its southern end."""

ANGLES_RAD = st.sampled_from([0.0, math.pi / 2, math.pi / 4, 0.3]) | st.floats(0.0, math.pi)
WIDTHS_M = st.sampled_from([0.0, 1e-16, 1e-12, 1e-9, 1e-6, 1e-3])


@st.composite
def collapsed_rings(draw):
    """Draw points along a line, in any order, some twice, each beside it by at most a width."""
    angle_rad, width_m = draw(ANGLES_RAD), draw(WIDTHS_M)
    along_m = draw(
        st.lists(st.sampled_from([0.0, 1e-9, 3.0, 5.0, 7.5]) | st.floats(0, 8), min_size=3, max_size=7)
    )
    across_m = [draw(st.sampled_from([-0.5, 0.0, 0.5])) * width_m for _ in along_m]
    turn = np.array([[math.cos(angle_rad), math.sin(angle_rad)], [-math.sin(angle_rad), math.cos(angle_rad)]])
    middle = np.array([draw(st.floats(4, 16)), draw(st.floats(4, 16))])
    return np.column_stack((along_m, across_m)) @ turn + middle


@st.composite
def spiked_rings(draw):
    """Draw a quadrangle whose outline leaves and comes back on the same way, or nearly so."""
    west, south = draw(st.floats(3, 12)), draw(st.floats(3, 12))
    tip = np.array([west + draw(st.floats(-6, 9)), south + draw(st.floats(-6, 9))])
    beside = tip + draw(WIDTHS_M) * np.array([draw(st.floats(-1, 1)), draw(st.floats(-1, 1))])
    ring = [(west, south), (west + 3, south), (west + 3, south + 2), (west, south + 2)]
    at = draw(st.integers(0, 3))
    return np.array(
        [*ring[:at], ring[at], tip, *([beside] if draw(st.booleans()) else []), ring[at], *ring[at + 1 :]]
    )


RINGS = collapsed_rings() | spiked_rings()
CLEARANCES_M = st.sampled_from([0.01, 0.3, 1.0, 2.5]) | st.floats(0.001, 4.0)


def many(count):
    return settings(
        max_examples=count,
        deadline=None,
        derandomize=True,
        database=None,
        phases=[Phase.explicit, Phase.generate],  # shrinking takes minutes
        suppress_health_check=list(HealthCheck),
    )


@given(ring=RINGS, clearance_m=CLEARANCES_M, rounded=st.booleans())
@example(ring=np.array(NEEDLE), clearance_m=2.5, rounded=False)
@many(400)
def test_what_is_grown_keeps_the_clearance_from_every_point_of_the_ring(ring, clearance_m, rounded):
    (exclusion,) = parse_rings([ring], "exclusion")
    (grown,) = grow(np.array([exclusion], dtype=object), clearance_m, rounded=rounded)
    line = shapely.LineString([*ring, ring[0]]) if np.ptp(ring, axis=0).any() else shapely.Point(ring[0])
    assert grown.is_valid
    assert grown.covers(line)
    assert grown.boundary.distance(line) >= clearance_m
    reach_m = math.hypot(MITRE_LIMIT, 1.0) * clearance_m + 0.01  # a sharp corner is cut square at the limit
    corners = shapely.points(shapely.get_coordinates(grown))
    assert shapely.distance(corners, shapely.GeometryCollection([line, exclusion])).max() <= reach_m


FENCES = st.lists(RINGS, min_size=1, max_size=4)
MILLIMETRES = st.integers(0, int(SIZE_M * 1000)).map(lambda count: count / 1000.0)
PAIRS = st.tuples(MILLIMETRES, MILLIMETRES)


@given(rings=FENCES, clearance_m=CLEARANCES_M, start=PAIRS, goal=PAIRS)
@many(150)
def test_a_path_keeps_clear_of_collapsed_rings(rings, clearance_m, start, goal):
    check_field(RandomField([SQUARE], rings, clearance_m, False, start, goal))


SLIVER = [  # 1e-12 m thick
    (5.524881182133594, 6.462439567453723),
    (5.763115790034334, 6.462439567453223),
    (5.763115790034334, 6.462439567454223),
    (9.024881182133594, 6.462439567454223),
]
FLAT = [  # 1e-12 m thick; its hole in free space is a line, all of whose points have one north
    (7.0, 3.9999999999995),
    (9.0, 3.9999999999995),
    (4.000000001, 4.0000000000005),
    (4.0, 4.0000000000005),
    (4.0, 3.9999999999995),
    (9.0, 3.9999999999995),
    (7.0, 3.9999999999995),
]
TRIANGLE = [(12, 12), (15, 12), (17, 12.5), (15, 12), (15, 14), (12, 14)]


@given(rings=FENCES, start=PAIRS, goal=PAIRS)
@example(rings=[np.array(TRIANGLE)], start=(12.888, 12.888), goal=(8.487, 14.776))
@example(rings=[np.array(SLIVER), np.array(NEEDLE)], start=(8.807, 0.059), goal=(4.508, 18.728))
@example(rings=[np.array(FLAT)], start=(4.394, 0.0), goal=(4.394, 14.495))
@many(250)
def test_without_a_clearance_they_may_be_touched(rings, start, goal):
    lines = shapely.MultiLineString([[*ring, ring[0]] for ring in rings])
    # On a wall without width no one can say which side of it an end is on.
    assume(min(lines.distance(shapely.Point(end)) for end in (start, goal)) > CLEAR_OF_WALLS_M)
    planner = pbpp.Planner([SQUARE], rings)
    verdict, path = verdict_of(planner, start, goal)
    assert verdict_of(planner, goal, start)[0] in BACKWARDS[verdict]
    if verdict == "path":
        check_safe(path, RandomField([SQUARE], rings, 0.0, False, start, goal))
        assert verdict_of(planner, start, goal, "pbpp")[1].length_m >= path.length_m * (1.0 - 1e-9)
        assert_shortest(planner.free_space, rings, (start, goal), path.length_m)
        clear, other = verdict_of(pbpp.Planner([SQUARE], rings, clearance_m=1e-3), start, goal)
        assert clear != "path" or other.length_m >= path.length_m - 1e-6


@given(rings=FENCES, clearance_m=st.just(0.0) | CLEARANCES_M, start=PAIRS, goal=PAIRS)
@many(100)
def test_they_are_kept_clear_of_far_from_the_origin_too(rings, clearance_m, start, goal):
    shift = np.array((5e5, 4.6e6))
    area, *exclusions = [np.asarray(ring) + shift for ring in (SQUARE, *rings)]
    ends = [np.array(end) + shift for end in (start, goal)]
    planner = pbpp.Planner([area], exclusions, clearance_m=clearance_m)
    verdict, found = verdict_of(planner, *ends)
    if verdict == "path":
        line = shapely.LineString(found.points - shift)
        for ring in exclusions:
            there = ring - shift
            assert line.distance(shapely.MultiPoint(there)) >= clearance_m - 1e-7
            assert clearance_m == 0.0 or line.distance(shapely.LineString(there)) >= clearance_m - 1e-7


@pytest.mark.parametrize("count", [3, 4, 5])
def test_a_ring_of_one_point_is_a_post(square, count):
    post = [(50.0, 50.0)] * count
    assert pbpp.plan_path([square], [post], (10, 50), (90, 50)).length_m == pytest.approx(80.0)
    path = pbpp.plan_path([square], [post], (10, 50), (90, 50), clearance_m=2.0)
    assert shapely.LineString(path.points).distance(shapely.Point(50, 50)) >= 2.0
    assert path.length_m < 80.2


@pytest.mark.parametrize("seed", [55, 241, 1149, 1456, 1843])
def test_walls_take_no_way_away(seed):
    # A corner said twice in a wall that two rings have in common; slivers that were turned inside out where vertices are put on one line.
    counts = Counter()
    check(seed, counts)
    assert counts


@pytest.mark.parametrize(
    "part", [0, *(pytest.param(part, marks=pytest.mark.campaign) for part in range(1, 4))]
)
def test_no_path_leads_through_a_wall(part):
    counts = Counter()
    for seed in range(60 * part, 60 * (part + 1)):
        check(seed, counts)
    assert counts["path"] + counts["narrow path"] > 50


@pytest.mark.parametrize("width_m", [0.0, 1e-12, 1e-9, THICK_M])
@pytest.mark.parametrize("clearance_m", [0.0, 0.01])
@pytest.mark.parametrize("tilt_m", [0.0, 3.0])
def test_what_has_no_width_parts_a_field_where_there_is_a_clearance(width_m, clearance_m, tilt_m):
    across = [(-1.0, 8.0), (21.0, 8.0 + tilt_m), (21.0, 8.0 + tilt_m + width_m), (-1.0, 8.0 + width_m)]
    verdict, path = verdict_of(pbpp.Planner([SQUARE], [across], clearance_m=clearance_m), (10, 2), (10, 18))
    if clearance_m > 0.0 or width_m >= THICK_M:
        assert verdict == "none"
    elif width_m == 0.0:
        assert path.length_m == pytest.approx(16.0)
