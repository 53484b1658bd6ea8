"""Plans fitted to a vehicle: the band keeps the promise, measured apart from the code that fitted it."""

from __future__ import annotations

import itertools
import math
from collections import Counter
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
import shapely
from charts import FIELD, HOME, IN, MERCATOR_TOLERANCE_M, OUT, WALL, Chart, box, place, situation_of
from hypothesis import HealthCheck, given, settings
from shapely import LineString, Point
from strategies import RandomField, random_fields

import pbpp
from missions.drive_model import envelope
from missions.errors import NoRouteError, RequestError, RouteError, StartBlockedError, TargetBlockedError
from missions.fence import CircleZone
from missions.geo import LatLon
from missions.ground.from_situation import ground_for
from missions.items import Command
from missions.planning.plan import plan
from missions.request import Request
from missions.routing.drawn_route import DrawnRoutes, Sought
from missions.routing.no_route import NoRoute, NoRouteKind
from missions.routing.promised_route import PromisedRoute
from missions.routing.route_search import RouteSearch
from missions.situation import Fix, Known, Pose, Situation
from missions.vehicle import Footprint, vehicle_from_parameters

if TYPE_CHECKING:
    from collections.abc import Callable

    from missions.planned import Plan

VEHICLES = [
    {"WP_SPEED": 2.0, "WP_RADIUS": 2.0},
    {"WP_SPEED": 5.0, "WP_RADIUS": 3.0},
    {"WP_SPEED": 2.0, "WP_RADIUS": 2.0, "SERVO1_FUNCTION": 73.0, "SERVO3_FUNCTION": 74.0},
]


def facing(situation: Situation, east_m: float, north_m: float, heading_deg: float) -> Situation:
    return replace(situation, pose=Known(Pose(place(east_m, north_m), heading_deg), 0.0, "test"))


def band_of(result: Plan, heading_deg: float | None) -> shapely.geometry.base.BaseGeometry:
    """Build the band again from the mission items alone, as the autopilot reads them."""
    places, speeds, stops = [result.path[0]], [], {}
    speed_mps: float | None = None
    for item in result.items:
        if item.command == Command.DO_CHANGE_SPEED:
            speed_mps = item.params[1]
            continue
        assert item.command == Command.NAV_WAYPOINT
        places.append(item.position)
        speeds.append(speed_mps)
        if item.params[0]:
            stops[len(places) - 1] = item.params[0]
    points = Chart(result.ground.frame.origin).points(places)
    if heading_deg is None:
        heading_deg = math.degrees(math.atan2(*(points[1] - points[0])))
    return envelope(points, result.vehicle, heading_deg=heading_deg, speeds=speeds, stops=stops).area


def fence_line(result: Plan) -> shapely.geometry.base.BaseGeometry:
    chart = Chart(result.ground.frame.origin)
    return shapely.union_all(
        [chart.zone_line(zone) for zone in result.fence.zones if hasattr(zone, "vertices")]
    )


def assert_driven(result: Plan, heading_deg: float | None) -> None:
    """Check the promise on the band of the items, in the test's own map."""
    kept_m = band_of(result, heading_deg).distance(fence_line(result))
    assert result.clearance_m is not None
    assert kept_m >= result.clearance_m - MERCATOR_TOLERANCE_M - 0.01
    assert result.driven_clearance_m >= result.clearance_m
    assert result.driven_clearance_m <= kept_m + 0.02
    assert result.drawn_clearance_m >= result.clearance_m
    assert [result.items[seq - 1].position for seq in result.seqs[1:]] == list(result.path[1:])
    assert all(result.items[seq - 1].command == Command.NAV_WAYPOINT for seq in result.seqs[1:])


@pytest.mark.parametrize("parameters", VEHICLES)
@pytest.mark.parametrize("heading_deg", [90.0, 0.0, 250.0])
def test_the_band_keeps_the_promise_round_a_wall(parameters: dict[str, float], heading_deg: float) -> None:
    situation = facing(situation_of(FIELD, WALL, **parameters), -50, 0, heading_deg)
    result = plan(situation, Request(targets=(place(50, 0),), clearance_m=2.0))
    assert_driven(result, heading_deg)
    shortest = plan(situation, Request(targets=(place(50, 0),), clearance_m=2.0, corner_allowance_m=0.0))
    assert shortest.length_m <= result.length_m <= 1.1 * shortest.length_m


@pytest.mark.parametrize("parameters", VEHICLES)
def test_a_hairpin_is_not_driven_as_one_corner(parameters: dict[str, float]) -> None:
    wall = box(OUT, -60, -0.5, 30, 0.5)
    situation = facing(situation_of(box(IN, -60, -60, 60, 60), wall, **parameters), -40, -6, 90.0)
    result = plan(situation, Request(targets=(place(-40, 6),), clearance_m=1.5))
    assert_driven(result, 90.0)
    if "SERVO1_FUNCTION" not in parameters:
        assert all(corner.bounded for corner in result.envelope.corners)
        assert all(abs(corner.turn_deg) < 150 for corner in result.envelope.corners)


def test_a_narrow_gate_is_driven_slowly_where_it_has_to_be() -> None:
    """A passage of 2 x 2.6 m is wide enough for a band of 0.25 m at 1 m/s about 2.2 m, not for one of 0.45 m."""
    walls = [box(OUT, -3, -60, 3, -2.5), box(OUT, -3, 2.5, 3, 60)]
    fence = [box(IN, -60, -60, 60, 60), *walls]
    situation = facing(situation_of(*fence, WP_SPEED=5.0, WP_RADIUS=3.0), -50, 0, 90.0)
    result = plan(situation, Request(targets=(place(50, 0),), clearance_m=2.2))
    assert_driven(result, 90.0)
    slow = [item.params for item in result.items if item.command == Command.DO_CHANGE_SPEED]
    assert slow
    assert min(params[1] for params in slow) < 5.0
    assert {params[0] for params in slow} == {1.0}
    wide = plan(situation, Request(targets=(place(50, 0),), clearance_m=1.9))
    assert not any(item.command == Command.DO_CHANGE_SPEED for item in wide.items)


def test_where_no_route_can_be_driven_the_error_says_what_the_widest_keeps() -> None:
    walls = [box(OUT, -3, -60, 3, -2.5), box(OUT, -3, 2.5, 3, 60)]
    situation = facing(situation_of(box(IN, -60, -60, 60, 60), *walls, WP_SPEED=5.0), -50, 0, 90.0)
    with pytest.raises(
        NoRouteError,
        match=r"no route keeps 2.4 m while driving; the widest keeps 2.2\d m \(2.50 m along straight legs\), narrowest between "
        "exclusion polygon . and exclusion polygon . at ",
    ) as caught:
        plan(situation, Request(targets=(place(50, 0),), clearance_m=2.4))
    assert caught.value.details["widest_drawn_m"] == pytest.approx(2.5, abs=0.02)
    assert set(caught.value.details["fences"]) == {"exclusion polygon 1", "exclusion polygon 2"}
    at = Point(Chart(HOME).points([LatLon(*caught.value.details["narrowest_at"])])[0])
    assert all(Chart(HOME).zone_line(wall).distance(at) == pytest.approx(2.5, abs=0.02) for wall in walls)
    widest = plan(situation, Request(targets=(place(50, 0),), widest=True))
    assert_driven(widest, 90.0)
    assert widest.clearance_m == pytest.approx(caught.value.details["widest_m"], abs=0.001)


def test_a_corner_that_refuses_is_named() -> None:
    """A passage that bends by 150 degrees in little room: steered wheels cannot."""
    walls = [box(OUT, -60, -1, 54.2, 1), box(OUT, -60, 7, 60, 60), box(OUT, -60, -60, 60, -7)]
    situation = facing(
        situation_of(box(IN, -60, -60, 60, 60), *walls, WP_SPEED=5.0, WP_RADIUS=3.0), -40, -4, 90.0
    )
    with pytest.raises(NoRouteError, match=r"no route keeps 2\.62 m while driving") as caught:
        plan(situation, Request(targets=(place(-40, 4),), clearance_m=2.62))
    assert caught.value.details["clearance_m"] == 2.62
    details = caught.value.details
    assert details["kept_m"] < 2.62
    assert details["fences"]
    assert Point(Chart(HOME).points([LatLon(*details["corner"])])[0]).distance(Point(57, 0)) < 15.0


@settings(max_examples=25, deadline=None, suppress_health_check=list(HealthCheck))
@given(random_fields())
def test_every_driven_plan_of_a_random_field_keeps_its_promise(field: RandomField) -> None:
    situation = Situation(
        fence=Known(field.fence, None, "test"),
        parameters={"WP_SPEED": 2.0, "WP_RADIUS": 2.0, "FENCE_ENABLE": 0.0},
    )
    try:
        result = plan(situation, Request(field.start, (field.target,), field.clearance_m))
    except RouteError:
        return
    if any("leads away" in warning for warning in result.warnings):
        return
    line = LineString(Chart(result.ground.frame.origin).points(result.path))
    assert result.driven_clearance_m >= field.clearance_m
    assert result.drawn_clearance_m >= field.clearance_m
    assert line.length == pytest.approx(result.length_m, rel=1e-3)


class TestClearance:
    """What is required."""

    def test_the_position_error_comes_from_the_fix(self) -> None:
        situation = facing(situation_of(FIELD, WALL, WP_SPEED=2.0), -50, 0, 90.0)
        request = Request(targets=(place(50, 0),), clearance_m=2.0)
        for fix, error_m in [
            (Fix(6, 0.3), 0.3),
            (Fix(6), 0.05),
            (Fix(5), 0.3),
            (Fix(4), 0.6),
            (Fix(3), 1.5),
        ]:
            result = plan(replace(situation, fix=Known(fix, 0.0, "test")), request)
            assert result.clearance_m == 2.0
            assert result.asked_m == pytest.approx(2.0 + error_m)
            assert result.driven_clearance_m >= 2.0 + error_m
            assert any("m for GPS error" in text for text in result.info)
        none = plan(replace(situation, fix=Known(Fix(1), 0.0, "test")), request)
        assert none.asked_m == 2.0
        assert any("no 3D GPS fix" in warning for warning in none.warnings)
        told = plan(
            replace(situation, fix=Known(Fix(3), 0.0, "test")), replace(request, position_error_m=0.2)
        )
        assert told.asked_m == pytest.approx(2.2)

    def test_reserve_and_footprint(self) -> None:
        situation = facing(situation_of(FIELD, WALL, WP_SPEED=2.0), -50, 0, 90.0)
        request = Request(
            targets=(place(50, 0),), clearance_m=1.0, reserve_m=0.4, footprint=Footprint(4.0, 3.0)
        )
        result = plan(situation, request)
        assert result.clearance_m == pytest.approx(2.5)  # half the diagonal of 4 x 3 m
        assert result.asked_m == pytest.approx(2.9)
        assert any("raised" in warning for warning in result.warnings)

    def test_avoidance_raises_a_clearance_that_would_stop_the_vehicle(self) -> None:
        parameters = {
            "FENCE_ENABLE": 1.0,
            "FENCE_TYPE": 4.0,
            "FENCE_MARGIN": 2.0,
            "AVOID_ENABLE": 1.0,
            "WP_SPEED": 2.0,
        }
        situation = facing(situation_of(FIELD, WALL, **parameters), -50, 0, 90.0)
        request = Request(targets=(place(50, 0),), clearance_m=1.0)
        result = plan(situation, request)
        assert result.clearance_m == pytest.approx(2.1)
        assert any("raised to 2.1 m" in warning for warning in result.warnings)
        fixed = replace(situation, fix=Known(Fix(6, 0.3), 0.0, "test"))
        assert plan(fixed, replace(request, clearance_m=2.0)).clearance_m == 2.0
        assert plan(fixed, request).asked_m == pytest.approx(2.1)

    @pytest.mark.parametrize("speed_mps", [0.0, -1.0, math.inf, math.nan])
    def test_speeds_that_are_none(self, speed_mps: float) -> None:
        with pytest.raises(RequestError, match=r"speed_mps .*: expected a finite number above 0"):
            plan(situation_of(FIELD), Request(place(0, 0), (place(5, 5),), speed_mps=speed_mps))


def test_a_speed_asked_for_stands_first_in_the_mission() -> None:
    situation = facing(situation_of(FIELD, WALL, WP_SPEED=5.0), -50, 0, 90.0)
    result = plan(situation, Request(targets=(place(50, 0),), clearance_m=2.0, speed_mps=1.5))
    assert result.items[0].command == Command.DO_CHANGE_SPEED
    assert result.items[0].params[:2] == (1.0, 1.5)
    assert result.seqs[:2] == (0, 2)
    assert [result.path_index(seq) for seq in (0, 1, 2, 3)] == [0, 1, 1, 2]
    assert result.path_index(99) == len(result.path) - 1
    slow_s = result.duration_s
    fast = plan(situation, Request(targets=(place(50, 0),), clearance_m=2.0))
    assert slow_s > 2 * fast.duration_s


class TestStarts:
    """Leaving the start."""

    def test_a_start_too_near_a_fence_is_left_as_well_as_can_be_and_said(self) -> None:
        situation = facing(
            situation_of(FIELD, WALL, WP_SPEED=2.0), -8, 0, 90.0
        )  # 3 m from the wall, facing it
        result = plan(situation, Request(targets=(place(50, 0),), clearance_m=2.5))
        start_m = result.ground.clearance_m(Point(result.ground.frame.to_local(result.start)))
        assert result.drawn_clearance_m >= min(start_m, 2.5) - 0.02
        assert result.clearance_m == 2.5
        assert result.start_clearance_m is not None
        assert 0 < result.start_clearance_m < 2.5
        kept = f"while leaving it, the rover keeps at least {result.start_clearance_m:.2f} m"
        assert any(kept in warning for warning in result.warnings)
        assert result.driven_clearance_m >= result.start_clearance_m
        rest = result.envelope.waypoints > 2
        assert result.envelope.clearances_m(result.ground.edge)[rest].min() >= 2.5

    @pytest.mark.parametrize(("north_m", "heading_deg"), [(2.4, 110.0), (2.6, 140.0), (2.8, 210.0)])
    def test_turning_at_the_start_is_told_apart_also_on_a_straight_way_to_the_target(
        self, north_m: float, heading_deg: float
    ) -> None:
        """No leg leads away there: the fitted lines were finished, and then refused as a defect."""
        field = situation_of(box(IN, -60, 0, 60, 120))
        result = plan(
            facing(field, 0, north_m, heading_deg), Request(targets=(place(0, 60),), clearance_m=2.0)
        )
        assert result.clearance_m == 2.0
        assert result.start_clearance_m is not None
        assert len(result.items) == 1
        near_m = band_of(result, heading_deg).distance(fence_line(result))
        assert result.start_clearance_m - 0.02 <= near_m < 2.0
        kept = f"while leaving it, the rover keeps at least {result.start_clearance_m:.2f} m"
        assert any(kept in warning for warning in result.warnings)
        rest = result.envelope.waypoints > 0
        assert result.envelope.clearances_m(result.ground.edge)[rest].min() >= 2.0

    def test_the_widest_route_tells_apart_what_the_start_leaves(self) -> None:
        """From 4 m before a wall, facing it, no more than the turn leaves can be kept; beyond there is more room."""
        situation = facing(situation_of(FIELD, WALL, WP_SPEED=2.0), -9, 0, 90.0)
        result = plan(situation, Request(targets=(place(50, 0),), widest=True))
        start_m = result.ground.clearance_m(Point(result.ground.frame.to_local(result.start)))
        assert result.start_clearance_m is not None
        assert 0 < result.start_clearance_m < start_m < result.clearance_m
        assert band_of(result, 90.0).distance(fence_line(result)) >= result.start_clearance_m - 0.02
        assert not any("less than" in warning for warning in result.warnings)

    def test_without_a_heading_the_first_leg_is_taken_and_said(self) -> None:
        result = plan(situation_of(FIELD, WALL), Request(place(-50, 0), (place(50, 0),), 2.0))
        assert any("heading unknown" in warning for warning in result.warnings)
        assert_driven(result, None)


class TestEscape:
    """Out of forbidden ground."""

    @pytest.mark.parametrize("allowance_m", [None, 0.0])
    def test_the_shortest_straight_way_out(self, allowance_m: float | None) -> None:
        block = box(OUT, -20, -20, 20, 20)
        situation = situation_of(box(IN, -100, -100, 100, 100), block)
        request = Request(place(15, 5), (place(60, 50),), 2.0, corner_allowance_m=allowance_m)
        with pytest.raises(StartBlockedError, match="the allowed area is 5"):
            plan(situation, request)
        result = plan(situation, replace(request, escape=True))
        chart = Chart(HOME)
        first, second = chart.points(result.path[:2])
        assert math.dist(first, second) == pytest.approx(7.3 if allowance_m is None else 7.0, abs=0.1)
        rest = LineString(chart.points(result.path[1:]))
        assert rest.distance(chart.zone_line(block)) >= 2.0 - MERCATOR_TOLERANCE_M
        assert any("only leg 1, which leads there, is unsafe" in text for text in result.info)

    def test_not_across_other_forbidden_ground(self) -> None:
        ring = [
            box(OUT, 20.1, -30, 30, 30),
            box(OUT, -30, -30, -20.1, 30),
            box(OUT, -30, 20.1, 30, 30),
            box(OUT, -30, -30, 30, -20.1),
        ]
        situation = situation_of(box(IN, -100, -100, 100, 100), box(OUT, -20, -20, 20, 20), *ring)
        with pytest.raises(StartBlockedError, match="crosses another fence"):
            plan(situation, Request(place(0, 0), (place(60, 50),), 2.0, escape=True))


def test_targets_on_the_way_are_passed() -> None:
    situation = facing(situation_of(FIELD, WALL, WP_SPEED=2.0), -50, 0, 90.0)
    targets = (place(-30, 30), place(30, 30), place(50, 0))
    result = plan(situation, Request(targets=targets, clearance_m=2.0))
    visits = iter(result.path)
    assert all(target in visits for target in targets)
    assert_driven(result, 90.0)


def test_few_waypoints_round_a_circle() -> None:
    situation = facing(
        situation_of(FIELD, CircleZone(OUT, place(0, 0), 20.0), WP_SPEED=5.0, WP_RADIUS=3.0), -50, 0, 90.0
    )
    result = plan(situation, Request(targets=(place(50, 0),), clearance_m=2.0))
    assert len(result.path) <= 7
    legs_m = [math.dist(a, b) for a, b in itertools.pairwise(Chart(HOME).points(result.path))]
    assert min(legs_m) > 3.0
    assert np.isfinite(result.duration_s)


@pytest.mark.parametrize("radius_m", [12.0, 20.0])
def test_a_circle_beside_the_way_is_passed_at_speed(radius_m: float) -> None:
    """Two corners close together took 4 to 5 s more than one a little farther out: a short leg is driven slowly."""
    tree = CircleZone(OUT, place(0, 4 - radius_m if radius_m < 15 else 5 - radius_m), radius_m)
    situation = facing(situation_of(FIELD, tree, WP_SPEED=5.0, WP_RADIUS=3.0), -60, 0, 90.0)
    result = plan(situation, Request(targets=(place(60, 0),), clearance_m=2.0))
    assert_driven(result, 90.0)
    # At full speed all the way: ramps of 1 m/s² and 1 m/s³, and a second each at start and end.
    assert result.duration_s < 1.02 * (result.length_m / 5.0 + 6.0 + 2.0)


def test_a_start_that_nothing_mends_is_refused_without_trying_it_slowly(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def never(*_: object) -> None:
        raise AssertionError("a vehicle swings as far when it turns slowly")

    lane = box(IN, -2.9, -60, 2.9, 60)
    situation = facing(situation_of(lane, **VEHICLES[1]), 0, 40, 0.0)
    monkeypatch.setattr(RouteSearch, "_slowly", never)
    monkeypatch.setattr(RouteSearch, "_other_ways", never)
    with pytest.raises(NoRouteError, match="at the start this vehicle would come as near as") as caught:
        plan(situation, Request(targets=(place(0, -50),), clearance_m=1.0))
    assert "turn it by hand" in str(caught.value.details["advice"])


def test_where_no_clearance_helps_the_advice_is_another(monkeypatch: pytest.MonkeyPatch) -> None:
    """A lane too narrow to turn in, and the vehicle faces the wrong end of it: asked once for the most, and once for none."""
    asked_m = []
    search = PromisedRoute._search

    def counted(self: PromisedRoute, required_m: float, enough_m: float) -> RouteSearch:
        asked_m.append(required_m)
        return search(self, required_m, enough_m)

    monkeypatch.setattr(PromisedRoute, "_search", counted)
    lane = box(IN, -1.6, -60, 1.6, 60)
    situation = facing(situation_of(lane, **VEHICLES[0]), 0, 40, 0.0)
    with pytest.raises(NoRouteError, match=r"this vehicle would come as near as 0\.00 m") as caught:
        plan(situation, Request(targets=(place(0, -50),), widest=True))
    assert str(caught.value.details["advice"]).startswith(
        "less clearance does not help this vehicle: turn it"
    )
    assert asked_m[0] == pytest.approx(1.3, abs=0.05)
    assert 0.0 in asked_m


def test_a_gap_that_no_clearance_lets_this_vehicle_through_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    def refused(*_: object) -> NoRoute:
        return NoRoute(NoRouteKind.CORNER, "none of the shares")

    monkeypatch.setattr(PromisedRoute, "widest", refused)
    walls = [box(OUT, -3, -60, 3, -2.5), box(OUT, -3, 2.5, 3, 60)]
    situation = facing(situation_of(box(IN, -60, -60, 60, 60), *walls, WP_SPEED=5.0), -50, 0, 90.0)
    with pytest.raises(
        NoRouteError, match=r"the widest keeps 2.50 m.*, and this vehicle can drive none .* at any clearance"
    ) as caught:
        plan(situation, Request(targets=(place(50, 0),), clearance_m=2.4))
    assert "widen the narrowest place" in str(caught.value.details["advice"])


def test_a_target_that_no_clearance_frees_has_its_own_advice() -> None:
    situation = facing(situation_of(FIELD, WALL), -50, 0, 90.0)
    with pytest.raises(
        TargetBlockedError, match=r"the target is inside exclusion polygon 1 \(.*\);"
    ) as caught:
        plan(situation, Request(targets=(place(0, 0),), widest=True))
    assert "advice" not in caught.value.details


def counted(monkeypatch: pytest.MonkeyPatch) -> Counter[str]:
    """Count how often free space is computed, from nothing or with one place more; and how often the widest way is looked for."""
    counts: Counter[str] = Counter()
    made, added, widest = pbpp.Planner.__init__, pbpp.Planner.with_exclusion, pbpp.widest

    def counting(name: str, function: Callable[..., Any]) -> Callable[..., Any]:
        def call(*arguments: object, **options: object) -> object:
            counts[name] += 1
            return function(*arguments, **options)

        return call

    monkeypatch.setattr(pbpp.Planner, "__init__", counting("whole", made))
    monkeypatch.setattr(pbpp.Planner, "with_exclusion", counting("one place more", added))
    monkeypatch.setattr(pbpp, "widest", counting("widest", widest))
    return counts


def test_free_space_is_computed_once_for_each_band(monkeypatch: pytest.MonkeyPatch) -> None:
    counts = counted(monkeypatch)
    situation = situation_of(FIELD, WALL, **VEHICLES[0])
    plan(situation, Request(place(-50, 0), (place(50, 0),), 2.0))
    assert counts == {"whole": 2}  # at full speed's band and at the slow one's
    counts.clear()
    plan(situation, Request(place(-50, 0), (place(50, 0),), 2.0, corner_allowance_m=0.0))
    assert counts == {"whole": 1}


def test_a_place_more_is_added_to_the_free_space_that_is_there(monkeypatch: pytest.MonkeyPatch) -> None:
    situation = situation_of(FIELD, WALL)
    ground = ground_for(situation, vehicle_from_parameters({}), [place(-50, 0), place(50, 0)])
    ends = [ground.frame.to_local(place(east_m, 0)) for east_m in (-50, 50)]
    counts = counted(monkeypatch)
    routes = DrawnRoutes.at(Sought(ground, ends[0], ends[1:]), 2.0)
    straight = routes.find()
    square = LineString(straight.points).interpolate(0.5, normalized=True).buffer(3.0, cap_style="square")
    other = routes.around(square).find()
    assert counts == {"whole": 1, "one place more": 1}
    assert LineString(other.points).distance(square) >= 2.0 - 1e-6
    inclusions, exclusions = (ground.areas(kind) for kind in (IN, OUT))
    scratch = pbpp.Planner(inclusions, [*exclusions, square], clearance_m=2.0).plan(*ends)
    assert scratch.points.tolist() == other.points.tolist()


def test_other_ways_and_first_legs_are_drawn_in_the_free_space_that_is_there(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Each once took its own: up to five ways round, and 72 first legs. Seven more clearances are drawn at, to see where routes begin otherwise."""
    counts = counted(monkeypatch)
    lane = box(IN, -2.9, -60, 2.9, 60)
    facing_away = facing(situation_of(lane, **VEHICLES[1]), 0, 40, 0.0)
    with pytest.raises(NoRouteError, match="at the start this vehicle would come as near as"):
        plan(facing_away, Request(targets=(place(0, -50),), clearance_m=1.0))
    assert counts["whole"] <= 2 * (1 + 7 + 2)
    assert counts["widest"] <= 1


def test_the_widest_way_is_looked_for_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """It was for each band that is too wide, and again for what the error says of it."""
    counts = counted(monkeypatch)
    walls = [box(OUT, -3, -60, 3, -2.5), box(OUT, -3, 2.5, 3, 60)]
    situation = facing(situation_of(box(IN, -60, -60, 60, 60), *walls, WP_SPEED=5.0), -50, 0, 90.0)
    with pytest.raises(NoRouteError, match="the widest keeps"):
        plan(situation, Request(targets=(place(50, 0),), clearance_m=2.4))
    assert counts["widest"] == 1
