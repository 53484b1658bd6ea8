"""The director against simulated rovers, in stepped time."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from director.conducting import Conductor

from mavlink_bridge.director import TRANSITIONS, Director, Orders, State
from mavlink_bridge.errors import LinkError, OutcomeError, RefusedError, VehicleNotFoundError
from mavlink_bridge.mavlink import messages as m
from mavlink_bridge.mavlink.rover import Mode
from mavlink_bridge.simulator import SimulatedVehicle, SimulatorConfig
from mavlink_bridge.simulator.faults import Faults
from missions.fence import fence_to_items
from missions.formats import read_fence
from missions.geo import LatLon, distance_m
from missions.items import Command, waypoint
from missions.request import Request

FENCE = fence_to_items(read_fence(Path(__file__).parents[2] / "fields" / "yard-fence.waypoints"))
HOME = LatLon(40.071374, -105.229930)
TARGET = LatLon(40.0720926, -105.2286152)
OLD_MISSION = (waypoint(LatLon(40.0713, -105.2300)), waypoint(LatLon(40.0714, -105.2300)))
REQUEST = Request(targets=(TARGET,), clearance_m=2.0)
IDENTITY = (245, 190)


def rover(**changes) -> SimulatedVehicle:
    config = {"home": HOME, "fence": FENCE, "mission": OLD_MISSION, "parameters": {"FENCE_ENABLE": 1.0}}
    return SimulatedVehicle(SimulatorConfig(**{**config, **changes}))


def conductor(*vehicles: SimulatedVehicle, faults: Faults | None = None, **orders) -> Conductor:
    given = {"identity": IDENTITY, "request": REQUEST, "upload": True, "once": True, **orders}
    return Conductor(Director(Orders(**given)), list(vehicles), faults or Faults())


def arm_and_auto(vehicle: SimulatedVehicle) -> None:
    for message in (
        m.CommandLong(1, 1, Command.COMPONENT_ARM_DISARM, param1=1.0),
        m.CommandLong(1, 1, Command.DO_SET_MODE, param1=1.0, param2=Mode.AUTO),
    ):
        vehicle.receive(m.Frame(255, 190, message), 0.1)
        vehicle.handle_timer(0.2)


def test_takes_a_mission_from_the_first_heartbeat_to_arrival():
    vehicle = rover()
    run = conductor(vehicle, drive=True, arm=True)
    assert run.run() is State.DONE
    assert run.director.upload_outcome.is_verified
    assert distance_m(vehicle.position, TARGET) < 4.0
    assert vehicle.breaches == 0
    assert vehicle.least_clearance_m >= 2.0
    assert run.backups == [run.director.upload_outcome.backup]
    assert [item.position for item in run.backups[0][1:]] == [item.position for item in OLD_MISSION]


def test_without_the_order_to_drive_it_ends_verified_and_touches_neither_mode_nor_arming():
    vehicle = rover()
    run = conductor(vehicle)
    mode = vehicle.mode
    assert run.run() is State.DONE
    assert (vehicle.mode, vehicle.is_armed) == (mode, False)
    assert vehicle.mission[-1].position == TARGET
    commands = {message.command for message in run.sent if isinstance(message, m.CommandLong)}
    assert commands == {Command.GET_HOME_POSITION, Command.REQUEST_MESSAGE}  # which vehicle it is


def test_learns_parameters_fence_mission_home_and_position():
    vehicle = rover()
    run = conductor(vehicle)
    run.run()
    situation = run.director.situation
    assert situation.parameters["WP_RADIUS"] == rover().parameters["WP_RADIUS"]
    assert len(situation.fence.value.zones) == 4
    assert [item.position for item in situation.mission.value.items] == [
        item.position for item in vehicle.mission[1:]
    ]
    assert (situation.ardupilot, situation.armed, situation.mode) == (True, False, vehicle.mode)
    assert distance_m(situation.home.value, HOME) < 0.02
    assert distance_m(situation.pose.value.position, HOME) < 1.0


def test_refuses_to_write_under_a_vehicle_armed_in_auto():
    vehicle = rover(mission=tuple(waypoint(LatLon(40.0713, -105.2300 - 0.0005 * i)) for i in range(5)))
    arm_and_auto(vehicle)
    before = vehicle.mission
    run = conductor(vehicle)
    assert run.run() is State.FAILED
    assert isinstance(run.director.trouble, RefusedError)
    assert "AUTO" in str(run.director.trouble)
    assert vehicle.mission == before


def test_hears_nobody():
    run = conductor()
    assert run.run() is State.FAILED
    assert isinstance(run.director.trouble, VehicleNotFoundError)
    assert run.now_s == pytest.approx(30.0, abs=0.1)
    assert not run.sent


def test_two_rovers_need_a_choice():
    run = conductor(rover(), rover(system=2))
    assert run.run() is State.FAILED
    assert "--system" in str(run.director.trouble)


def test_the_chosen_one_of_two_rovers_gets_the_mission():
    first, second = rover(), rover(system=2)
    before = first.mission
    assert conductor(first, second, system=2).run() is State.DONE
    assert first.mission == before
    assert second.mission[-1].position == TARGET


def test_waits_in_vain_for_a_chosen_vehicle_that_is_not_there():
    run = conductor(rover(), system=7)
    assert run.run() is State.FAILED
    assert "system 7 was not heard, only system 1" in str(run.director.trouble)


def test_no_position_is_told():
    run = conductor(rover(), patience_s=5.0)
    run.down.push = _without(run.down.push, m.GlobalPositionInt)
    assert run.run() is State.FAILED
    assert isinstance(run.director.trouble, LinkError)
    assert "no position" in str(run.director.trouble)


def test_a_plan_waits_for_the_fix_but_not_for_ever():
    late = conductor(rover())
    push = late.down.push
    late.down.push = lambda frame, now_s: (
        None if isinstance(frame.message, m.GpsRawInt) and now_s < 2.0 else push(frame, now_s)
    )
    assert late.run() is State.DONE
    assert late.director.situation.fix.value.error_m == 0.3
    assert any("added 0.3 m for GPS error" in text for text in late.director.plan.info)
    never = conductor(rover())
    never.down.push = _without(never.down.push, m.GpsRawInt)
    assert never.run() is State.DONE
    assert any("GPS accuracy unknown" in text for text in never.director.plan.warnings)


def test_learns_how_much_the_vehicle_holds():
    run = conductor(rover(parameters={"BRD_SD_MISSION": 64.0}))
    run.run()
    assert run.director.situation.parameters["BRD_SD_MISSION"] == 64


def test_a_vehicle_that_falls_silent_after_its_heartbeat():
    run = conductor(rover())
    run.down.push = _only(run.down.push, m.Heartbeat)
    assert run.run() is State.FAILED
    assert isinstance(run.director.trouble, LinkError)


def test_somebody_else_takes_the_vehicle_out_of_auto():
    vehicle = rover()
    run = conductor(vehicle, drive=True, arm=True)

    def hold(run: Conductor) -> None:
        if run.director.state is State.DRIVING and run.director.drive.item > 1:
            run.vehicles[0].receive(m.Frame(255, 190, m.SetMode(1, 1, Mode.HOLD)), run.now_s)

    run.meddle = hold
    assert run.run() is State.FAILED
    assert isinstance(run.director.trouble, OutcomeError)
    assert "went to HOLD by itself or by somebody not heard on this link, such as an RC transmitter" in str(
        run.director.trouble
    )
    assert vehicle.mode == Mode.HOLD


def test_does_not_arm_unasked():
    vehicle = rover()
    run = conductor(vehicle, drive=True)
    assert run.run() is State.FAILED
    assert not vehicle.is_armed
    assert "not armed" in str(run.director.trouble)


def test_a_refused_command_says_which():
    vehicle = rover()
    run = conductor(vehicle, drive=True, arm=True)
    push = run.down.push

    def deny(frame, now_s):
        message = frame.message
        if isinstance(message, m.CommandAck) and message.command == Command.COMPONENT_ARM_DISARM:
            frame = replace(frame, message=replace(message, result=m.MavResult.DENIED))
        push(frame, now_s)

    run.down.push = deny
    assert run.run() is State.FAILED
    assert isinstance(run.director.trouble, RefusedError)
    assert "COMPONENT_ARM_DISARM" in str(run.director.trouble)
    assert vehicle.mission[-1].position == TARGET


@pytest.mark.parametrize("seed", range(1, 4))
def test_arrives_over_a_bad_link(seed):
    vehicle = rover()
    run = conductor(
        vehicle, faults=Faults(loss=0.1, duplicate=0.05, latency_s=0.1, jitter_s=0.1), drive=True, arm=True
    )
    run.up, run.down = (type(run.up)(run.faults, 10 * seed + side) for side in (1, 2))
    state = run.run()
    assert state is State.DONE
    assert run.director.upload_outcome.is_verified
    assert vehicle.breaches == 0
    assert distance_m(vehicle.position, TARGET) < 4.0


def test_every_state_is_in_the_table_and_leads_on():
    assert set(TRANSITIONS) == set(State)
    reached = {State.LISTENING}
    for _ in State:
        reached |= {after for state in reached for after in TRANSITIONS[state].values()}
    assert reached == set(State)


def _without(push, unwanted):
    return lambda frame, now_s: None if isinstance(frame.message, unwanted) else push(frame, now_s)


def _only(push, wanted):
    return lambda frame, now_s: push(frame, now_s) if isinstance(frame.message, wanted) else None
