"""Modes, arming, commands, parameters, telemetry: what a ground station sees of the vehicle."""

from __future__ import annotations

import itertools
import math
from pathlib import Path

import pytest
from simulator.station import HOME, TICK_S, Bench, at, line, placed, square

from mavlink_bridge.errors import BridgeError
from mavlink_bridge.mavlink import messages as m
from mavlink_bridge.mavlink.messages import Capability, MavResult, ModeFlag
from mavlink_bridge.mavlink.rover import Mode
from mavlink_bridge.simulator import SimulatedVehicle, SimulatorConfig
from mavlink_bridge.simulator.parameters import DEFAULTS
from missions.items import Command, MissionItem

ARMED = ModeFlag.SAFETY_ARMED


def quiet(**changes) -> SimulatorConfig:
    return SimulatorConfig(streams=False, **changes)


def test_a_heartbeat_a_second_and_nothing_else_when_quiet():
    bench = Bench(quiet())
    bench.run(10.0)
    beats = [time_s for time_s, message in bench.heard if isinstance(message, m.Heartbeat)]
    assert len(bench.heard) == len(beats) == 10
    assert [b - a for a, b in itertools.pairwise(beats)] == pytest.approx([1.0] * 9)


def test_telemetry_flows_unasked():
    bench = Bench(SimulatorConfig())
    bench.run(10.0)
    counts = {kind.__name__: len(bench.of(kind)) for kind in {type(message) for _, message in bench.heard}}
    assert counts == {
        "Heartbeat": 10,
        "SysStatus": 20,
        "GpsRawInt": 20,
        "GlobalPositionInt": 40,
        "MissionCurrent": 20,
        "VfrHud": 20,
        "EkfStatusReport": 20,
        "HomePosition": 2,
    }
    position = bench.of(m.GlobalPositionInt)[-1]
    assert (position.lat, position.lon, position.hdg) == (400713740, -1052299300, 0)
    assert bench.of(m.GpsRawInt)[-1].fix_type == 6
    assert bench.of(m.EkfStatusReport)[-1].flags == 831
    assert bench.of(m.HomePosition)[-1].latitude == 400713740


def test_heartbeats_show_mode_and_arming_as_recorded():
    bench = Bench(quiet(mission=line(2)))

    def beat():
        bench.run(1.0)
        last = bench.of(m.Heartbeat)[-1]
        return last.base_mode, last.custom_mode, last.system_status

    assert beat() == (65, 0, 4)
    bench.command(Command.DO_SET_MODE, 1, 10)
    assert beat() == (9, 10, 4)
    bench.command(Command.COMPONENT_ARM_DISARM, 1)
    assert beat() == (137, 10, 4)
    bench.command(Command.DO_SET_MODE, 1, 4)
    assert beat() == (129, 4, 3)


def test_ready_to_arm_only_after_the_time_asked_for():
    bench = Bench(SimulatorConfig(ready_after_s=35.0))
    bench.run(2.0)
    assert bench.of(m.Heartbeat)[-1].custom_mode == Mode.INITIALISING
    assert bench.of(m.GlobalPositionInt)[-1].lat == 0
    assert bench.of(m.GpsRawInt)[-1].fix_type == 0
    assert bench.of(m.EkfStatusReport)[-1].flags == 1024
    assert not bench.of(m.HomePosition)
    assert not bench.of(m.SysStatus)[-1].onboard_control_sensors_health & 1 << 28
    assert bench.command(Command.GET_HOME_POSITION) == MavResult.FAILED
    assert bench.command(Command.COMPONENT_ARM_DISARM, 1) == MavResult.FAILED
    assert "Arm: Need Position Estimate" in bench.texts()
    bench.run(33.0)
    assert bench.of(m.Heartbeat)[-1].custom_mode == Mode.MANUAL
    assert bench.command(Command.COMPONENT_ARM_DISARM, 1) == MavResult.ACCEPTED
    bench.run(1.0)
    assert bench.of(m.GlobalPositionInt)[-1].lat == 400713740
    assert bench.of(m.SysStatus)[-1].onboard_control_sensors_health & 1 << 28


def test_arming_and_disarming():
    bench = Bench(quiet())
    assert bench.command(Command.COMPONENT_ARM_DISARM, 1) == MavResult.ACCEPTED
    assert bench.vehicle.is_armed
    assert bench.command(Command.COMPONENT_ARM_DISARM, 1) == MavResult.ACCEPTED
    assert bench.command(Command.COMPONENT_ARM_DISARM, 0) == MavResult.ACCEPTED
    assert bench.command(Command.COMPONENT_ARM_DISARM, 0) == MavResult.ACCEPTED
    assert not bench.vehicle.is_armed
    assert bench.command(Command.COMPONENT_ARM_DISARM, 7) == MavResult.UNSUPPORTED
    assert bench.texts() == ["Throttle armed", "Throttle disarmed"]


@pytest.mark.parametrize(("mode", "result"), [(0, 0), (4, 0), (15, 0), (11, 0), (10, 4), (16, 4), (99, 4)])
def test_modes(mode, result):
    bench = Bench(quiet())
    assert bench.command(Command.DO_SET_MODE, 1, mode) == result
    if mode == 10:
        assert bench.texts() == ["No Mission. Can't set AUTO."]
    assert bench.vehicle.mode == (mode if result == 0 else 0)


def test_set_mode_the_old_way():
    bench = Bench(quiet())
    assert bench.ask(m.SetMode(1, 1, 4)) == []
    assert bench.vehicle.mode == Mode.HOLD


def test_mission_start_sets_auto():
    bench = Bench(quiet(mission=line(2)))
    assert bench.command(Command.MISSION_START) == MavResult.ACCEPTED
    assert bench.vehicle.mode == Mode.AUTO


@pytest.mark.parametrize("as_int", [False, True])
def test_what_is_not_known_is_unsupported(as_int):
    bench = Bench(quiet())
    assert bench.command(31_000, as_int=as_int) == MavResult.UNSUPPORTED


def test_do_reposition_only_as_command_int():
    bench = Bench(quiet())
    target = at(20, 0)
    x, y = round(target.lat_deg * 1e7), round(target.lon_deg * 1e7)
    assert bench.command(Command.DO_REPOSITION, -1, 1) == MavResult.UNSUPPORTED
    assert bench.command(Command.DO_REPOSITION, -1, 0, as_int=True, x=x, y=y) == MavResult.DENIED
    assert bench.command(Command.DO_REPOSITION, -1, 1, as_int=True) == MavResult.DENIED
    assert bench.command(Command.DO_REPOSITION, -1, 1, as_int=True, x=910_000_000, y=1) == MavResult.DENIED
    assert bench.command(Command.DO_REPOSITION, -1, 1, as_int=True, x=x, y=y, frame=1) == MavResult.DENIED
    assert bench.vehicle.mode == Mode.MANUAL
    assert bench.command(Command.DO_REPOSITION, 1.5, 1, as_int=True, x=x, y=y) == MavResult.ACCEPTED
    assert bench.vehicle.mode == Mode.GUIDED
    bench.command(Command.COMPONENT_ARM_DISARM, 1)
    bench.run(8.0)
    assert bench.vehicle.rover.body.speed_mps == pytest.approx(1.5, abs=0.1)


def test_a_position_target_drives_in_guided_only():
    bench = Bench(quiet())
    target = at(20, 0)
    position = m.SetPositionTargetGlobalInt(
        0, 1, 1, 6, 65_016, round(target.lat_deg * 1e7), round(target.lon_deg * 1e7), 0.0
    )
    bench.ask(position)
    assert bench.vehicle.rover.destination is None
    bench.command(Command.DO_SET_MODE, 1, 15)
    ignoring_place = m.SetPositionTargetGlobalInt(0, 1, 1, 6, 3, 1, 1, 0.0)
    bench.ask(ignoring_place)
    assert bench.vehicle.rover.destination is None
    bench.ask(position)
    assert bench.vehicle.rover.destination.lat_deg == pytest.approx(target.lat_deg, abs=1e-7)


def test_requested_messages():
    bench = Bench(quiet())
    (ack, home) = bench.ask(m.CommandLong(1, 1, Command.GET_HOME_POSITION))
    assert ack == m.CommandAck(Command.GET_HOME_POSITION, 0, target_system=255, target_component=190)
    assert home == m.HomePosition(400713740, -1052299300)
    (_, version) = bench.ask(m.CommandLong(1, 1, Command.REQUEST_MESSAGE, param1=148))
    wanted = Capability.MISSION_INT | Capability.COMMAND_INT | Capability.MAVLINK2 | Capability.MISSION_FENCE
    assert version.capabilities & wanted == wanted
    assert not version.capabilities & Capability.FTP
    assert version.flight_sw_version >> 24 == 4
    assert bench.ask(m.CommandLong(1, 1, 520))[1] == version
    assert bench.command(Command.REQUEST_MESSAGE, 31_000) == MavResult.FAILED


def test_streams_and_intervals():
    bench = Bench(quiet())
    bench.ask(m.RequestDataStream(1, 1, 0, 10, 1))
    bench.run(2.0)
    assert len(bench.of(m.GlobalPositionInt)) == pytest.approx(20, abs=1)
    bench.ask(m.RequestDataStream(1, 1, 0, 10, 0))
    bench.heard.clear()
    bench.run(2.0)
    assert {type(message) for _, message in bench.heard} == {m.Heartbeat}
    bench.ask(m.RequestDataStream(1, 1, 99, 10, 1))
    assert bench.command(Command.SET_MESSAGE_INTERVAL, 164, 40_000) == MavResult.ACCEPTED
    bench.run(2.0)
    assert len(bench.of(m.Simstate)) == pytest.approx(50, abs=2)
    # 50 Hz is refused: the limit is 0.8 of the loop's rate.
    assert bench.command(Command.SET_MESSAGE_INTERVAL, 164, 20_000) == MavResult.FAILED
    assert bench.command(Command.SET_MESSAGE_INTERVAL, 31_000, 100_000) == MavResult.FAILED
    assert bench.command(Command.SET_MESSAGE_INTERVAL, 164, -1) == MavResult.ACCEPTED
    bench.heard.clear()
    bench.run(2.0)
    assert not bench.of(m.Simstate)
    assert bench.command(Command.SET_MESSAGE_INTERVAL, 33, 0) == MavResult.ACCEPTED
    bench.run(2.0)
    assert len(bench.of(m.GlobalPositionInt)) == pytest.approx(8, abs=1)


def test_a_late_call_sends_a_stream_once_and_keeps_its_pace():
    vehicle = SimulatedVehicle(SimulatorConfig())
    vehicle.handle_timer(0.0)
    vehicle.messages_to_send()
    vehicle.handle_timer(5.0)
    assert len([x for x in vehicle.messages_to_send() if isinstance(x, m.Heartbeat)]) == 5


def test_parameters_list_read_and_set():
    bench = Bench(quiet(parameters={"WP_SPEED": 2.0}))
    bench.send(m.ParamRequestList(1, 1))
    bench.run(2.0)
    values = bench.of(m.ParamValue)
    assert [value.param_index for value in values] == list(range(len(DEFAULTS)))
    assert {value.param_count for value in values} == {len(DEFAULTS)}
    found = {value.param_id: value.param_value for value in values}
    assert set(found) == set(DEFAULTS)
    assert (found["WP_SPEED"], found["WP_RADIUS"], found["FENCE_TYPE"]) == (2.0, 3.0, 6.0)
    (by_name,) = bench.ask(m.ParamRequestRead(1, 1, "FENCE_MARGIN"))
    assert by_name == m.ParamValue("FENCE_MARGIN", 2.0, 9, len(DEFAULTS), 65_535)
    (by_index,) = bench.ask(m.ParamRequestRead(1, 1, "", 3))
    assert (by_index.param_id, by_index.param_index) == (list(DEFAULTS)[3], 3)
    (was_set,) = bench.ask(m.ParamSet(1, 1, "WP_RADIUS", 4.1, 9))
    assert was_set.param_value == pytest.approx(4.1)
    assert was_set.param_value != 4.1
    assert bench.vehicle.rover.drive._settings.radius_m == was_set.param_value
    (enabled,) = bench.ask(m.ParamSet(1, 1, "FENCE_ENABLE", 1.7, 9))
    assert (enabled.param_value, enabled.param_type) == (1.0, 2)


@pytest.mark.parametrize(
    "message",
    [
        m.ParamRequestRead(1, 1, "NO_SUCH"),
        m.ParamRequestRead(1, 1, "", 9999),
        m.ParamSet(1, 1, "NO_SUCH", 1.0, 9),
        m.ParamSet(1, 1, "WP_RADIUS", math.nan, 9),
    ],
)
def test_what_is_no_parameter_is_met_with_silence(message):
    bench = Bench(quiet())
    assert bench.ask(message) == []
    assert bench.vehicle.parameters["WP_RADIUS"] == 3.0


def test_an_override_must_be_a_parameter():
    with pytest.raises(BridgeError, match="no parameter FOO"):
        SimulatedVehicle(SimulatorConfig(parameters={"FOO": 1.0}))


def test_a_parameter_of_a_huge_value_is_infinite_in_four_bytes():
    bench = Bench(quiet(parameters={"FENCE_RADIUS": 1e300}))
    assert bench.vehicle.parameters["FENCE_RADIUS"] == math.inf


def test_the_fence_can_be_switched_on_by_command():
    bench = Bench(SimulatorConfig(fence=tuple(square(50, 0))))
    bench.run(1.0)
    assert not bench.of(m.FenceStatus)
    assert bench.command(Command.DO_FENCE_ENABLE, 1) == MavResult.ACCEPTED
    assert [value.param_id for value in bench.of(m.ParamValue)] == ["FENCE_ENABLE"]
    bench.run(1.0)
    assert bench.of(m.FenceStatus)[-1].breach_status == 0
    assert bench.command(Command.DO_FENCE_ENABLE, 2) == MavResult.FAILED


def test_the_current_item_can_be_set():
    bench = Bench(quiet(mission=line(4)))
    assert bench.command(Command.DO_SET_MISSION_CURRENT, 9) == MavResult.FAILED
    assert bench.ask(m.MissionSetCurrent(1, 1, 9)) == []
    (current,) = bench.ask(m.MissionSetCurrent(1, 1, 3))
    assert (current.seq, current.total) == (3, 4)
    bench.start_auto()
    assert "Mission: 3 WP" in bench.texts()
    assert bench.command(Command.DO_SET_MISSION_CURRENT, 2) == MavResult.ACCEPTED
    assert bench.texts()[-1] == "Mission: 2 WP"
    assert bench.command(Command.DO_SET_MISSION_CURRENT, 4, 1) == MavResult.ACCEPTED
    assert bench.texts()[-1] == "Mission: 4 WP"


def test_setting_the_current_item_in_hold_before_auto_upsets_the_autopilot():
    bench = Bench(quiet(mission=line(4)))
    bench.command(Command.DO_SET_MODE, 1, 4)
    bench.command(Command.DO_SET_MISSION_CURRENT, 2)
    bench.command(Command.DO_SET_MODE, 1, 10)
    assert "Internal Errors 0x20000000" in bench.texts()
    bench.command(Command.DO_SET_MODE, 1, 4)
    bench.command(Command.DO_SET_MODE, 1, 10)
    assert bench.texts().count("Internal Errors 0x20000000") == 1


def test_mission_current_tells_the_state_of_the_mission():
    bench = Bench(SimulatorConfig())

    def current():
        bench.run(1.0)
        last = bench.of(m.MissionCurrent)[-1]
        return last.seq, last.total, last.mission_state, last.mission_mode

    assert current() == (0, 0, 1, 0)
    bench.upload_mission(line(2))
    assert current() == (0, 2, 2, 0)
    bench.start_auto()
    assert current() == (1, 2, 3, 1)
    bench.command(Command.DO_SET_MODE, 1, 4)
    assert current() == (1, 2, 4, 0)
    bench.command(Command.DO_SET_MODE, 1, 10)
    bench.run_until(lambda: bench.vehicle.rover.mission_run.is_complete, 60.0)
    assert current() == (2, 2, 5, 1)


def test_telemetry_while_driving():
    bench = Bench(SimulatorConfig(mission=line(4)))
    bench.ask(m.RequestDataStream(1, 1, 12, 4, 1))
    bench.start_auto()
    bench.run(8.0)
    target = bench.of(m.PositionTargetGlobalInt)[-1]
    assert target.lat_int in {item.lat_e7 for item in line(4)}
    nav = bench.of(m.NavControllerOutput)[-1]
    assert nav.target_bearing in (359, 0, 1)
    assert 0 <= nav.wp_dist <= 15
    hud, position = bench.of(m.VfrHud)[-1], bench.of(m.GlobalPositionInt)[-1]
    assert hud.groundspeed == pytest.approx(position.vx / 100, abs=0.5)
    assert hud.throttle > 0
    assert bench.of(m.Simstate)[-1].lat > 400713740


def test_a_reboot_starts_anew():
    bench = Bench(SimulatorConfig(mission=line(2)))
    bench.start_auto()
    bench.run(5.0)
    where = bench.vehicle.position
    bench.vehicle.reboot(bench.now_s)
    bench.heard.clear()
    bench.send(m.ParamRequestList(1, 1))
    bench.run(2.9)
    assert bench.heard == []
    bench.run(1.2)
    beat = bench.of(m.Heartbeat)[-1]
    assert (beat.base_mode, beat.custom_mode) == (65, 0)
    assert bench.of(m.GlobalPositionInt)[-1].time_boot_ms < 1500
    assert not bench.vehicle.is_armed
    assert bench.vehicle.position.lat_deg == pytest.approx(where.lat_deg, abs=1e-7)
    assert bench.vehicle.mission[0].lat_e7 == pytest.approx(round(where.lat_deg * 1e7), abs=1)
    assert len(bench.vehicle.mission) == 3
    assert bench.of(m.ParamValue) == []


def test_time_may_stand_or_jump_but_not_hurt():
    vehicle = SimulatedVehicle(quiet())
    for now_s in (0.0, 0.0, 0.01, 3600.0, 3600.0):
        vehicle.handle_timer(now_s)
        assert vehicle.deadline_s > now_s
    assert len(vehicle.messages_to_send()) == 2 + 3601


def test_the_same_calls_give_the_same_vehicle():
    runs = []
    for _ in range(2):
        bench = Bench(SimulatorConfig(mission=line(3)))
        bench.start_auto()
        bench.run(20.0)
        runs.append(bench.heard)
    assert runs[0] == runs[1]


def test_what_is_not_for_a_vehicle_is_ignored():
    bench = Bench(quiet())
    assert bench.ask(m.Heartbeat(6, 8), m.MissionAck(1, 1, 0), m.Statustext(6, "hello")) == []


def test_a_rally_list_can_be_configured():
    rally = MissionItem(Command.RALLY_POINT, 3, lat_e7=400713740, lon_e7=-1052299300)
    vehicle = SimulatedVehicle(SimulatorConfig(rally=(rally,)))
    assert [item.command for item in vehicle.rally] == [Command.RALLY_POINT]
    assert placed(Command.RALLY_POINT, HOME).lat_e7 == vehicle.rally[0].lat_e7
    assert TICK_S == 0.02


def test_the_docs_list_every_parameter_with_its_default():
    text = (Path(__file__).parents[3] / "docs" / "simulator.md").read_text().split("## Parameters")[1]
    told = dict(entry.split() for entry in " ".join(text.split()).split(", "))
    assert {name: float(value) for name, value in told.items()} == DEFAULTS
