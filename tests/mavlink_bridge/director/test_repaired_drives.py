"""Repaired missions driven to their end, in stepped time."""

from __future__ import annotations

from pathlib import Path

from director.conducting import Conductor

from mavlink_bridge.director import Director, Orders, State
from mavlink_bridge.mavlink import messages as m
from mavlink_bridge.simulator import SimulatedVehicle, SimulatorConfig
from missions.fence import fence_to_items
from missions.formats import read_fence, read_mission
from missions.geo import LatLon, distance_m
from missions.items import Command, CoordinateFrame, MissionItem
from missions.planning.plan import plan
from missions.request import Request

FIELDS = Path(__file__).parents[2] / "fields"
HOME = LatLon(40.071374, -105.229930)
FIRST, LAST = read_mission(FIELDS / "yard-mission.waypoints").items


def do(command: int, *params: float) -> MissionItem:
    return MissionItem(command, CoordinateFrame.MISSION, (*params, 0.0, 0.0, 0.0, 0.0)[:4])


def conductor(*items: MissionItem) -> tuple[Conductor, SimulatedVehicle]:
    fence = fence_to_items(read_fence(FIELDS / "yard-fence.waypoints"))
    vehicle = SimulatedVehicle(
        SimulatorConfig(home=HOME, fence=fence, mission=items, parameters={"FENCE_ENABLE": 1.0})
    )
    orders = Orders(
        identity=(245, 190),
        request=Request(clearance_m=2.0, via_own=True),
        upload=True,
        drive=True,
        arm=True,
        once=True,
        target_sources=frozenset(),
    )
    return Conductor(Director(orders), [vehicle], planner=plan), vehicle


def test_the_vehicles_own_mission_with_a_jump_a_delay_and_a_condition():
    pause, wait = do(Command.NAV_DELAY, 1.0), do(Command.CONDITION_DELAY, 1.0)
    run, rover = conductor(FIRST, pause, wait, LAST, do(Command.DO_JUMP, 1.0, 1.0))
    assert run.run(1000.0) is State.DONE
    assert rover.breaches == 0
    assert rover.least_clearance_m >= 2.0
    commands = [item.command for item in rover.mission[1:]]
    assert [one for one in commands if one not in (16, 177, 178)] == [
        Command.NAV_DELAY,
        Command.CONDITION_DELAY,
    ]
    # It was watched there, back and there again, as the jump says.
    assert run.director.plan.length_m > 3 * distance_m(FIRST.position, LAST.position)
    assert rover.rover.mission_run.is_complete
    assert distance_m(rover.position, LAST.position) < 4.0


def test_the_end_is_seen_without_the_word_that_it_was_reached():
    run, rover = conductor(FIRST, LAST, do(Command.DO_JUMP, 1.0, 1.0))
    push = run.down.push
    run.down.push = lambda frame, now_s: (
        None if isinstance(frame.message, m.MissionItemReached) else push(frame, now_s)
    )
    assert run.run(1000.0) is State.DONE
    assert rover.rover.mission_run.is_complete


def test_a_click_on_the_way_makes_no_other_route():
    run, rover = conductor(FIRST, LAST)
    run.run_until(lambda: run.director.state is State.DRIVING)
    click = m.CommandInt(1, 1, 0, Command.DO_REPOSITION, x=400714000, y=-1052299000)
    run.director.receive(m.Frame(255, 190, click), run.now_s)
    assert run.run(1000.0) is State.DONE
    assert distance_m(rover.position, LAST.position) < 4.0
