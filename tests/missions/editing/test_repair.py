"""Missions repaired: what breaks is routed, everything else keeps its place and meaning."""

from __future__ import annotations

import itertools
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import pytest
from charts import HOME, IN, OUT, Chart, box, place
from shapely import LineString, Polygon

from missions.checking.check import check_mission
from missions.checking.execution import follow_mission
from missions.editing.repair import MOST_TRACKED_JUMPS, Repair, repair_mission, repaired_plan
from missions.errors import NoRouteError, PlanStoppedError, RouteError, SituationError, TargetBlockedError
from missions.fence import Fence, Zone
from missions.firmware import Firmware
from missions.formats import read_fence, read_mission
from missions.items import CoordinateFrame, MissionItem, change_speed, waypoint
from missions.planning.plan import plan
from missions.request import RepairMission, Request
from missions.situation import Known, Mission, Pose, Situation

if TYPE_CHECKING:
    from missions.geo import LatLon

MAP = Chart(HOME)


FIELD = box(IN, -60, -60, 160, 160)
BARN = box(OUT, 40, 20, 60, 40)


def situation_of(*zones: Zone, **parameters: float) -> Situation:
    return Situation(fence=Known(Fence(zones), None, "test"), parameters=parameters, firmware=Firmware(4, 6))


def go(east_m: float, north_m: float, *params: float, command: int = 16) -> MissionItem:
    return replace(
        waypoint(place(east_m, north_m)), command=command, params=(*params, 0.0, 0.0, 0.0, 0.0)[:4]
    )


def do(command: int, *params: float) -> MissionItem:
    return MissionItem(command, CoordinateFrame.MISSION, (*params, 0.0, 0.0, 0.0, 0.0)[:4])


def jump(seq: int, times: int) -> MissionItem:
    return do(177, seq, times)


SERVO, CAMERA = do(183, 1, 1500), do(203, 0, 0, 0, 1)
WEST, EAST = go(20, 30), go(80, 30)
"""On either side of the barn."""


def repair(*items: MissionItem, situation: Situation | None = None, **options) -> Repair:
    situation = situation or situation_of(FIELD, BARN)
    found = repair_mission(Mission(items, HOME), situation, Request(clearance_m=2.0, **options))
    assert_holds(found, situation)
    return found


def assert_holds(found: Repair, situation: Situation) -> None:
    """Measure what is driven, and check it as any other mission."""
    assert_clear_of_barns(found, situation, HOME)
    assert check_mission(found.mission, situation, Request(clearance_m=2.0)).holds
    assert not follow_mission(found.mission, HOME, home=HOME).troubles


def assert_clear_of_barns(found: Repair, situation: Situation, start: LatLon) -> None:
    """Measure the drawn lines in the test's own map."""
    barns = [Polygon(MAP.points(zone.vertices)) for zone in situation.fence.value.zones if zone.kind is OUT]
    for leg in follow_mission(found.mission, start, home=HOME).legs:
        line = LineString(MAP.points([leg.start, leg.end]))
        assert all(line.distance(barn) >= 2.0 for barn in barns)


def kept(found: Repair, *items: MissionItem) -> list[int]:
    """Where the given items are now, which must be in their order."""
    places = []
    for item in items:
        begin = places[-1] + 1 if places else 0
        places.append(found.mission.items.index(item, begin))
    return places


def visits(found: Repair, *places: MissionItem) -> list[int]:
    """Which of some places are driven to, in the order in which they are."""
    course = follow_mission(found.mission, HOME, home=HOME)
    numbers = {item.position: number for number, item in enumerate(places)}
    return [numbers[leg.end] for leg in course.legs if leg.end in numbers]


def test_a_leg_through_the_barn_gets_a_route():
    found = repair(WEST, EAST)
    assert kept(found, WEST, EAST)[0] == 0
    assert len(found.mission.items) > 2
    assert all(item.command == 16 for item in found.mission.items)
    assert found.changes[0].startswith("leg 1 → 2: replaced by a route with ")


def test_the_recorded_mission_through_the_barn(fields):
    mission = read_mission(fields / "yard-mission.waypoints")
    situation = Situation(fence=Known(read_fence(fields / "yard-fence.waypoints"), None, "file"))
    found = repair_mission(mission, situation, Request(clearance_m=2.0))
    assert found.check.holds
    assert found.mission.items[0] == mission.items[0]
    assert found.mission.items[-1] == mission.items[-1]
    assert found.mission.home == mission.home


def test_a_mission_that_holds_stays_as_it_is():
    items = (go(0, 20), do(178, 1, 1.5), go(0, 60, 3.0), jump(1, 2), go(20, 60))
    found = repair(*items)
    assert found.mission.items == items
    assert found.changes == ()


def test_commands_keep_their_places():
    first, second, third = go(0, 30), EAST, go(80, 60, 4.0)
    found = repair(first, CAMERA, second, SERVO, third)
    at = kept(found, first, CAMERA, second, SERVO, third)
    # The camera clicks as the first place is reached, the servo moves at the second.
    assert at[1] == at[0] + 1
    assert at[3:] == [at[2] + 1, at[2] + 2]


def test_speeds_stay_those_of_the_mission():
    slow = do(178, 1, 1.0)
    found = repair(go(0, 30), slow, EAST, do(178, 1, 1.8), go(120, 30))
    course = follow_mission(found.mission, HOME, home=HOME)
    by_end = {leg.end: leg.speed_mps for leg in course.legs}
    assert by_end[EAST.position] <= 1.0
    assert by_end[place(120, 30)] == 1.8
    between = [leg for leg in course.legs if leg.end not in (place(0, 30), place(120, 30))]
    assert all(leg.speed_mps is not None and leg.speed_mps <= 1.0 for leg in between)


def test_a_condition_on_the_distance_stays_with_its_place():
    near = do(114, 3.0)
    found = repair(go(0, 30), CAMERA, near, SERVO, EAST)
    at = kept(found, go(0, 30), CAMERA, near, SERVO, EAST)
    assert at[1] == 1
    assert at[2:] == [at[4] - 2, at[4] - 1, at[4]]
    assert at[2] > at[1] + 1


def test_several_legs_are_routed():
    found = repair(WEST, EAST, WEST, EAST)
    assert visits(found, WEST, EAST) == [0, 1, 0, 1]
    assert len(found.changes) == 3


def test_the_first_leg_starts_where_the_vehicle_is():
    pose = Known(Pose(place(20, 30), 90.0), None, "test")
    situation = replace(situation_of(FIELD, BARN), pose=pose)
    found = repair_mission(Mission((EAST,), HOME), situation, Request(clearance_m=2.0))
    assert found.check.legs[0].leg.start == place(20, 30)
    assert found.check.holds
    assert found.mission.items[-1] == EAST
    assert found.changes[0].startswith("leg start → 1")


@pytest.mark.parametrize("times", [1, 2, 4])
def test_a_jump_back_through_the_barn(times):
    north_west, north_east, after = go(20, 60), go(80, 60), go(120, 30)
    found = repair(WEST, north_west, north_east, EAST, jump(1, times), after)
    assert visits(found, WEST, north_west, north_east, EAST, after) == [0, 1, 2, 3] * (times + 1) + [4]
    # The way round the barn is driven as often as the jump is taken, never on the way on.
    ends = [leg.end for leg in follow_mission(found.mission, HOME, home=HOME).legs]
    known = {item.position for item in (WEST, north_west, north_east, EAST, after)}
    detour = {end for end in ends if end not in known}
    assert detour
    assert all(ends.count(end) == times for end in detour)
    assert ends[-2:] == [EAST.position, after.position]


def test_a_jump_back_without_end():
    found = repair(WEST, go(20, 60), go(80, 60), EAST, jump(1, -1))
    course = follow_mission(found.mission, HOME, home=HOME)
    assert course.is_endless
    assert visits(found, WEST, EAST) == [0, 1, 0, 1]


def test_jump_targets_are_renumbered():
    found = repair(WEST, EAST, go(100, 60), jump(2, 1), go(120, 60))
    again = next(item for item in found.mission.items if item.command == 177)
    assert found.mission.items[int(again.params[0]) - 1] == EAST
    assert visits(found, WEST, EAST, go(100, 60), go(120, 60)) == [0, 1, 2, 1, 2, 3]


def test_a_jump_to_a_tag_through_the_barn():
    tag = do(600, 5)
    found = repair(tag, WEST, go(20, 60), go(80, 60), EAST, do(601, 5, 2), go(120, 30))
    assert visits(found, WEST, EAST, go(120, 30)) == [0, 1, 0, 1, 0, 1, 2]


def test_what_a_jump_leads_to_before_a_place_is_no_part_of_the_route():
    # The jump leads to the servo command, from a place that needs no way round the barn.
    found = repair(WEST, CAMERA, SERVO, EAST, go(80, 60), jump(3, 1), go(120, 60))
    again = next(item for item in found.mission.items if item.command == 177)
    servo = int(again.params[0])
    assert found.mission.items[servo - 1 : servo + 1] == (SERVO, EAST)
    assert visits(found, WEST, EAST, go(120, 60)) == [0, 1, 1, 2]


def test_rtl_gets_a_way_home():
    found = repair(go(100, 60), do(20))
    assert found.mission.items[-1] == do(20)
    assert found.mission.items[-2].position == HOME
    assert found.check.legs[-1].length_m == 0


def test_a_blocked_place_is_refused_or_moved():
    inside = go(50, 39, 2.0)
    with pytest.raises(TargetBlockedError, match=r"^leg start → 1.*: the target is inside"):
        repair(inside, go(50, 80))
    found = repair(inside, go(50, 80), snap_m=6.0)
    moved = found.mission.items[-2]
    assert moved.params == inside.params
    assert moved.position != inside.position
    assert any(text.startswith("item 1 is blocked by a fence: moved ") for text in found.changes)


def test_ground_without_a_way_is_refused():
    walls = (
        box(OUT, 70, 10, 74, 50),
        box(OUT, 86, 10, 90, 50),
        box(OUT, 70, 50, 90, 54),
        box(OUT, 70, 6, 90, 10),
    )
    with pytest.raises(RouteError, match="leg 1 → 2: "):
        repair(WEST, EAST, situation=situation_of(FIELD, *walls))


def test_what_is_not_understood_cannot_be_repaired():
    with pytest.raises(SituationError, match="cannot be repaired: item 2 is command 82"):
        repair(WEST, go(50, 70, command=82), EAST)


def test_a_circle_that_breaks_cannot_be_repaired():
    with pytest.raises(NoRouteError, match="cannot be repaired: near leg"):
        repair(go(66, 30, 1.0, 0.0, 6.0, command=18), go(120, 30))


def test_more_jumps_than_the_autopilot_counts_are_refused():
    loops = [item for _ in range(MOST_TRACKED_JUMPS + 1) for item in (go(0, 60), jump(1, 0))]
    with pytest.raises(SituationError, match=f"has {MOST_TRACKED_JUMPS + 1} jumps"):
        repair(WEST, EAST, *loops)


def test_a_repaired_mission_is_a_plan():
    situation = situation_of(FIELD, BARN)
    asked = Request(clearance_m=2.0, via=Mission((WEST, SERVO, EAST), HOME))
    made = plan(situation, asked)
    assert SERVO in made.items
    assert made.path[0] == HOME
    assert made.path[-1] == EAST.position
    assert made.driven_clearance_m >= 1.99
    assert made.info[0].startswith("leg 1 → 3: ")
    assert repaired_plan(situation, asked).items == made.items


def test_corners_beside_a_route_are_looked_at_again():
    # Fast and with a wide radius: the route's own corners and those at the given places bear upon one another.
    fast = situation_of(FIELD, BARN, WP_SPEED=5, WP_RADIUS=3, SERVO1_FUNCTION=26, SERVO3_FUNCTION=70)
    found = repair(WEST, go(50, 44), EAST, go(50, 15), WEST, situation=fast)
    assert visits(found, WEST, go(50, 44), EAST, go(50, 15)) == [0, 1, 2, 3, 0]


def test_slow_stretches_and_stops_of_a_route_end_with_it(monkeypatch):
    def slow_to_the_end(*arguments, **options):
        made = plan(*arguments, **options)
        last = replace(made.items[-1], params=(1.0, 0.0, 0.0, 0.0))
        return replace(
            made,
            items=(*made.items[:-1], change_speed(0.5), last),
            seqs=(*made.seqs[:-1], made.seqs[-1] + 1),
            speeds=(*made.speeds[:-1], 0.5),
        )

    monkeypatch.setattr("missions.editing.repair.plan_route", slow_to_the_end)
    found = repair(WEST, EAST, SERVO, go(120, 30))
    stopping = replace(EAST, params=(1.0, 0.0, 0.0, 0.0))
    at = kept(found, change_speed(0.5), stopping, change_speed(2.0), SERVO, go(120, 30))
    assert at == list(range(at[0], at[0] + 5))
    assert "item 2: the vehicle now waits 1 s there, to turn from standstill" in found.changes
    assert found.check.legs[-1].leg.speed_mps == 2.0


def test_two_items_in_one_blocked_place_are_moved_together():
    found = repair(go(50, 39), go(50, 39), go(50, 80), snap_m=6.0)
    first, again = found.mission.items[-3:-1]
    assert first.position == again.position != place(50, 39)


VEHICLES = (
    {},
    {"WP_SPEED": 5, "WP_RADIUS": 3, "SERVO1_FUNCTION": 26, "SERVO3_FUNCTION": 70},
    {"WP_SPEED": 2, "SERVO1_FUNCTION": 73, "SERVO3_FUNCTION": 74},
)


def random_mission(seed: int) -> tuple[Situation, tuple[MissionItem, ...]]:
    random = np.random.default_rng(seed)
    corners = random.uniform(-40, 120, (5, 2))
    sizes = random.uniform(5, 25, (5, 2))
    barns = [box(OUT, *corner, *(corner + size)) for corner, size in zip(corners, sizes, strict=True)]
    places = [go(*random.uniform(-50, 150, 2), random.choice([0.0, 0.0, 3.0])) for _ in range(6)]
    back = jump(4, int(random.integers(-1, 3)))
    items = (*places[:2], do(178, 1, 1.5), *places[2:4], SERVO, places[4], back, places[5])
    return situation_of(FIELD, *barns, **VEHICLES[seed % 3]), items


def test_random_missions_in_random_fields():
    refused = []
    start = place(-55, -55)
    for seed in (0, *range(2, 6), *range(7, 19)):  # 1 and 6 take seven times as long as all others together
        situation, items = random_mission(seed)
        asked = Request(start=start, clearance_m=2.0, snap_m=40.0)
        try:
            found = repair_mission(Mission(items, HOME), situation, asked)
        except RouteError:  # a place so near to fences that the vehicle cannot turn there
            refused.append(seed)
            continue
        assert check_mission(found.mission, situation, Request(start, clearance_m=2.0)).holds
        assert_clear_of_barns(found, situation, start)
        kept(found, do(178, 1, 1.5), SERVO)
        before, after = (follow_mission(Mission(one, HOME), start) for one in (items, found.mission.items))
        assert after.is_endless == before.is_endless
        assert len(after.legs) >= len(before.legs)
    assert len(refused) <= 2


def test_legs_that_need_their_neighbours_corner_to_move_are_repaired_together():
    situation, items = random_mission(37)  # leg 4 → 5 by itself ends where this vehicle cannot turn
    asked = Request(start=place(-55, -55), clearance_m=2.0, snap_m=40.0)
    assert repair_mission(Mission(items, HOME), situation, asked).check.holds


def test_a_repair_that_is_stopped_ends_with_one_error():
    asked = itertools.count(1)
    through = Mission((WEST, EAST), HOME)
    with pytest.raises(PlanStoppedError, match="no longer needed"):
        repair_mission(
            through,
            situation_of(FIELD, BARN),
            RepairMission(clearance_m=2.0),
            should_stop=lambda: next(asked) >= 3,
        )
    assert next(asked) == 4
