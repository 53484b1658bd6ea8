"""`pbpp upload` and `pbpp download` with a simulated PX4 rover; and every message that any command sends, read for the modes in it."""

from __future__ import annotations

import json
import time
from contextlib import contextmanager

import pytest
from protocol.twin import plain_fence, plain_mission
from typer.testing import CliRunner

from mavlink_bridge.backup.store import BackupStore
from mavlink_bridge.backup.vehicle_mark import VehicleMark
from mavlink_bridge.cli.app import app
from mavlink_bridge.cli.interrupting import _hold
from mavlink_bridge.cli.session import Contact, open_session
from mavlink_bridge.errors import OutcomeError
from mavlink_bridge.link import Link
from mavlink_bridge.mavlink import messages as m
from mavlink_bridge.mavlink.autopilots import PX4_1_17
from mavlink_bridge.mavlink.messages import MissionType
from mavlink_bridge.mavlink.modes import ARDUPILOT_MODES, PX4_MODES
from mavlink_bridge.simulator import Simulator, SimulatorConfig
from missions.fence import CircleZone, Fence, PolygonZone, ZoneKind, fence_from_items, fence_to_items
from missions.firmware import Firmware
from missions.formats import read_situation, write_mission
from missions.geo import LatLon, distance_m
from missions.items import Command, CoordinateFrame, MissionItem, change_speed, waypoint
from missions.situation import Known, Mission, Situation

HOME = LatLon(40.071374, -105.229930)
ARDUPILOTS, PX4S = m.Autopilot.ARDUPILOTMEGA, m.Autopilot.PX4
WAY = (change_speed(1.5), waypoint(LatLon(40.0718, -105.2299)), waypoint(LatLon(40.0712, -105.2292)))
BOX = tuple(LatLon(lat, lon) for lat, lon in ((40.07, -105.232), (40.073, -105.232), (40.073, -105.228), (40.07, -105.228)))  # fmt: skip


@pytest.fixture(autouse=True)
def state_folder(tmp_path, monkeypatch):
    """Keep the tests out of the user's state folder."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    monkeypatch.setenv("HOME", str(tmp_path))


@pytest.fixture
def plan(tmp_path):
    """A file with a circle before a polygon, and a mission."""
    fence = Fence(
        (
            CircleZone(ZoneKind.EXCLUSION, LatLon(40.0716, -105.2297), 5.0),
            PolygonZone(ZoneKind.INCLUSION, BOX),
        )
    )
    situation = Situation(mission=Known(Mission(WAY, HOME), None, "test"), fence=Known(fence, None, "test"))
    write_mission(situation, tmp_path / "field.plan")
    return tmp_path / "field.plan"


@contextmanager
def rover(autopilot, firmware=None, **options):
    """Run a rover, and collect every frame that reaches it."""
    config = SimulatorConfig(autopilot=autopilot, firmware=firmware, **options)
    simulator = Simulator(config, "tcpin:127.0.0.1:0", speedup=3.0)
    receive, sent = simulator.vehicle.receive, []

    def note(frame, now_s):
        sent.append(frame.message)
        receive(frame, now_s)

    simulator.vehicle.receive = note
    with simulator:
        yield simulator, sent


def run(simulator, *arguments):
    result = CliRunner().invoke(app, [*map(str, arguments), "--connect", simulator.connection, "--json"])
    return result.exit_code, json.loads(result.stdout)


def modes_asked_for(messages):
    """Every mode that messages ask for: param2 and param3 of DO_SET_MODE, and SET_MODE's number as PX4 would read it."""
    asked = [
        (message.param2, message.param3)
        for message in messages
        if isinstance(message, m.CommandLong | m.CommandInt) and message.command == Command.DO_SET_MODE
    ]
    return asked + [(message.custom_mode, 0) for message in messages if isinstance(message, m.SetMode)]


@pytest.mark.parametrize("firmware", [Firmware(1, 17, 0), Firmware(1, 18, 0, 0)], ids=str)
class TestTransfers:
    def test_up_and_down(self, plan, tmp_path, firmware):
        with rover(PX4S, firmware) as (simulator, _):
            code, found = run(simulator, "upload", plan)
            assert code == 0
            assert [(one["list"], one["items"], one["outcome"]) for one in found["lists"]] == [
                ("fence", 5, "verified"),
                ("mission", 3, "verified"),  # no home item
            ]
            vehicle = simulator.vehicle
            assert [item.command for item in vehicle.fence] == [5001] * 4 + [5004]  # circles last
            assert vehicle.rover.progress.seq == 0
            code, found = run(simulator, "download", "mission", "-o", tmp_path / "back.plan")
            assert (code, len(found["items"])) == (0, 3)
            back = read_situation(tmp_path / "back.plan").mission.value
            assert [(item.command, item.position) for item in back.items if item.is_placed] == [
                (item.command, item.position) for item in WAY if item.is_placed
            ]
            code, found = run(simulator, "upload", plan)
            assert [one["pushes"] for one in found["lists"]] == [0, 0]  # there already

    def test_parameters(self, tmp_path, firmware):
        wanted = tmp_path / "set.param"
        wanted.write_text("GF_ACTION,3\nNAV_ACC_RAD,0.75\n")
        with rover(PX4S, firmware) as (simulator, sent):
            code, found = run(simulator, "upload", wanted)
            assert (code, found["parameters"]["GF_ACTION"]) == (0, {"before": 2.0, "now": 3.0})
            assert simulator.vehicle.parameters["GF_ACTION"] == 3
            types = {one.param_id: one.param_type for one in sent if isinstance(one, m.ParamSet)}
            assert types == {"GF_ACTION": 6, "NAV_ACC_RAD": 9}
            code, found = run(simulator, "download", "parameters")
            assert (found["parameters"]["GF_ACTION"], found["parameters"]["NAV_ACC_RAD"]) == (3.0, 0.75)
            assert "_HASH_CHECK" not in found["parameters"]
            saved = tmp_path / "saved.params"
            assert (
                run(simulator, "download", "parameters", "-o", saved, "-o", tmp_path / "saved.parm")[0] == 0
            )
            rows = [line.split("\t") for line in saved.read_text().splitlines() if not line.startswith("#")]
            assert ["1", "1", "GF_ACTION", "3", "6"] in rows
            assert ["1", "1", "NAV_ACC_RAD", "0.75", "9"] in rows
            for path in (saved, tmp_path / "saved.parm"):
                back = read_situation(path)
                assert (back.ardupilot, back.firmware) == (False, firmware)
                assert dict(back.parameters) == pytest.approx(found["parameters"], rel=1e-8)
            odd = tmp_path / "odd.params"
            odd.write_text("7\t1\tNAV_ACC_RAD\t0.01\t9\n")
            result = CliRunner().invoke(app, ["upload", str(odd), "--connect", simulator.connection])
            assert result.exit_code == 0
            assert "was saved from vehicle 7; this is vehicle 1" in result.stderr
            assert (
                "NAV_ACC_RAD is 0.01; PX4 documents 0.05 to 200, and PX4 does not check it" in result.stderr
            )
            wanted.write_text("GF_ACTION,2.5\n")
            code, found = run(simulator, "upload", wanted)
            assert (code, found["message"]) == (
                3,
                "2.5 is not a whole number of this parameter's type; nothing was sent",
            )

    def test_no_waypoints_file(self, firmware, tmp_path):
        with rover(PX4S, firmware) as (simulator, _):
            code, found = run(simulator, "download", "mission", "-o", tmp_path / "back.waypoints")
            assert code == 2
            assert "the first row of such a file is home" in found["message"]


INCLUSION = Fence((PolygonZone(ZoneKind.INCLUSION, BOX),))
STATION = PX4_1_17.lists.form


@pytest.mark.parametrize("firmware", [Firmware(1, 17, 0), Firmware(1, 18, 0, 0)], ids=str)
class TestDrives:
    """`plan --connect`, `check --connect`, `bridge --once` and `upload --drive`; every mode that is sent is read."""

    TARGET = "40.0718,-105.2299"

    def rover(self, firmware, fence=INCLUSION):
        items = STATION.prepared(fence_to_items(fence), MissionType.FENCE)
        return rover(PX4S, firmware, fence=items, heading_deg=0.0)

    def test_planned_uploaded_and_driven(self, firmware):
        with self.rover(firmware) as (simulator, sent):
            code, found = run(simulator, "plan", "--target", self.TARGET, "--clearance", "1.5", "--upload")
            assert (code, found["verified"], modes_asked_for(sent)) == (0, True, [])
            code, found = run(simulator, "check")
            assert (code, modes_asked_for(sent)) == (0, []), found
            assert any("PX4 keeps no margin" in text for text in found["info"])
            simulator.vehicle.rover.arm("a station")
            code, found = run(
                simulator, "plan", "--target", self.TARGET, "--clearance", "1.5", "--upload", "--drive"
            )
            assert code == 0
            assert found["arrived"] is True
            assert set(modes_asked_for(sent)) == {(4.0, 4.0)}
            assert distance_m(simulator.vehicle.position, LatLon(40.0718, -105.2299)) < 1.0
            assert any("PX4 keeps no margin" in text for text in found["info"])

    def test_its_own_mission_is_checked_uploaded_and_driven(self, firmware):
        way = (waypoint(LatLon(40.0716, -105.2299)), waypoint(LatLon(40.0718, -105.2296)))
        items = STATION.prepared(fence_to_items(INCLUSION), MissionType.FENCE)
        own = STATION.prepared(way, MissionType.MISSION)
        with rover(PX4S, firmware, fence=items, mission=own) as (simulator, sent):
            simulator.vehicle.rover.arm("a station")
            options = ("--via-mission", "own", "--clearance", "1.5", "--upload", "--drive")
            code, found = run(simulator, "plan", *options)
            assert (code, found["arrived"], found["mission_items"]) == (0, True, 2)
            assert distance_m(simulator.vehicle.position, way[-1].position) < 1.0
            assert set(modes_asked_for(sent)) == {(4.0, 4.0)}

    def test_one_job_of_the_bridge(self, firmware):
        with self.rover(firmware) as (simulator, sent):
            result = CliRunner().invoke(
                app,
                [
                    "bridge",
                    "--once",
                    "--upload",
                    "--drive",
                    "--arm",
                    "--target",
                    self.TARGET,
                    "--clearance",
                    "1.5",
                    "--json",
                    "--connect",
                    simulator.connection,
                ],
            )
            assert result.exit_code == 0, result.output
            names = [json.loads(line)["event"] for line in result.stdout.splitlines() if line.startswith("{")]
            assert (
                max(names.index("verified"), names.index("enforced"))
                < names.index("driving")
                < names.index("arrived")
            )
            assert set(modes_asked_for(sent)) == {(4.0, 4.0)}

    def test_uploaded_and_set_driving(self, plan, firmware):
        with rover(PX4S, firmware) as (simulator, sent):
            code, found = run(simulator, "upload", plan, "--drive")
            assert (code, found["error"]) == (7, "OutcomeError")  # not armed: its mode was not changed
            simulator.vehicle.rover.arm("a station")
            code, found = run(simulator, "upload", plan, "--drive")
            assert code == 0
            assert [one.get("not_enforced") for one in found["lists"]] == [[], None]
            assert simulator.vehicle.mode == PX4_MODES.mission
            assert set(modes_asked_for(sent)) == {(4.0, 4.0)}

    def test_a_mission_that_leads_into_rtl_is_not_driven(self, tmp_path, firmware):
        """PX4 leaves the mission for it, and drives straight home, through any zone."""
        home = MissionItem(Command.NAV_RETURN_TO_LAUNCH, frame=CoordinateFrame.MISSION)
        mission = Mission((waypoint(LatLon(HOME.lat_deg + 0.0001, HOME.lon_deg)), home), None)
        path = tmp_path / "rtl.plan"
        write_mission(Situation(mission=Known(mission, None, "test")), path)
        with rover(PX4S, firmware) as (simulator, sent):
            simulator.vehicle.rover.arm("a station")
            code, found = run(simulator, "upload", path, "--drive")
            assert (code, found["error"]) == (6, "RefusedError")
            assert "item 2 of the mission is RTL" in found["message"]
            assert "--return" in found["advice"]
            assert not any(isinstance(message, m.MissionCount) for message in sent)
            assert modes_asked_for(sent) == []
            assert (
                run(simulator, "upload", path)[0] == 0
            )  # without --drive it is nobody's drive but who starts it

    def test_a_zone_that_will_not_be_enforced_is_told_before_and_after(self, tmp_path, firmware):
        fence = Fence((*INCLUSION.zones, CircleZone(ZoneKind.EXCLUSION, HOME, 3.0)))
        write_mission(Situation(fence=Known(fence, None, "test")), tmp_path / "fence.plan")
        with rover(PX4S, firmware) as (simulator, _):
            code, found = run(simulator, "upload", tmp_path / "fence.plan")
            assert code == 0
            (zone,) = found["lists"][0]["not_enforced"]
            assert "exclusion" in zone
            result = CliRunner().invoke(
                app, ["upload", str(tmp_path / "fence.plan"), "--connect", simulator.connection]
            )
            assert f"PX4 will not enforce {zone}: home is on its forbidden side" in result.stderr
            assert f"PX4 does not enforce {zone}" in result.stderr


def test_a_refused_list_leaves_the_old_one_and_says_why(tmp_path):
    fence = fence_from_items(plain_fence(17))
    write_mission(Situation(fence=Known(fence, None, "test")), tmp_path / "large.plan")
    with rover(PX4S) as (simulator, _):
        code, found = run(simulator, "upload", tmp_path / "large.plan")
        assert (code, found["details"]["held"]) == (6, "old")
        assert "68 fence items; the vehicle holds 64" in found["message"]


def test_a_backup_of_another_autopilot_is_not_written(tmp_path):
    mark = VehicleMark(1, "", "", int(ARDUPILOTS))
    backup = BackupStore().keep(mark, MissionType.MISSION, plain_mission(5))
    with rover(PX4S) as (simulator, sent):
        code, found = run(simulator, "upload", "--restore", backup, "--other-vehicle")
        assert (code, found["error"]) == (7, "OtherVehicleError")
        assert "was read from another autopilot (MAV_AUTOPILOT 3, this is 12)" in found["message"]
        assert not any(isinstance(message, m.MissionCount) for message in sent)


def test_a_backup_of_its_own_is_put_back(plan):
    with rover(PX4S) as (simulator, _):
        run(simulator, "upload", plan)
        before = simulator.vehicle.mission
        backup = BackupStore().keep(VehicleMark(1, "", "", 12), MissionType.MISSION, before)
        simulator.vehicle.lists[MissionType.MISSION].clear()
        code, _ = run(simulator, "upload", "--restore", backup, "--other-vehicle")
        assert code == 0
        assert simulator.vehicle.mission == before


def driving(simulator, plan):
    """Let a PX4 rover drive its mission."""
    run(simulator, "upload", plan)
    assert simulator.vehicle.rover.start_mission(0)


class TestEveryModeThatIsSent:
    """No number of ArduPilot's to PX4, where 4 (HOLD) drives the mission; and none of PX4's to ArduPilot."""

    def test_to_px4(self, plan):
        for firmware in (Firmware(1, 17, 0), Firmware(1, 18, 0, 0)):
            with rover(PX4S, firmware) as (simulator, sent):
                driving(simulator, plan)
                code, _ = run(simulator, "upload", plan, "--replace-active")
                assert code == 0
                plan_without = ("upload", plan, "--only", "mission")
                simulator.vehicle.lists[MissionType.MISSION].clear()
                run(simulator, *plan_without)
                assert simulator.vehicle.rover.start_mission(0)
                run(simulator, *plan_without, "--hold")
                self.switch(simulator)
                asked = modes_asked_for(sent)
                assert asked
                assert set(asked) == {(4.0, 3.0), (4.0, 4.0)}  # AUTO.LOITER and AUTO.MISSION
                assert not {(number, 0) for number in (4, 10, 11, 15)} & set(asked)

    def test_to_ardupilot(self, plan):
        with rover(ARDUPILOTS, parameters={"FENCE_ENABLE": 0.0}) as (simulator, sent):
            simulator.vehicle.rover.arm()
            code, _ = run(simulator, "upload", plan, "--drive")
            assert code == 0
            run(simulator, "upload", plan, "--hold")
            self.switch(simulator)
            asked = modes_asked_for(sent)
            assert set(asked) == {(4.0, 0.0), (10.0, 0.0)}  # HOLD and AUTO

    @staticmethod
    def switch(simulator):
        """Switch to HOLD as an interrupt does, and to the mission and back."""
        contact = Contact(simulator.connection, (245, 190))
        with open_session(contact, lambda *_: None) as session:
            assert _hold(session.at_hand(lambda: None, lambda: ""))
            modes = session.autopilot.modes
            session.change_mode(modes.mission)
            session.change_mode(modes.hold)
            other = ARDUPILOT_MODES if modes is PX4_MODES else PX4_MODES
            for mode in (other.hold, other.mission, other.rtl):
                with pytest.raises(ValueError, match="is not a mode of this autopilot"):
                    session.change_mode(mode)


@pytest.mark.parametrize("firmware", [Firmware(1, 17, 0), Firmware(1, 18, 0, 0)], ids=str)
@pytest.mark.parametrize("what", ["upload", "download", "plan", "bridge"])
def test_an_interrupt_ends_the_transfer_that_we_began(plan, monkeypatch, firmware, what):
    """Else PX4 is busy for everybody for 5 s more; the old list stays whole."""
    lost = m.MissionItemInt if what != "download" else m.MissionRequestInt
    fence = fence_to_items(Fence((PolygonZone(ZoneKind.INCLUSION, BOX),)))
    with rover(PX4S, firmware, fence=fence, mission=WAY) as (simulator, sent):
        vehicle, old = simulator.vehicle, simulator.vehicle.mission
        receive_at, receive = Link.receive_at, vehicle.receive
        begun: list[m.Message] = []
        is_due = [True]

        def deaf(frame, now_s):
            if isinstance(frame.message, lost):
                begun.append(frame.message)
            else:
                receive(frame, now_s)

        def interrupted(link, timeout_s):
            if is_due[0] and begun:
                is_due[0] = False
                raise KeyboardInterrupt
            return receive_at(link, timeout_s)

        vehicle.receive = deaf
        monkeypatch.setattr(Link, "receive_at", interrupted)
        arguments = {
            "upload": ["upload", plan],
            "download": ["download", "mission"],
            "plan": ["plan", "--target", "40.0718,-105.2299", "--clearance", "1.5", "--upload"],
            "bridge": ["bridge", "--target", "40.0718,-105.2299", "--clearance", "1.5", "--upload"],
        }[what]
        result = CliRunner().invoke(app, [*map(str, arguments), "--connect", simulator.connection])
        assert result.exit_code == 130
        assert not is_due[0]
        assert vehicle.mission == old
        until_s = time.monotonic() + 5.0
        while not (vehicle._server.is_idle and ended(sent)) and time.monotonic() < until_s:
            time.sleep(0.02)  # it is on its way yet
        assert len(ended(sent)) == 1
        assert vehicle._server.is_idle


def ended(sent):
    return [
        one
        for one in sent
        if isinstance(one, m.MissionAck) and one.type == m.MissionResult.OPERATION_CANCELLED
    ]


def test_a_mode_that_px4_1_17_accepts_and_never_enters_is_not_believed():
    with rover(PX4S, Firmware(1, 17, 0)) as (simulator, _):
        contact = Contact(simulator.connection, (245, 190))
        with (
            open_session(contact, lambda *_: None) as session,
            pytest.raises(OutcomeError, match="did not confirm mode MANUAL"),
        ):
            session.change_mode(1 << 16)
