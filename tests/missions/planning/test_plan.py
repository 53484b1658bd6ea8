"""Plans, checked in a projection of the test's own."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
import pytest
import shapely
from charts import (
    FIELD,
    HOME,
    IN,
    MERCATOR_TOLERANCE_M,
    OUT,
    WALL,
    Chart,
    box,
    length_m,
    place,
    polygon,
    situation_of,
)
from hypothesis import example, given, settings
from shapely import Polygon
from strategies import RandomField, random_fields

from missions.checking.check import check_mission
from missions.errors import (
    FenceError,
    FenceMissingError,
    InvalidPositionError,
    NoRouteError,
    PlanStoppedError,
    RouteError,
    SituationError,
    StartBlockedError,
    TargetBlockedError,
)
from missions.fence import CircleZone, Fence, PolygonZone, ZoneKind
from missions.firmware import Firmware
from missions.formats import read_fence
from missions.geo import LatLon, rounded
from missions.items import MissionItem, waypoint
from missions.planning.plan import plan
from missions.request import Request
from missions.situation import Known, ListKind, ListTransfer, Mission, Pose, Reading, Situation

if TYPE_CHECKING:
    from missions.planned import Plan


def drawn(situation: Situation, start: LatLon, *targets: LatLon, clearance_m: float = 2.0, **options) -> Plan:
    """Plan the drawn lines only."""
    return plan(situation, Request(start, targets, clearance_m, corner_allowance_m=0.0, **options))


def assert_keeps(result: Plan, clearance_m: float) -> None:
    """Check a plan against what it promises."""
    chart = Chart(result.ground.frame.origin)
    found_m = chart.fence_clearance_m(result.fence, result.path)
    assert found_m >= clearance_m - MERCATOR_TOLERANCE_M
    assert result.drawn_clearance_m >= clearance_m
    assert result.drawn_clearance_m <= found_m + MERCATOR_TOLERANCE_M
    assert_consistent(result)


def assert_consistent(result: Plan) -> None:
    assert all(rounded(one) == one for one in result.path)
    assert [item.position for item in result.items] == list(result.path[1:])
    assert {(item.command, item.frame) for item in result.items} == {(16, 6)}
    assert result.length_m == pytest.approx(length_m(result.path), abs=1e-6)
    assert all(length_m(leg) <= 1000.5 for leg in pairwise(result.path))
    assert result.targets[-1] == result.path[-1]
    assert set(result.targets) <= set(result.path)


def _meridian(*lats_deg: float) -> PolygonZone:
    """Return an exclusion of corners on one meridian: a wall without area."""
    return PolygonZone(OUT, tuple(LatLon(lat_deg, -105.23) for lat_deg in lats_deg))


_WEST, _EAST = LatLon(0.0, -105.2301437), LatLon(0.0, -105.2298563)
_POST_AND_WALL = Fence((_meridian(9.04e-05, 0.0001809, 0.0), _meridian(0.0, 0.0, 0.0)))
_WALL_IN_A_CIRCLE = Fence((CircleZone(IN, LatLon(0.0, -105.23), 40.0), _meridian(4.52e-05, 0.0001809, 0.0)))


@given(random_fields())
@example(RandomField(_POST_AND_WALL, _WEST, _EAST, 2.5))
@example(RandomField(_WALL_IN_A_CIRCLE, _WEST, _EAST, 0.0))
@settings(max_examples=150)
def test_every_route_of_a_random_field_keeps_its_clearance(field: RandomField) -> None:
    situation = Situation(fence=Known(field.fence, None, "random"))
    try:
        result = drawn(situation, field.start, field.target, clearance_m=field.clearance_m)
    except (FenceError, RouteError) as error:
        _check_refusal(field, error)
        return
    chart = Chart(result.ground.frame.origin)
    start_m = chart.fence_clearance_m(field.fence, [field.start, field.start])
    if start_m > field.clearance_m + 0.3:  # some decimetres of reserve near the poles
        assert_keeps(result, field.clearance_m)
    else:
        assert (
            chart.fence_clearance_m(field.fence, result.path)
            >= min(start_m - 0.01, field.clearance_m) - 0.008 * start_m - MERCATOR_TOLERANCE_M
        )
        assert_consistent(result)
    assert result.path[0] == field.start
    assert result.path[-1] == field.target


def _check_refusal(field: RandomField, error: Exception) -> None:
    """A refusal is true: the end is where it says, by the test's own map."""
    chart = Chart(field.start)
    if isinstance(error, StartBlockedError):
        assert chart.fence_clearance_m(field.fence, [field.start, field.start]) < 0.2
    elif isinstance(error, TargetBlockedError):
        target_m = chart.fence_clearance_m(field.fence, [field.target, field.target])
        assert target_m < field.clearance_m + 0.3 + 0.008 * 3000 * 0.2


def _visibility_length_m(fence: Fence, a: LatLon, b: LatLon, clearance_m: float) -> float:
    """Return the length of the shortest path along corners of mitred offsets, by brute force."""
    chart = Chart(a)
    areas = {
        kind: [Polygon(chart.points(zone.vertices)) for zone in fence.zones if zone.kind is kind]
        for kind in ZoneKind
    }
    free = shapely.intersection_all(areas[IN]).buffer(-clearance_m, join_style="mitre")
    free = free.difference(
        shapely.union_all(
            [area.buffer(clearance_m, join_style="mitre", mitre_limit=2) for area in areas[OUT]]
        )
    )
    corners = np.unique(np.vstack([chart.points([a, b]), shapely.get_coordinates(free)]), axis=0)
    pairs = np.array(list(itertools.combinations(range(len(corners)), 2)))
    lines = shapely.linestrings(corners[pairs])
    seen = shapely.covers(free.buffer(1e-6), lines)
    distances = np.full((len(corners), len(corners)), np.inf)
    for (i, j), line in zip(pairs[seen], lines[seen], strict=True):
        distances[i, j] = distances[j, i] = line.length
    ends = [int(np.argmin(np.hypot(*(corners - chart.points([end])[0]).T))) for end in (a, b)]
    best = distances[ends[0]].copy()
    best[ends[0]] = 0
    for _ in range(len(corners)):
        shorter = (best[:, None] + distances).min(axis=0)
        if (shorter >= best).all():
            break
        best = np.minimum(best, shorter)
    return float(best[ends[1]])


@pytest.mark.parametrize("clearance_m", [0.5, 2.0, 5.0])
@pytest.mark.parametrize(("east_m", "north_m"), [(90, 0), (60, -85), (20, 80), (90, 90)])
def test_routes_are_the_shortest(clearance_m: float, east_m: float, north_m: float) -> None:
    zones = (
        FIELD,
        WALL,
        polygon(OUT, (30, -40), (70, -20), (40, 30)),
        polygon(OUT, (20, 60), (40, 50), (60, 75)),
    )
    start, target = place(-90, -10), place(east_m, north_m)
    result = drawn(situation_of(*zones), start, target, clearance_m=clearance_m)
    assert_keeps(result, clearance_m)
    best_m = _visibility_length_m(Fence(zones), start, target, clearance_m)
    assert best_m - 0.05 <= result.length_m <= best_m + 0.1


def test_the_plan_tells_what_it_used() -> None:
    result = drawn(situation_of(FIELD, WALL, WP_RADIUS=1.0, WP_SPEED=2.0), place(-50, 0), place(50, 0))
    assert_keeps(result, 2)
    assert result.start == place(-50, 0)
    assert result.straight_line_m == pytest.approx(100, abs=0.02)
    assert result.duration_s > result.length_m / 2.0 - 1
    assert result.clearance_m is None
    assert result.home == HOME
    assert result.vehicle.waypoint_radius_m == 1
    assert result.method == "optimal"
    assert result.blocks > 0


@pytest.mark.parametrize("lon_deg", [180.0, -180.0, 179.9995])
def test_a_field_across_the_antimeridian(lon_deg: float) -> None:
    origin = LatLon(-16.5, lon_deg)
    zones = (box(IN, -100, -100, 100, 100, origin), box(OUT, -5, -80, 5, 60, origin))
    result = drawn(situation_of(*zones), place(-80, 0, origin), place(80, 0, origin))
    assert_keeps(result, 2)
    assert 160 < result.length_m < 250
    assert {math.copysign(1, one.lon_deg) for one in result.path} == {1, -1}


@pytest.mark.parametrize("lat_deg", [84.9, -84.9])
def test_a_field_near_the_limit_of_latitude(lat_deg: float) -> None:
    origin = LatLon(lat_deg, 30)
    zones = (box(IN, -1500, -1500, 1500, 1500, origin), box(OUT, -5, -800, 5, 600, origin))
    result = drawn(situation_of(*zones), place(-1400, 0, origin), place(1400, 0, origin))
    assert_keeps(result, 2)


@pytest.mark.parametrize("lat_deg", [85.01, -86.0])
def test_beyond_85_degrees_is_refused(lat_deg: float) -> None:
    origin = LatLon(lat_deg, 30)
    with pytest.raises(InvalidPositionError, match="beyond ±85°"):
        drawn(situation_of(box(IN, -100, -100, 100, 100, origin)), origin, place(20, 20, origin))


def test_an_end_beyond_85_degrees_is_refused_too() -> None:
    origin = LatLon(84.9995, 30)
    with pytest.raises(InvalidPositionError, match="beyond ±85°"):
        drawn(situation_of(box(OUT, 0, 0, 10, 10, origin)), place(0, -50, origin), place(0, 80, origin))


@pytest.mark.parametrize("lat_deg", [0.0, 40.0, 70.0, 84.0])
def test_long_legs_are_split_and_keep_their_clearance(lat_deg: float) -> None:
    """The route runs along a wall of 7 km, where the autopilot's line and a straight one part by decimetres and more."""
    origin = LatLon(lat_deg, 24.8)
    wall = polygon(OUT, (-3500, 0), (3500, 0), (3500, 20), (-3500, 20), origin=origin)
    result = drawn(situation_of(wall), place(-3480, -3, origin), place(3480, -3, origin))
    assert_keeps(result, 2)
    assert len(result.items) >= 7
    across = drawn(situation_of(wall), place(-3480, -3, origin), place(-1000, 40, origin))
    assert_keeps(across, 2)


def test_a_field_that_reaches_to_much_higher_latitudes_than_its_middle() -> None:
    origin = LatLon(84.5, 10)
    wall = box(OUT, -300, -54_000, 300, 54_000, origin)
    result = drawn(situation_of(wall), place(-2000, 53_900, origin), place(2000, 53_900, origin))
    assert_keeps(result, 2)


def test_without_inclusion_the_ground_is_open() -> None:
    result = drawn(situation_of(WALL), place(-200, 0), place(700, 0))
    assert_keeps(result, 2)
    assert result.length_m < 925


def test_several_targets_are_visited_in_order() -> None:
    targets = (place(50, 0), place(-50, 50), place(50, 0), place(50, 0), place(90, -90))
    result = drawn(situation_of(FIELD, WALL), place(-50, 0), *targets)
    assert_keeps(result, 2)
    assert result.targets == targets
    visits = iter(result.path)
    assert all(
        any(visit == target for visit in visits)
        for target in (targets[0], targets[1], targets[3], targets[4])
    )


def test_a_start_that_is_the_target() -> None:
    result = drawn(situation_of(FIELD, WALL), place(-50, 0), place(-50, 0))
    assert result.path == (place(-50, 0), place(-50, 0))
    assert len(result.items) == 1
    assert result.length_m == 0
    assert result.duration_s >= 0
    there_and_back = drawn(situation_of(FIELD, WALL), place(-50, 0), place(-50, 0), place(-60, 0))
    assert there_and_back.path == (place(-50, 0), place(-60, 0))


def test_union_drives_through_the_overlap() -> None:
    zones = (box(IN, -100, -20, 10, 20), box(IN, -10, -60, 100, 10))
    start, target = place(-80, 0), place(80, -40)
    joined = drawn(situation_of(*zones, FENCE_OPTIONS=2), start, target)
    chart = Chart(HOME)
    ground = shapely.union_all([Polygon(chart.points(zone.vertices)) for zone in zones])
    line = chart.line(joined.path)
    assert ground.covers(line)
    assert line.distance(ground.boundary) >= 2 - MERCATOR_TOLERANCE_M
    assert joined.ground.union
    with pytest.raises(StartBlockedError, match="inclusion polygon 2"):
        drawn(situation_of(*zones), start, target)


def test_ends_in_one_of_two_inclusions_hear_of_the_intersection() -> None:
    zones = (box(IN, -100, -100, 20, 100), box(IN, -20, -100, 100, 100))
    for start, target in ((place(-80, 0), place(0, 0)), (place(0, 0), place(80, 0))):
        with pytest.raises(
            (StartBlockedError, TargetBlockedError), match="only the intersection of all inclusions"
        ) as caught:
            drawn(situation_of(*zones), start, target)
        assert caught.value.details["advice"].startswith(
            "draw the area as one inclusion polygon (pbpp fence merge"
        )
        assert "FENCE_OPTIONS" not in str(caught.value)
    outside = place(0, 300)
    with pytest.raises(TargetBlockedError, match=r"inclusion polygon 1") as caught:
        drawn(situation_of(*zones), place(0, 0), outside)
    assert "intersection" not in str(caught.value)


def test_inclusions_without_common_ground_are_refused() -> None:
    zones = (box(IN, -100, -100, -50, -50), box(IN, 50, 50, 100, 100))
    with pytest.raises(
        FenceError,
        match=r"inclusion polygon 1 and inclusion polygon 2 have no area in common; the autopilot allows only the intersection",
    ):
        drawn(situation_of(*zones), place(-80, -80), place(80, 80))
    with pytest.raises(FenceError, match="the exclusions cover all of inclusion polygon 1"):
        drawn(situation_of(FIELD, box(OUT, -120, -120, 120, 120)), place(0, 0), place(10, 10))


@pytest.mark.parametrize("options", [0, 2])
def test_the_home_circle_is_kept(options: int) -> None:
    """The straight way is open but for the circle."""
    parameters = {
        "FENCE_ENABLE": 1.0,
        "FENCE_TYPE": 6.0,
        "FENCE_RADIUS": 50.0,
        "FENCE_OPTIONS": float(options),
    }
    bar = box(OUT, -3, -100, 3, 40)
    start, target = place(-40, 20), place(40, 20)
    result = drawn(situation_of(FIELD, bar, **parameters), start, target)
    assert_keeps(result, 2)
    circle = CircleZone(IN, HOME, 50 * 0.995)  # the autopilot's metre may be so much shorter than a true one
    assert Chart(HOME).clearance_m(circle, result.path) >= 1.75
    with pytest.raises(NoRouteError, match=r"home circle \(FENCE_RADIUS 50 m\)"):
        drawn(situation_of(FIELD, box(OUT, -3, -100, 3, 47), **parameters), start, target)
    unbound = drawn(
        situation_of(FIELD, box(OUT, -3, -100, 3, 47), **{**parameters, "FENCE_ENABLE": 0.0}), start, target
    )
    assert_keeps(unbound, 2)


def test_margins_come_from_the_parameters() -> None:
    request = Request(place(-50, 0), (place(50, 0),))
    for parameters, clearance_m in [
        ({"FENCE_MARGIN": 3.0, "WP_RADIUS": 1.5}, 3.5),
        ({"FENCE_MARGIN": 0.2, "WP_RADIUS": 0.5}, 1.0),
        ({}, 2.5),
    ]:
        result = plan(situation_of(FIELD, WALL, **parameters), request)
        assert result.clearance_m == clearance_m
        assert result.driven_clearance_m >= clearance_m
        assert_keeps(result, clearance_m)
    assert "FENCE_MARGIN unknown; assuming 2" in result.warnings
    assert any(
        "ArduPilot defaults used" in warning and "WP_RADIUS 2" in warning for warning in result.warnings
    )


def test_a_clearance_within_the_fence_margin_is_warned_of() -> None:
    parameters = {"FENCE_ENABLE": 1.0, "FENCE_TYPE": 4.0, "FENCE_MARGIN": 2.0, "AVOID_ENABLE": 1.0}
    near = drawn(situation_of(FIELD, WALL, **parameters), place(-50, 0), place(50, 0), clearance_m=1.0)
    assert any("within FENCE_MARGIN 2 m" in warning for warning in near.warnings)
    wide = drawn(situation_of(FIELD, WALL, **parameters), place(-50, 0), place(50, 0), clearance_m=2.5)
    assert not any("FENCE_MARGIN" in warning for warning in wide.warnings)


@pytest.mark.parametrize(
    ("parameters", "reason"),
    [
        ({"FENCE_ENABLE": 0.0, "FENCE_TYPE": 6.0}, "FENCE_ENABLE is 0"),
        (
            {"FENCE_ENABLE": 1.0, "FENCE_TYPE": 2.0, "FENCE_RADIUS": 500.0},
            "FENCE_TYPE bit 2 (value 4) is not set",
        ),
        ({"WP_RADIUS": 1.0}, "FENCE_ENABLE unknown, default 0"),
        ({"FENCE_ENABLE": 1.0, "FENCE_TYPE": 4.0}, None),
        ({}, None),
    ],
)
def test_a_fence_that_is_not_enforced_is_honoured_with_a_warning(
    parameters: dict[str, float], reason: str | None
) -> None:
    result = drawn(situation_of(FIELD, WALL, **parameters), place(-50, 0), place(50, 0))
    assert_keeps(result, 2)
    found = [warning for warning in result.warnings if "does not enforce" in warning]
    assert found == (
        [f"the autopilot does not enforce this fence ({reason}); it is used here anyway"] if reason else []
    )


def test_odd_rings_are_warned_of() -> None:
    tie = polygon(OUT, (-10, -10), (10, 10), (10, -10), (-10, 10))
    result = drawn(situation_of(FIELD, tie), place(-50, 0), place(50, 0))
    assert_keeps(result, 2)
    assert any(
        warning.startswith("exclusion polygon 1 crosses or touches itself") for warning in result.warnings
    )


class TestStartNearAFence:
    """The route leads away first, never nearer than the start is, and says so."""

    @pytest.mark.parametrize("gap_m", [0.05, 0.5, 1.5, 1.99])
    @pytest.mark.parametrize("clearance_m", [2.0, 5.0])
    def test_it_leads_away(self, gap_m: float, clearance_m: float) -> None:
        start = place(-5 - gap_m, 0)
        result = drawn(situation_of(FIELD, WALL), start, place(50, 0), clearance_m=clearance_m)
        chart = Chart(HOME)
        start_m = chart.fence_clearance_m(result.fence, [start, start])
        assert chart.fence_clearance_m(result.fence, result.path) >= start_m - 1e-3
        after = result.path[1:]
        assert chart.fence_clearance_m(result.fence, after) >= clearance_m - MERCATOR_TOLERANCE_M
        assert length_m(result.path[:2]) < 2 * clearance_m + 1  # the shortest way off, not along the fence
        assert result.warnings[-1] == (
            f"the start is {start_m:.2f} m from a fence, too near to keep {clearance_m:g} m: while leaving it, the rover keeps at least {start_m:.2f} m"
        )

    def test_out_of_a_corridor_narrower_than_the_clearance(self) -> None:
        corridor = (box(OUT, -60, 2, -20, 30), box(OUT, -60, -30, -20, -2))
        start = place(-40, 0.5)
        result = drawn(situation_of(FIELD, *corridor), start, place(50, 0), clearance_m=3)
        chart = Chart(HOME)
        assert chart.fence_clearance_m(result.fence, result.path) >= 1.5 - 0.02
        assert chart.fence_clearance_m(result.fence, result.path[1:]) >= 3 - MERCATOR_TOLERANCE_M

    def test_out_of_a_long_corridor_over_split_legs(self) -> None:
        origin = LatLon(0, 30)  # where the autopilot's lines are straight
        corridor = (box(OUT, -2000, 2, 2000, 30, origin), box(OUT, -2000, -30, 2000, -2, origin))
        result = drawn(
            situation_of(*corridor), place(-500, 0.3, origin), place(0, 100, origin), clearance_m=3
        )
        found_m = [Chart(origin).fence_clearance_m(result.fence, leg) for leg in pairwise(result.path)]
        assert sum(one < 3 - MERCATOR_TOLERANCE_M for one in found_m) == 2
        assert min(found_m) >= 1.7 - 0.01 - MERCATOR_TOLERANCE_M
        assert_consistent(result)

    def test_a_start_that_cannot_lead_away_names_the_fences(self) -> None:
        ring = polygon(OUT, (-40, 0), (-40, 20), (-10, 20), (-10, 3), (-38, 3), (-38, 0))
        below = box(OUT, -60, -20, 60, 0)
        with pytest.raises(
            NoRouteError,
            match=r"no route keeps 20 m \(20\.01 m along straight legs\); the widest keeps 1\.50 m, narrowest at exclusion polygon 2",
        ) as caught:
            drawn(situation_of(FIELD, ring, below), place(-30, 1.5), place(50, 50), clearance_m=20)
        assert caught.value.details["fences"]


class TestBlockedEnds:
    """Who stands where he must not be is told by which fence, how far and in what direction free ground is."""

    def test_start_in_an_exclusion(self) -> None:
        with pytest.raises(
            StartBlockedError,
            match=r"exclusion polygon 1 \(.*\); the allowed area is 1\.0\d m away, bearing 270°",
        ) as caught:
            drawn(situation_of(FIELD, WALL), place(-4, 0), place(50, 0))
        error = caught.value
        assert error.details["fences"] == ["exclusion polygon 1"]
        assert error.details["distance_m"] == pytest.approx(1, abs=0.02)
        assert error.details["bearing_deg"] == pytest.approx(270, abs=0.2)

    def test_start_outside(self) -> None:
        with pytest.raises(StartBlockedError, match="inclusion polygon 1") as caught:
            drawn(situation_of(FIELD, WALL), place(0, 130), place(50, 0))
        assert caught.value.details["distance_m"] == pytest.approx(30, abs=0.02)
        assert caught.value.details["bearing_deg"] == pytest.approx(180, abs=0.2)

    def test_start_outside_the_home_circle_names_it(self) -> None:
        situation = situation_of(FIELD, FENCE_ENABLE=1.0, FENCE_TYPE=6.0, FENCE_RADIUS=60.0)
        with pytest.raises(StartBlockedError, match=r"home circle \(FENCE_RADIUS 60 m\)"):
            drawn(situation, place(80, 0), place(0, 0))

    def test_target_in_an_exclusion(self) -> None:
        with pytest.raises(
            TargetBlockedError, match=r"the target is inside exclusion polygon 1 \(.*\);"
        ) as caught:
            drawn(situation_of(FIELD, WALL), place(-50, 0), place(4, 0))
        assert caught.value.details["distance_m"] == pytest.approx(3.01, abs=0.05)
        assert caught.value.details["bearing_deg"] == pytest.approx(90, abs=0.5)

    def test_target_too_near_a_fence(self) -> None:
        with pytest.raises(
            TargetBlockedError,
            match=r"the target is 1\.2\d m from exclusion polygon 1, closer than 2 m \(2\.0\d m along straight legs\)",
        ):
            drawn(situation_of(FIELD, WALL), place(-50, 0), place(6.25, 0))

    def test_a_second_target_that_is_blocked(self) -> None:
        with pytest.raises(
            TargetBlockedError,
            match=r"the target is inside exclusion polygon 1 \(.*\); the nearest free point is 7\.0",
        ):
            drawn(situation_of(FIELD, WALL), place(-50, 0), place(50, 0), place(0, 0))

    def test_no_ground_keeps_the_clearance(self) -> None:
        with pytest.raises(
            RouteError, match=r"no place in the field keeps 150 m \(150\.0\d m along straight legs\)"
        ):
            drawn(situation_of(FIELD, WALL), place(-50, 0), place(50, 0), clearance_m=150)

    def test_a_target_off_a_sharp_corner_is_free_if_its_true_distance_says_so(self) -> None:
        """Mitred offsets reach further than the clearance; what they take away is not said to be too near."""
        spike = polygon(OUT, (-30, -3), (0, 0), (-30, 3))
        target = place(2.2, 0)
        result = drawn(situation_of(FIELD, spike), place(-50, 50), target, clearance_m=2)
        assert result.path[-1] == target
        assert_keeps(result, 2)

    def test_a_start_off_a_sharp_corner(self) -> None:
        spike = polygon(OUT, (-30, -3), (0, 0), (-30, 3))
        result = drawn(situation_of(FIELD, spike), place(2.2, 0), place(-50, 50), clearance_m=2)
        assert_keeps(result, 2)

    @pytest.mark.parametrize("gap_m", [2.001, 2.006, 2.011, 2.012, 2.0125, 2.013, 2.014, 2.02])
    def test_ends_on_the_edge_of_free_ground_end_in_a_plan_or_a_clear_refusal(self, gap_m: float) -> None:
        spike = polygon(OUT, (-30, -3), (0, 0), (-30, 3))
        for start, target in [(place(gap_m, 0), place(-50, 50)), (place(-50, 50), place(gap_m, 0))]:
            try:
                result = drawn(situation_of(FIELD, spike), start, target, clearance_m=2)
            except TargetBlockedError as error:
                refused = str(error)
                assert gap_m < 2.02
                assert "exclusion polygon 1" in refused
            else:
                chart = Chart(HOME)
                assert chart.fence_clearance_m(result.fence, result.path) >= min(gap_m - 0.01, 2.0) - 0.01


class TestSnap:
    """--snap moves a blocked target to free ground within its reach, and says so."""

    def test_it_moves_to_the_nearest_free_point(self) -> None:
        result = drawn(situation_of(FIELD, WALL), place(50, 0), place(4, 0), snap_m=4.0)
        assert_keeps(result, 2)
        assert length_m([place(4, 0), result.targets[0]]) == pytest.approx(3.01, abs=0.05)
        assert any(text.startswith("target ") and "moved 3.0" in text for text in result.info)

    def test_a_free_target_stays(self) -> None:
        result = drawn(situation_of(FIELD, WALL), place(50, 0), place(20, 0), snap_m=4.0)
        assert result.targets == (place(20, 0),)
        assert not any("moved" in text for text in result.info)

    def test_not_further_than_asked(self) -> None:
        with pytest.raises(TargetBlockedError, match=r"the nearest free point is 3\.0\d m away"):
            drawn(situation_of(FIELD, WALL), place(50, 0), place(4, 0), snap_m=2.5)

    def test_more_clearance_than_asked_moves_it_no_further(self) -> None:
        """A route for more clearance may be quicker, but its target would be moved farther away than it has to be."""
        bed = box(OUT, -20.3, -11.1, -6.8, 0.0)
        situation = replace(
            situation_of(box(IN, -67.7, -55.6, 67.7, 55.6), bed),
            parameters={
                "WP_SPEED": 2.0,
                "WP_RADIUS": 1.0,
                "TURN_RADIUS": 0.9,
                "FENCE_MARGIN": 2.0,
                "AVOID_ENABLE": 3.0,
                "FENCE_ENABLE": 1.0,
                "FENCE_TYPE": 4.0,
            },
        )
        asked = place(-13.5, -5.56)
        result = plan(
            situation, Request(start=place(-54.2, -33.4), targets=[asked], clearance_m=2.5, snap_m=30.0)
        )
        # Out of the bed 5.54 m, and from it 2.5 m and the corridor beside straight legs.
        assert 5.54 + 2.5 < length_m([asked, result.targets[0]]) < 5.54 + 2.5 + 0.5

    def test_to_ground_that_can_be_reached(self) -> None:
        """The nearest free point lies beyond a wall without a way round; one on this side is within reach too."""
        wall = box(OUT, -5, -110, 5, 110)
        result = drawn(situation_of(FIELD, wall), place(50, 0), place(-1, 0), snap_m=9.0)
        assert_keeps(result, 2)
        assert result.targets[0].lon_deg > HOME.lon_deg


class TestUnreachable:
    """Targets that cannot be reached name what walls them in, or how wide the widest way is."""

    def test_a_closed_courtyard(self) -> None:
        court = [
            box(OUT, *sides)
            for sides in [(20, 20, 80, 25), (20, 75, 80, 80), (20, 20, 25, 80), (75, 20, 80, 80)]
        ]
        with pytest.raises(
            NoRouteError, match=r"no route at any clearance: the target is enclosed by"
        ) as caught:
            drawn(situation_of(FIELD, *court, box(OUT, -50, -50, -40, -40)), place(-50, 0), place(50, 50))
        assert caught.value.details["walled_in"] == "target"
        assert "less clearance does not help: open a gap in exclusion polygon 1" in str(
            caught.value.details["advice"]
        )
        assert "another target" in str(caught.value.details["advice"])
        assert caught.value.details["fences"] == [f"exclusion polygon {i}" for i in (1, 2, 3, 4)]

    def test_a_closed_courtyard_around_the_start_and_against_the_edge(self) -> None:
        wall = polygon(OUT, (-100, 0), (-60, 0), (-60, -100), (-50, -100), (-50, 10), (-100, 10))
        with pytest.raises(
            NoRouteError, match="the start is enclosed by inclusion polygon 1 and exclusion polygon 1"
        ) as caught:
            drawn(situation_of(FIELD, wall), place(-80, -50), place(50, 50))
        assert caught.value.details["walled_in"] == "start"
        assert "drive it out manually" in str(caught.value.details["advice"])

    def test_a_gap_too_narrow(self) -> None:
        zones = (box(OUT, -5, -100, 5, -1.5), box(OUT, -5, 1.5, 5, 100))
        with pytest.raises(
            NoRouteError,
            match=r"no route keeps 2 m \(2\.0\d m along straight legs\); the widest keeps 1\.(49|50) m, narrowest between exclusion polygon [12] and exclusion polygon [12]",
        ) as caught:
            drawn(situation_of(FIELD, *zones), place(-50, 0), place(50, 0))
        assert caught.value.details["widest_m"] == pytest.approx(1.5, abs=0.02)
        assert set(caught.value.details["fences"]) == {"exclusion polygon 1", "exclusion polygon 2"}


class TestWhatIsNotKnown:
    """Nothing is guessed: what is missing is named, with what to do."""

    def test_the_default_ends(self) -> None:
        situation = Situation(
            fence=Known(Fence((FIELD,)), None, ""),
            home=Known(place(1, 1), None, ""),
            mission=Known(
                Mission((waypoint(place(20, 20)), waypoint(place(30, 30)), MissionItem(20))), None, ""
            ),
        )
        result = plan(situation, Request())
        assert result.path[0] == place(1, 1)
        assert result.targets == (place(30, 30),)
        from dataclasses import replace

        moved = replace(
            situation, pose=Known(Pose(place(2, 2), 90.0), 1.0, ""), target=Known(place(40, 40), 1.0, "")
        )
        result = plan(moved, Request())
        assert result.path[0] == place(2, 2)
        assert result.targets == (place(40, 40),)

    @pytest.mark.parametrize("ends", [(HOME, (LatLon(41.1, -105.2),)), (LatLon(41.1, -105.2), (HOME,))])
    def test_nothing_leads_to_where_no_plane_reaches(self, ends):
        problem = (
            r"no route: 41\.1000000,-105\.2000000 is 114 km from the fence's centre .*; the limit is 100 km"
        )
        with pytest.raises(NoRouteError, match=problem):
            plan(situation_of(FIELD), Request(*ends))

    @pytest.mark.parametrize(
        ("situation", "request_", "problem"),
        [
            (Situation(fence=Known(Fence((FIELD,)), None, "")), Request(), "start unknown"),
            (situation_of(FIELD), Request(), r"target unknown: .* --target LAT,LON"),
            (
                Situation(fence=Known(Fence((FIELD,)), None, ""), home=Known(HOME, None, ""), mission=Known(Mission(()), None, "")),
                Request(),
                "target unknown",
            ),
            (
                Situation(fence=Known(Fence((FIELD,)), None, ""), parameters={"FENCE_ENABLE": 1.0}),
                Request(HOME, (HOME,)),
                "FENCE_RADIUS 300 m around home, but home is unknown",
            ),
            (
                Situation(
                    fence=Known(Fence((FIELD,)), None, ""), parameters={"FENCE_ENABLE": 1.0}, home=Known(LatLon(-40.07, 74.77), None, "")
                ),
                Request(HOME, (HOME,)),
                "home -40.07.* is .* km from the fence's centre",
            ),
        ],
    )  # fmt: skip
    def test_what_is_missing_is_named(self, situation: Situation, request_: Request, problem: str) -> None:
        with pytest.raises(SituationError, match=problem):
            plan(situation, request_)

    def test_a_fence_that_was_never_there_or_is_empty(self) -> None:
        request = Request(HOME, (place(5, 5),))
        with pytest.raises(
            FenceMissingError,
            match=r"^no fence to plan around: no fence was uploaded or downloaded\. Download .*--fence",
        ):
            plan(Situation(), request)
        with pytest.raises(
            FenceMissingError,
            match=r"^no fence to plan around: the vehicle holds a fence of 9 points \(FENCE_TOTAL\), but .*FENCE_POINT",
        ):
            plan(Situation(parameters={"FENCE_TOTAL": 9.0}), request)
        with pytest.raises(FenceMissingError, match="the fence from test is empty"):
            plan(Situation(fence=Known(Fence(), None, "test")), request)

    @pytest.mark.parametrize(
        ("transfers", "problem"),
        [
            ([ListTransfer(True, 5, {0: MissionItem(5002)})], r"a fence upload is incomplete \(1 of 5 items\)"),
            ([ListTransfer(False, None, {3: MissionItem(5002)})], r"a fence download is incomplete \(1 of an unknown number of items\)"),
            ([ListTransfer(True, 1, {0: MissionItem(5004)})], "a fence upload of 1 items was not acknowledged"),
        ],
    )  # fmt: skip
    def test_a_fence_seen_in_part(self, transfers: list[ListTransfer], problem: str) -> None:
        situation = Situation(
            reading=Reading(transfers={(ListKind.FENCE, one.to_vehicle): one for one in transfers})
        )
        with pytest.raises(FenceMissingError, match=problem):
            plan(situation, Request(HOME, (place(5, 5),)))
        # beside an older fence it is a warning
        older = Situation(fence=Known(Fence((FIELD,)), 1.0, "old"), reading=situation.reading)
        result = drawn(older, HOME, place(5, 5))
        assert any(
            "an older fence is used" in warning
            and problem.split(" (", maxsplit=1)[0].split(r" \(", maxsplit=1)[0] in warning
            for warning in result.warnings
        )

    def test_a_fence_that_was_unusable(self) -> None:
        situation = Situation(reading=Reading(fence_trouble="fence upload: fence item 3: circle radius 0 m"))
        with pytest.raises(
            FenceMissingError, match=r"a fence was sent but cannot be used \(fence upload: fence item 3"
        ):
            plan(situation, Request(HOME, (place(5, 5),)))
        older = Situation(
            fence=Known(Fence((FIELD,)), 1.0, "old"),
            reading=situation.reading,
            parameters={"FENCE_ENABLE": 0.0},
        )
        warnings = drawn(older, HOME, place(5, 5)).warnings
        assert any("an older fence is used" in warning for warning in warnings)
        assert any("does not enforce" in warning for warning in warnings)


@pytest.mark.parametrize("last", [1, 2, 5])
@pytest.mark.parametrize(
    "how", [{"clearance_m": 2.0}, {"widest": True}, {"clearance_m": 2.0, "order": "best", "comes_back": True}]
)
def test_a_plan_that_is_stopped_ends_with_one_error_wherever_it_is(how: dict[str, object], last: int) -> None:
    """Also where a search would take the stop for a refusal, and a widest route for its answer."""
    asked = itertools.count(1)
    ends = {"start": place(-50, 0), "targets": (place(50, 0), place(40, 30))}
    with pytest.raises(PlanStoppedError, match="no longer needed"):
        plan(situation_of(FIELD, WALL), Request(**ends, **how), should_stop=lambda: next(asked) >= last)
    assert next(asked) == last + 1  # it was not asked again


@pytest.mark.parametrize(("name", "ends"), [("maze", [(40.0714396, -105.2297785), (40.0726316, -105.2290497)]), ("yard", [(40.0714699, -105.2297855), (40.0720926, -105.2286152)])])  # fmt: skip
@pytest.mark.parametrize("clearance_m", [0.0, 1.0, 2.0])
def test_the_recorded_fields(fields, name: str, ends: list[tuple[float, float]], clearance_m: float) -> None:
    fence = read_fence(fields / f"{name}-fence.waypoints")
    result = drawn(
        Situation(fence=Known(fence, None, "")), *(LatLon(*end) for end in ends), clearance_m=clearance_m
    )
    assert_keeps(result, clearance_m)


def test_outside_what_was_measured_nothing_is_promised_unless_the_model_is_trusted() -> None:
    situation = situation_of(FIELD, WALL, WP_SPEED=2.0, OA_TYPE=1.0)
    request = Request(place(-50, 0), (place(50, 0),), 2.0)
    silent, trusted = (plan(situation, replace(request, trusts_model=trusts)) for trusts in (False, True))
    assert (silent.clearance_m, trusted.clearance_m) == (None, 2.0)
    assert silent.driven_clearance_m == trusted.driven_clearance_m >= 2.0
    for result, told, words in (
        (silent, silent.warnings, "no clearance is promised"),
        (trusted, trusted.info, "clearance is promised anyway"),  # asked for, so no warning
    ):
        assert len(result.extrapolated) == 1
        assert result.extrapolated[0].startswith("OA_TYPE 1: ArduPilot plans its own way")
        assert result.extrapolated[0] in told
        assert any(words in one for one in told)
    assert not set(trusted.warnings) & {*trusted.info}


@pytest.mark.parametrize(
    ("away_m", "heading_deg", "parameters", "is_promised"),
    [
        (0.8, 180.0, {}, False),
        (2.9, 90.0, {}, False),
        (3.1, 180.0, {}, True),
        (0.8, 10.0, {}, True),
        (0.8, 180.0, {"SERVO1_FUNCTION": 73.0, "SERVO3_FUNCTION": 74.0}, True),
    ],
)
def test_a_steered_rover_that_turns_into_a_short_drive_was_not_measured(
    away_m: float, heading_deg: float, parameters: dict[str, float], is_promised: bool
) -> None:
    """In the simulator one that faced away left its corridor by 16 m to get 0.8 m far."""
    situation = replace(
        situation_of(FIELD, WP_SPEED=2.0, **parameters),
        pose=Known(Pose(place(-50, 0), heading_deg), None, "test"),
    )
    found = plan(situation, Request(targets=(place(-50, away_m),), clearance_m=2.0))
    assert (found.clearance_m is not None) == is_promised
    assert any("at least 3 m away" in text for text in found.extrapolated) != is_promised


@pytest.mark.parametrize("parameters", [{}, {"FENCE_NTF_FREQ": 1.0, "WP_SPEED": 2.0}])
def test_an_unknown_firmware_is_no_matter_where_all_is_assumed_or_a_name_tells(
    parameters: dict[str, float],
) -> None:
    situation = replace(situation_of(FIELD, WALL, **parameters), firmware=None)
    request = Request(place(-50, 0), (place(50, 0),), 2.0)
    assert plan(situation, request).clearance_m == 2.0
    known = replace(situation, parameters={"WP_SPEED": 2.0, "WP_RADIUS": 4.0})
    found = plan(known, request)
    assert found.clearance_m is None
    assert "firmware unknown" in found.extrapolated[0]
    assert plan(replace(known, firmware=Firmware(4, 6)), request).extrapolated == ()


def test_an_unknown_firmware_promises_what_the_older_and_the_newer_keep() -> None:
    request = Request(place(-50, 0), (place(50, 0),), 2.0)
    known = {"WP_SPEED": 3.0, "WP_RADIUS": 3.0}
    plans = {
        version: plan(replace(situation_of(FIELD, WALL, **known), firmware=version), request)
        for version in (None, Firmware(4, 5), Firmware(4, 6))
    }
    for made in plans.values():
        assert (made.clearance_m, made.extrapolated) == (2.0, ())
    for version in (Firmware(4, 5), Firmware(4, 6)):
        situation = replace(situation_of(FIELD, WALL, **known), firmware=version)
        assert check_mission(Mission(plans[None].items), situation, request).is_promised
