"""Several targets: the order by routes around fences, the way home, the end."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise, permutations
from typing import TYPE_CHECKING

import numpy as np
import pytest
import shapely
from charts import HOME, IN, OUT, Chart, box, place
from shapely import LineString, Polygon

from missions.checking.check import check_mission
from missions.errors import NoRouteError, SituationError, TargetBlockedError
from missions.fence import Fence, Zone
from missions.firmware import Firmware
from missions.items import Command
from missions.planning.plan import plan
from missions.request import Request, Tour
from missions.situation import Known, Mission, Situation
from missions.tour.tour import route_lengths_m, target_order

if TYPE_CHECKING:
    from missions.geo import LatLon

MAP = Chart(HOME)


FIELD = box(IN, -60, -60, 160, 160)
WALL = box(OUT, 40, -40, 44, 160)
"""A wall from the field's north edge, open in the south: its neighbours across it are far away."""


def situation_of(*zones: Zone, home: LatLon | None = HOME, **parameters: float) -> Situation:
    return Situation(
        fence=Known(Fence(zones), None, "test"),
        parameters=parameters,
        firmware=Firmware(4, 6),
        home=Known(home, None, "test") if home else None,
    )


def plane(places: list[LatLon]) -> np.ndarray:
    lat_lon = np.array(places)
    return MAP.points(lat_lon)


WALLED = situation_of(FIELD, WALL)
NEAR_BUT_BEHIND = place(50, 100)
FAR_BUT_HERE = place(-50, 100)
SOUTH = place(42, -50)


def request(*targets: LatLon, **options) -> Request:
    return Request(HOME, targets, 2.0, **options)


def through_gap_m(a: LatLon, b: LatLon, clearance_m: float) -> float:
    """The way round the wall's south end, by the test's own map: over two corners of the widened wall."""
    wall = Polygon(plane(list(WALL.vertices))).buffer(clearance_m, join_style="mitre")
    west, south, east, _ = wall.bounds
    points = [plane([a])[0], (west, south), (east, south), plane([b])[0]]
    if points[0][0] > points[3][0]:
        points[1], points[2] = points[2], points[1]
    ways = [[0, 1, 2, 3], [0, 1, 3], [0, 2, 3]]
    lines = [LineString([points[i] for i in way]) for way in ways]
    return min(line.length for line in lines if not line.crosses(wall.buffer(-1e-6)))


def test_lengths_go_round_the_fences():
    lengths_m = route_lengths_m(
        WALLED, request(corner_allowance_m=0.0), [HOME, NEAR_BUT_BEHIND, FAR_BUT_HERE]
    )
    assert np.allclose(lengths_m, lengths_m.T)
    assert lengths_m[0, 2] == pytest.approx(np.hypot(50, 100), abs=0.01)
    assert lengths_m[0, 1] == pytest.approx(through_gap_m(HOME, NEAR_BUT_BEHIND, 2.0), abs=0.02)
    assert lengths_m[2, 1] == pytest.approx(through_gap_m(FAR_BUT_HERE, NEAR_BUT_BEHIND, 2.0), abs=0.02)


@pytest.mark.parametrize("comes_back", [False, True])
def test_the_best_order_is_the_shortest_of_all_plans(comes_back):
    targets = (NEAR_BUT_BEHIND, FAR_BUT_HERE, place(30, 100), place(60, -20))
    asked = request(*targets, corner_allowance_m=0.0, comes_back=comes_back)
    found = target_order(WALLED, asked)
    homewards = (HOME,) if comes_back else ()
    lengths_m = {
        order: plan(WALLED, replace(asked, targets=(*(targets[i] for i in order), *homewards))).length_m
        for order in permutations(range(4))
    }
    assert lengths_m[found.indices] == pytest.approx(min(lengths_m.values()), rel=1e-3)
    assert found.length_m == pytest.approx(min(lengths_m.values()), rel=1e-3)
    assert found.given_m == pytest.approx(lengths_m[0, 1, 2, 3], rel=1e-3)
    assert found.bound_m == found.length_m


def test_the_nearest_as_the_crow_flies_may_come_last():
    made = plan(WALLED, request(NEAR_BUT_BEHIND, FAR_BUT_HERE, order="best"))
    assert [tuple(target) for target in made.targets] == [tuple(FAR_BUT_HERE), tuple(NEAR_BUT_BEHIND)]
    assert made.info[0].startswith("targets reordered: 2, 1 (")
    given = plan(WALLED, request(NEAR_BUT_BEHIND, FAR_BUT_HERE))
    assert given.targets == (NEAR_BUT_BEHIND, FAR_BUT_HERE)
    assert made.length_m < given.length_m


def test_an_order_that_was_best_already_needs_no_words():
    made = plan(WALLED, request(FAR_BUT_HERE, NEAR_BUT_BEHIND, order="best"))
    assert not any("order" in text for text in made.warnings)


def test_return_leads_home_else_to_the_start():
    away = place(-20, 40)
    made = plan(WALLED, replace(request(FAR_BUT_HERE, comes_back=True), start=away))
    assert made.path[-1] == HOME
    homeless = plan(
        situation_of(FIELD, WALL, home=None), replace(request(FAR_BUT_HERE, comes_back=True), start=away)
    )
    assert homeless.path[-1] == away
    assert homeless.length_m > 2 * 60


def test_ends():
    held = plan(WALLED, request(FAR_BUT_HERE))
    loitering = plan(WALLED, request(FAR_BUT_HERE, end="loiter"))
    assert [item.command for item in loitering.items[:-1]] == [item.command for item in held.items[:-1]]
    assert loitering.items[-1].command == Command.NAV_LOITER_UNLIM
    assert loitering.items[-1].position == held.items[-1].position == FAR_BUT_HERE


def test_a_steered_rover_stands_where_it_loiters_but_before_4_5():
    """tests/missions/drive_model/data/loiter_unlimited.csv; before 4.5 it goes on steering there, by its source."""
    loitering = plan(WALLED, request(FAR_BUT_HERE, end="loiter"))
    assert loitering.extrapolated == ()
    assert loitering.clearance_m == 2.0
    old = replace(WALLED, firmware=Firmware(4, 5))
    unsure = plan(old, request(FAR_BUT_HERE, end="loiter"))
    assert unsure.clearance_m is None
    assert [text[:56] for text in unsure.extrapolated] == [
        "ArduPilot before 4.5 goes on steering at LOITER_UNLIM, w"
    ]
    assert plan(old, request(FAR_BUT_HERE, end="loiter", trusts_model=True)).clearance_m == 2.0
    assert plan(old, request(FAR_BUT_HERE)).extrapolated == ()
    checked = check_mission(Mission(unsure.items, HOME), old, Request(clearance_m=2.0))
    assert checked.extrapolated == unsure.extrapolated
    assert checked.holds
    assert not checked.is_promised


def test_rtl_where_the_straight_line_home_is_free():
    held = plan(WALLED, request(FAR_BUT_HERE))
    returning = plan(WALLED, request(FAR_BUT_HERE, end="rtl"))
    assert returning.items[: len(held.items)] == held.items
    assert [item.command for item in returning.items[len(held.items) :]] == [Command.NAV_RETURN_TO_LAUNCH]
    assert returning.path == (*held.path, HOME)
    assert returning.seqs == (*held.seqs, len(returning.items))
    assert len(returning.speeds) == len(returning.path) - 1
    assert returning.length_m == pytest.approx(held.length_m + np.hypot(50, 100), abs=0.01)
    assert returning.duration_s > held.duration_s + 40
    wall = shapely.union_all(
        [Polygon(plane(list(WALL.vertices))), Polygon(plane(list(FIELD.vertices))).boundary]
    )
    lines = [LineString(plane(list(leg))) for leg in pairwise(returning.path)]
    assert returning.drawn_clearance_m == pytest.approx(min(line.distance(wall) for line in lines), abs=3e-3)


def test_rtl_through_a_wall_is_refused_unless_the_way_home_is_part_of_the_mission():
    with pytest.raises(
        NoRouteError, match=r"RTL at the end .* through exclusion polygon 1 at .*--return"
    ) as refused:
        plan(WALLED, request(NEAR_BUT_BEHIND, end="rtl"))
    assert refused.value.details["fences"] == ["exclusion polygon 1"]
    made = plan(WALLED, request(NEAR_BUT_BEHIND, end="rtl", comes_back=True))
    assert made.items[-1].command == Command.NAV_RETURN_TO_LAUNCH
    assert made.path[-2:] == (HOME, HOME)
    line = LineString(plane(list(made.path)))
    assert line.distance(Polygon(plane(list(WALL.vertices)))) > 2


def test_rtl_near_a_wall_is_refused_too():
    with pytest.raises(NoRouteError, match=r"m of exclusion polygon 1"):
        plan(situation_of(FIELD, box(OUT, 2.2, 30, 6, 40)), request(place(0, 80), end="rtl"))
    drawn = request(place(0, 80), end="rtl", corner_allowance_m=0.0)
    made = plan(situation_of(FIELD, box(OUT, 2.2, 30, 6, 40)), drawn)
    assert made.drawn_clearance_m == pytest.approx(2.2, abs=0.01)


def test_rtl_without_a_home_is_refused():
    with pytest.raises(SituationError, match="home, which is unknown"):
        plan(situation_of(FIELD, home=None), request(FAR_BUT_HERE, end="rtl"))


def test_a_target_that_cannot_be_reached_is_named():
    island = (
        box(OUT, 90, 20, 100, 100),
        box(OUT, 130, 20, 140, 100),
        box(OUT, 90, 100, 140, 110),
        box(OUT, 90, 10, 140, 20),
    )
    with pytest.raises(NoRouteError, match=r"to target 2 \(") as refused:
        plan(situation_of(FIELD, *island), request(FAR_BUT_HERE, place(115, 60), order="best"))
    assert refused.value.details["target"] == list(place(115, 60))


def test_a_blocked_target_is_told_by_the_plan():
    with pytest.raises(TargetBlockedError, match=r"the target is inside exclusion polygon 1 \(.*\);"):
        plan(WALLED, request(place(42, 60), FAR_BUT_HERE, order="best"))
    made = plan(WALLED, request(place(39, 60), FAR_BUT_HERE, order="best", snap_m=5.0))
    assert len(made.targets) == 2


def test_the_widest_routes_can_be_ordered_too():
    made = plan(WALLED, Tour(start=HOME, targets=(NEAR_BUT_BEHIND, FAR_BUT_HERE), order="best", widest=True))
    assert made.targets[0] == FAR_BUT_HERE


def test_one_target_needs_no_order():
    made = plan(WALLED, request(FAR_BUT_HERE, order="best"))
    assert made.path == plan(WALLED, request(FAR_BUT_HERE)).path
    newest = replace(WALLED, target=Known(FAR_BUT_HERE, None, "test"))
    assert plan(newest, Request(clearance_m=2.0)).targets == (FAR_BUT_HERE,)


def test_fifteen_targets():
    pytest.importorskip("highspy")
    generator = np.random.default_rng(4)
    targets = [place(*point) for point in generator.uniform(-40, 30, (15, 2))]
    found = target_order(WALLED, request(*targets))
    assert sorted(found.indices) == list(range(15))
    assert found.length_m < found.given_m
    assert found.bound_m == pytest.approx(found.length_m)


@pytest.mark.parametrize("end", ["hold", "loiter", "rtl"])
def test_a_tour_outside_what_was_measured_is_planned_for_its_clearance_and_promises_nothing(end):
    asked = request(place(-30, 0), place(-30, 30), end=end)
    usual = plan(situation_of(FIELD, WALL), asked)
    found = plan(situation_of(FIELD, WALL, OA_TYPE=2.0), asked)
    assert usual.clearance_m is not None
    assert not usual.extrapolated
    assert found.clearance_m is None
    assert found.items == usual.items
    assert [text.split(":")[0] for text in found.extrapolated] == ["OA_TYPE 2"]
