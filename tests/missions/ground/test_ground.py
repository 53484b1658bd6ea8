"""The fence laid out in the plane, against brute force on Earth."""

from __future__ import annotations

import math
import re
from itertools import pairwise

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from shapely import LineString, Point
from strategies import GEOD, away, offset

from missions.errors import FenceError, SituationError
from missions.fence import CircleZone, Fence, PolygonZone, ZoneKind
from missions.geo import LatLon, rounded, wrap_lon_deg
from missions.ground.frame import LocalFrame
from missions.ground.ground import Ground, check_ground, lay_out

HOME = LatLon(40.071374, -105.22993)
FRAME = LocalFrame(HOME)
IN, OUT = ZoneKind.INCLUSION, ZoneKind.EXCLUSION


def polygon(kind: ZoneKind, *east_north_m: tuple[float, float], origin: LatLon = HOME) -> PolygonZone:
    return PolygonZone(kind, tuple(offset(origin, *point) for point in east_north_m))


def square(kind: ZoneKind, west_m: float, south_m: float, size_m: float) -> PolygonZone:
    east_m, north_m = west_m + size_m, south_m + size_m
    return polygon(kind, (west_m, south_m), (east_m, south_m), (east_m, north_m), (west_m, north_m))


def ground(*zones: PolygonZone | CircleZone, **options) -> Ground:
    return lay_out(Fence(zones), FRAME, **options)


def is_allowed(where: Ground, east_m: float, north_m: float) -> bool:
    return where.allowed.covers(Point(where.frame.to_local(offset(HOME, east_m, north_m))))


def autopilot_distance_m(a: LatLon, b: LatLon) -> float:
    """Distance as ArduPilot's Location::get_distance has it: flat, the longitude shortened at the mean latitude."""
    shrink = math.cos(math.radians((a.lat_deg + b.lat_deg) / 2))
    return 1.113195e5 * math.hypot(b.lat_deg - a.lat_deg, wrap_lon_deg(b.lon_deg - a.lon_deg) * shrink)


def place_at_autopilot_distance(centre: LatLon, bearing_deg: float, radius_m: float) -> LatLon:
    """Find the place at a bearing that the autopilot takes for so far away, by bisection."""
    low_m, high_m = 0.9 * radius_m, 1.1 * radius_m
    for _ in range(50):
        middle_m = (low_m + high_m) / 2
        if autopilot_distance_m(centre, away(centre, bearing_deg, middle_m)) < radius_m:
            low_m = middle_m
        else:
            high_m = middle_m
    return away(centre, bearing_deg, low_m)


@given(
    st.floats(-84.9, 84.9),
    st.floats(-180, 180),
    st.floats(0.5, 5000),
    st.lists(st.floats(0, 360), min_size=20, max_size=20),
    st.sampled_from(ZoneKind),
)
def test_circles_err_to_the_safe_side(
    lat_deg: float, lon_deg: float, radius_m: float, bearings: list[float], kind: ZoneKind
) -> None:
    """By the true metre and by the autopilot's, and never by much."""
    centre = rounded(LatLon(lat_deg, lon_deg))
    where = lay_out(Fence((CircleZone(kind, centre, radius_m),)), LocalFrame(centre))
    area = where.barriers[0].area
    for bearing in bearings:
        for on_circle in (
            away(centre, bearing, radius_m),
            place_at_autopilot_distance(centre, bearing, radius_m),
        ):
            point = Point(where.frame.to_local(on_circle))
            if kind is OUT:
                assert area.covers(point)
            else:
                assert not area.covers(point) or area.exterior.distance(point) < 1e-6
            assert area.exterior.distance(point) < 0.15 + 0.008 * radius_m


crossing_rings = st.lists(st.tuples(st.floats(-100, 100), st.floats(-100, 100)), min_size=3, max_size=9)


def brute_even_odd(ring: tuple[LatLon, ...], place: LatLon) -> bool:
    """Return whether a ray to the east crosses the ring an odd number of times, in latitude and longitude as the autopilot tests."""
    inside = False
    for a, b in pairwise([*ring, ring[0]]):
        if (a.lat_deg > place.lat_deg) != (b.lat_deg > place.lat_deg):
            share = (place.lat_deg - a.lat_deg) / (b.lat_deg - a.lat_deg)
            if place.lon_deg < a.lon_deg + share * (b.lon_deg - a.lon_deg):
                inside = not inside
    return inside


@given(
    crossing_rings,
    st.lists(st.tuples(st.floats(-110, 110), st.floats(-110, 110)), min_size=30, max_size=30),
    st.sampled_from(ZoneKind),
)
def test_self_crossing_rings_are_read_as_the_autopilot_tests_them(
    corners: list[tuple[float, float]], probes: list[tuple[float, float]], kind: ZoneKind
) -> None:
    ring = tuple(rounded(offset(HOME, *corner)) for corner in corners)
    try:
        where = lay_out(Fence((PolygonZone(kind, ring),)), FRAME)
    except FenceError:  # no area at all: no probe is inside
        assert kind is IN
        assert not any(brute_even_odd(ring, offset(HOME, *probe)) for probe in probes)
        return
    area = where.barriers[0].area
    lines = LineString(FRAME.to_local_array([*ring, ring[0]]))
    for probe in probes:
        place = offset(HOME, *probe)
        point = Point(FRAME.to_local(place))
        if lines.distance(point) > 0.01:
            assert area.covers(point) == brute_even_odd(ring, place)
    if not LineString(lines).is_simple:
        assert len(where.warnings) == 1


def test_a_pentagram_has_a_hole_and_a_warning() -> None:
    points = [(100 * math.sin(0.8 * math.pi * i), 100 * math.cos(0.8 * math.pi * i)) for i in range(5)]
    where = ground(polygon(OUT, *points))
    assert is_allowed(where, 0, 0)
    assert not is_allowed(where, 0, 90)
    assert where.warnings == (
        "exclusion polygon 1 crosses or touches itself; its inside is found by the even-odd rule, as on the autopilot",
    )


@pytest.mark.parametrize(
    "corners",
    [
        [(0, 0), (10, 10), (20, 20)],
        [(0, 0), (30, 0), (10, 0), (20, 0)],
        [(0, 0), (0, 0), (10, 5)],
        [(5, 5), (5, 5), (5, 5)],
    ],
)
def test_exclusions_without_area_stay_walls(corners: list[tuple[float, float]]) -> None:
    exclusion = polygon(OUT, *corners)
    where = ground(square(IN, -100, -100, 200), exclusion)
    for place in exclusion.vertices:
        point = Point(FRAME.to_local(place))
        assert where.clearance_m(point) == pytest.approx(0, abs=1e-3)
        far = Point(point.x, point.y - 50)
        assert where.clearance_m(far) <= far.distance(point) + 1e-3
    through = LineString([FRAME.to_local(offset(HOME, 10, -5)), FRAME.to_local(offset(HOME, 10, 15))])
    if corners != [(5, 5)] * 3:
        assert where.clearance_m(through) == 0
    assert (
        any("exclusion polygon 1" in warning for warning in where.warnings) or where.barriers[1].area.area > 0
    )


def test_an_inclusion_without_area_is_refused() -> None:
    with pytest.raises(
        FenceError, match="inclusion polygon 2 has no area: there is no allowed area"
    ) as caught:
        ground(square(IN, 0, 0, 50), polygon(IN, (0, 0), (0, 0), (10, 5)))
    assert caught.value.details["zone"] == "inclusion polygon 2"


def test_inclusions_are_met_by_default_and_joined_by_union() -> None:
    zones = (square(IN, -50, -50, 60), square(IN, -10, -10, 60))
    met, joined = ground(*zones), ground(*zones, union=True)
    for east_m, north_m, in_both, in_either in [(0, 0, True, True), (-40, -40, False, True), (40, 40, False, True), (40, -40, False, False)]:  # fmt: skip
        assert is_allowed(met, east_m, north_m) == in_both
        assert is_allowed(joined, east_m, north_m) == in_either
    middle = Point(FRAME.to_local(HOME))
    assert met.clearance_m(middle) == pytest.approx(10, abs=1e-3)
    assert joined.clearance_m(middle) == pytest.approx(math.hypot(10, 10), abs=1e-3)


def test_inclusions_that_overlap_and_also_touch() -> None:
    """What they share besides area, a line, is no ground."""
    lat_deg, lon_deg = 40.0, -105.0

    def zone(
        *corners: tuple[int, int],
    ) -> PolygonZone:  # on a grid of degE7, so that shared edges are shared exactly
        return PolygonZone(
            IN, tuple(LatLon(lat_deg + north * 1e-5, lon_deg + east * 1e-5) for east, north in corners)
        )

    lower = zone((0, 0), (30, 0), (30, 10), (20, 10), (20, 5), (10, 5), (10, 10), (0, 10))
    upper = zone((20, 10), (30, 10), (30, 20), (5, 20), (5, 8), (8, 8), (8, 15), (20, 15))
    where = lay_out(Fence((lower, upper)), LocalFrame(LatLon(lat_deg, lon_deg)))
    inside = Point(where.frame.to_local(LatLon(lat_deg + 9e-5, lon_deg + 6.5e-5)))
    touching = Point(where.frame.to_local(LatLon(lat_deg + 10e-5, lon_deg + 25e-5)))
    assert where.clearance_m(inside) > 0.5
    assert where.clearance_m(touching) == 0
    assert len(where.barriers) == 2


def test_inclusions_that_do_not_meet_leave_no_ground() -> None:
    where = ground(square(IN, 0, 0, 10), square(IN, 50, 50, 10))
    assert where.allowed.is_empty
    assert where.clearance_m(Point(5, 5)) == 0


def test_the_nearest_barrier_is_named_with_its_distance() -> None:
    where = ground(
        square(IN, -100, -100, 200), square(OUT, 20, -5, 10), CircleZone(OUT, offset(HOME, -30, 0), 5)
    )
    for (east_m, north_m), name, distance_m in [
        ((0, 0), "exclusion polygon 1", 20),
        ((-20, 0), "exclusion circle 1", 5),
        ((0, 97), "inclusion polygon 1", 3),
    ]:
        barrier, found_m = where.nearest(Point(FRAME.to_local(offset(HOME, east_m, north_m))))
        assert barrier is not None
        assert barrier.name == name
        assert found_m == pytest.approx(distance_m, abs=0.12)
    nothing, far_m = lay_out(Fence(), FRAME, around=[HOME]).nearest(Point(0, 0))
    assert nothing is None
    assert far_m == math.inf


def test_under_union_an_edge_inside_another_inclusion_is_no_edge() -> None:
    where = ground(square(IN, -50, -50, 60), square(IN, -10, -50, 60), square(IN, -20, -20, 5), union=True)
    barrier, distance_m = where.nearest(Point(FRAME.to_local(offset(HOME, 8, 0))))
    assert barrier is not None
    assert barrier.name in ("inclusion polygon 1", "inclusion polygon 2")
    assert distance_m == pytest.approx(10, abs=1e-3)
    assert where.distance_m(where.barriers[2], Point(0, 0)) == math.inf


def test_what_forbids_a_point() -> None:
    zones = (square(IN, -50, -50, 60), square(IN, -10, -10, 60), square(OUT, 0, 0, 5))

    def names(where: Ground, east_m: float, north_m: float) -> list[str]:
        point = Point(FRAME.to_local(offset(HOME, east_m, north_m)))
        return [barrier.name for barrier in where.forbidding(point)]

    met, joined = ground(*zones), ground(*zones, union=True)
    assert names(met, 2, 2) == ["exclusion polygon 1"]
    assert names(met, -5, -5) == []
    assert names(met, -40, -40) == ["inclusion polygon 2"]
    assert names(met, 90, 90) == ["inclusion polygon 1", "inclusion polygon 2"]
    assert names(joined, -40, -40) == []
    assert names(joined, 90, 90) == ["inclusion polygon 1", "inclusion polygon 2"]


def test_an_inclusion_that_crosses_itself_holds_both_its_lobes() -> None:
    where = ground(polygon(IN, (-50, -50), (50, 50), (50, -50), (-50, 50)))
    for east_m, north_m, allowed in [(-40, 0, True), (40, 0, True), (0, 40, False), (0, -40, False)]:
        assert is_allowed(where, east_m, north_m) == allowed
    assert len(where.warnings) == 1


def test_exclusions_alone_leave_open_ground_around() -> None:
    where = ground(square(OUT, 0, 0, 10), around=[offset(HOME, 300, 0)])
    assert is_allowed(where, 700, 0)
    assert is_allowed(where, -300, -300)
    far = Point(FRAME.to_local(offset(HOME, 300, 0)))
    assert where.clearance_m(far) == pytest.approx(290, abs=0.01)
    edge_of_bounds = Point(where.bounds.exterior.coords[0])
    assert where.clearance_m(edge_of_bounds) > 100


def test_no_zones_at_all_are_open_ground() -> None:
    where = lay_out(Fence(), FRAME, around=[HOME])
    assert where.clearance_m(Point(0, 0)) == math.inf


def test_the_home_circle_is_met_with_inclusions() -> None:
    where = ground(square(IN, -100, -100, 200), home=HOME, home_radius_m=50)
    assert where.barriers[-1].name == "home circle (FENCE_RADIUS 50 m)"
    assert is_allowed(where, 30, 30)
    assert not is_allowed(where, 49.9, 10)
    assert not is_allowed(where, 60, 0)
    alone = ground(home=HOME, home_radius_m=50)
    assert is_allowed(alone, 0, 49)
    assert not is_allowed(alone, 0, 51)


def test_the_home_circle_limits_even_the_union() -> None:
    zones = (square(IN, -100, -20, 90), square(IN, -20, -20, 90), square(IN, 500, 500, 50))
    where = ground(*zones, union=True, home=HOME, home_radius_m=50)
    for east_m, north_m, allowed in [(0, 0, True), (-40, 0, True), (40, 20, True), (60, 0, False), (-60, 0, False), (520, 520, False), (0, -30, False)]:  # fmt: skip
        assert is_allowed(where, east_m, north_m) == allowed
    names = [barrier.name for barrier in where.forbidding(Point(FRAME.to_local(offset(HOME, 65, 65))))]
    assert any("home circle (FENCE_RADIUS 50 m)" in name for name in names)
    assert where.clearance_m(Point(FRAME.to_local(offset(HOME, 40, 0)))) == pytest.approx(10, abs=0.2)


def test_a_union_that_no_inclusion_brings_within_the_home_circle_is_refused() -> None:
    with pytest.raises(FenceError, match=r"no inclusion overlaps the home circle \(FENCE_RADIUS 50 m\)"):
        ground(square(IN, 500, 500, 50), square(OUT, 0, 0, 10), union=True, home=HOME, home_radius_m=50)
    alone = ground(square(OUT, 0, 0, 10), union=True, home=HOME, home_radius_m=50)
    assert not is_allowed(alone, 60, 0)
    assert is_allowed(alone, -40, 0)


def test_inclusions_that_overlap_leave_their_intersection_and_that_is_said() -> None:
    """As two areas drawn over one another in a ground station, for one to drive in."""
    areas = square(IN, 0, 0, 10), square(IN, 8, 0, 10)
    both = ground(*areas)
    told = (
        "the autopilot allows only the intersection of all inclusions: draw the area as one inclusion polygon "
        "(pbpp fence merge makes it)"
    )
    assert both.warnings == (f"the fence has 2 inclusions; {told}",)
    common, first, outside = (Point(both.frame.to_local(offset(HOME, east_m, 5))) for east_m in (9, 4, 40))
    assert both.is_in_some_inclusions_only(first)
    assert not both.is_in_some_inclusions_only(common)
    assert not both.is_in_some_inclusions_only(outside)
    union = ground(*areas, union=True)
    assert union.warnings == ()
    assert not union.is_in_some_inclusions_only(first)


def test_one_inclusion_and_the_home_circle_are_not_two_drawn_areas() -> None:
    # Nobody can draw the home circle and a polygon as one: what lies in one of them only hears nothing of it.
    one = ground(square(IN, 0, 0, 10), home=HOME, home_radius_m=50)
    assert one.warnings == ()
    beside = Point(one.frame.to_local(offset(HOME, 30, 0)))
    assert not is_allowed(one, 30, 0)
    assert not one.is_in_some_inclusions_only(beside)
    with pytest.raises(FenceError, match="no area in common; set home inside the fence, or a larger radius"):
        check_ground(ground(square(IN, 500, 0, 10), home=HOME, home_radius_m=50))
    with pytest.raises(FenceError, match="no area in common; the autopilot allows only the intersection"):
        check_ground(ground(square(IN, -40, 0, 10), square(IN, 40, 0, 10), home=HOME, home_radius_m=90))


def test_a_fence_that_leaves_no_ground_is_refused() -> None:
    check_ground(ground(square(IN, 0, 0, 10), square(OUT, 0, 0, 9)))
    with pytest.raises(
        FenceError,
        match=r"^inclusion polygon 1 and inclusion polygon 2 have no area in common; the autopilot allows only the intersection",
    ):
        check_ground(ground(square(IN, 0, 0, 10), square(IN, 50, 50, 10)))
    with pytest.raises(FenceError, match=r"^the exclusions cover all of inclusion polygon 1$"):
        check_ground(ground(square(IN, 0, 0, 10), square(OUT, -5, -5, 20)))


def test_an_enforced_home_circle_wants_home() -> None:
    with pytest.raises(SituationError, match=r"FENCE_RADIUS 50 m around home, but home is unknown") as caught:
        ground(square(IN, -100, -100, 200), home_radius_m=50)
    assert caught.value.details["fence_radius_m"] == 50


@pytest.mark.parametrize("lat_deg", [0.0, 40.0, -61.0, 84.0])
def test_long_fence_lines_are_straight_as_the_autopilot_has_them(lat_deg: float) -> None:
    """The autopilot's line between two vertices is straight in latitude and longitude: 4 km bow by decimetres."""
    centre = LatLon(lat_deg, 179.99)
    ring = [
        rounded(offset(centre, east_m, north_m))
        for east_m, north_m in [(-2000, 0), (2000, 100), (2000, 500), (-2000, 400)]
    ]
    where = lay_out(Fence((PolygonZone(OUT, tuple(ring)),)), LocalFrame(centre))
    for a, b in pairwise([*ring, ring[0]]):
        for share in (0.1, 0.37, 0.5, 0.81):
            place = LatLon(
                a.lat_deg + share * (b.lat_deg - a.lat_deg),
                a.lon_deg + share * wrap_lon_deg(b.lon_deg - a.lon_deg),
            )
            assert where.barriers[0].area.boundary.distance(Point(where.frame.to_local(place))) < 1e-3


def test_geod_and_the_local_offset_agree() -> None:
    """The helper above is right itself."""
    there = offset(HOME, 30, 40)
    assert GEOD.inv(HOME.lon_deg, HOME.lat_deg, there.lon_deg, there.lat_deg)[2] == pytest.approx(50)


@given(st.lists(st.floats(-2e-4, 2e-4), min_size=3, max_size=7), st.sampled_from([0.0, -105.22993]))
@example([9e-5, -9e-5, 0.0], 0.0)
@example([9.04e-05, 0.0001809, 0.0], -105.22993)
@settings(max_examples=200)
def test_an_exclusion_without_area_is_a_wall_to_its_ends(norths_deg: list[float], east_deg: float) -> None:
    """Corners on one line, in any order: the line doubles back."""
    origin = LatLon(0.0, east_deg)
    corners = [LatLon(north_deg, east_deg) for north_deg in norths_deg]
    frame = LocalFrame(origin)
    laid = lay_out(Fence((PolygonZone(OUT, tuple(corners)),)), frame)
    assert laid.warnings == ("exclusion polygon 1 has no area",)
    (wall,) = laid.areas(OUT)
    for corner in corners:
        assert wall.distance(Point(frame.to_local(corner))) <= 1e-6
    assert wall.buffer(1e-6).covers(LineString([frame.to_local(one) for one in (min(corners), max(corners))]))


@pytest.mark.parametrize("radius_m", [1e15, 1e38, math.inf, math.nan])
@pytest.mark.parametrize("kind", [IN, OUT])
def test_a_circle_wider_than_any_field_is_refused(kind: ZoneKind, radius_m: float) -> None:
    said = re.escape(f"clusion circle 1 has a radius of {radius_m:g} m; the limit is 1e+06 m")
    with pytest.raises(FenceError, match=said):
        ground(CircleZone(kind, HOME, radius_m))
