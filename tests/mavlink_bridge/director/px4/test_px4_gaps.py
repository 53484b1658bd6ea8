"""What leads a bridge with a PX4 rover astray elsewhere: restarts, calls home, clashes, sensors, HOLD near a fence, persons at pages."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import pytest
from director.px4.px4_runs import (
    FAR,
    FENCE,
    HOME,
    MODES,
    NEAR,
    PX4_HOLD,
    PX4_MISSION,
    V1_18,
    VERSIONS,
    WALL,
    conductor,
    driving,
    mode_command,
    names,
    ready,
    rover,
    sent_items,
    unheard,
    upload,
    wait,
)
from director.test_bridge_director import reposition

from mavlink_bridge.backup.drive_note import note_from_json, note_to_json
from mavlink_bridge.director import Director, EventName, State
from mavlink_bridge.director.orders import Homing, ObstacleSource, TargetSource
from mavlink_bridge.mavlink import messages as m
from missions.fence import CircleZone, Fence, ZoneKind
from missions.geo import LatLon, distance_m
from missions.items import Command, waypoint
from missions.rally import RallyPoint, rally_to_items
from missions.request import End, Tour

UID = b"rover of px4"


def arrives(run, place, within_s: float = 200) -> None:
    run.run_until(lambda: run.director.state is State.ARRIVED, within_s)
    assert distance_m(run.vehicles[0].position, place) < 1.0
    assert run.vehicles[0].rover.breaches == 0


class TestRestarts:
    def killed(self, firmware, after_s: float = 8.0):
        run = driving(conductor(rover(firmware, uid=UID)))
        wait(run, after_s)
        return run, note_from_json(json.loads(json.dumps(note_to_json(run.note))))

    def away(self, run, seconds: float) -> None:
        """Let the rover drive with nobody there."""
        vehicle, until_s = run.vehicles[0], run.now_s + seconds
        while run.now_s < until_s:
            vehicle.handle_timer(run.now_s)
            vehicle.messages_to_send()
            run.now_s += 0.02

    def begin_anew(self, run, *notes) -> None:
        orders = run.director._core.orders
        run.events.clear()
        run.modes_sent.clear()
        run.note, run.is_started = None, False
        run.director = Director(orders, None, notes)
        run.run_until(run.happened(EventName.LEARNT), 60)

    @VERSIONS
    def test_a_drive_is_adopted_and_driven_to_its_end(self, firmware):
        run, note = self.killed(firmware)
        self.away(run, 3.0)
        self.begin_anew(run, note)
        run.run_until(run.happened(EventName.ADOPTED), 10)
        assert run.director.state is State.DRIVING
        assert "AUTO.MISSION, as before the restart" in run.last(EventName.DRIVING).text
        arrives(run, FAR)
        assert run.modes_sent == []
        run.run_until(lambda: run.director.drive_note is None, 5)

    @VERSIONS
    def test_a_fence_put_across_meanwhile_is_driven_round(self, firmware):
        run, note = self.killed(firmware, 3.0)
        upload(run, m.MissionType.FENCE, sent_items(WALL))
        self.begin_anew(run, note)
        run.run_until(run.happened(EventName.ROUTE_BROKEN), 20)
        run.run_until(lambda: PX4_HOLD in run.modes_sent, 20)
        arrives(run, FAR)

    @pytest.mark.parametrize(
        "what", ["held", "disarmed", "rebooted", "another mission", "another board", "arrived"]
    )
    def test_what_is_not_that_drive_any_more_is_left(self, what):
        run, note = self.killed(V1_18)
        if what == "held":
            unheard(run, mode_command(MODES.hold))
        elif what == "disarmed":
            unheard(run, m.CommandLong(1, 1, Command.COMPONENT_ARM_DISARM, param1=0.0))
        elif what == "rebooted":
            run.vehicles[0].reboot(run.now_s)
        elif what == "another mission":
            note = replace(note, mission=note.mission[:-1])
        elif what == "another board":
            note = replace(note, vehicle=replace(note.vehicle, uid=b"another"))
        self.away(run, 120.0 if what == "arrived" else 5.0)
        self.begin_anew(run, note)
        wait(run, 12)
        assert EventName.ADOPTED not in names(run)
        assert run.happened(EventName.NOT_ADOPTED)() or what == "another board"
        assert run.modes_sent == []

    def test_who_takes_an_adopted_drive_has_it(self):
        run, note = self.killed(V1_18)
        self.begin_anew(run, note)
        run.run_until(run.happened(EventName.ADOPTED), 10)
        unheard(run, mode_command(MODES.hold))
        run.run_until(run.happened(EventName.TAKEN_OVER), 5)
        wait(run, 10)
        assert run.director.state is State.LET_GO
        assert run.modes_sent == []


class TestCallsHome:
    @VERSIONS
    @pytest.mark.parametrize("told", ["percent", "volts"])
    def test_a_low_battery_calls_it_home(self, firmware, told):
        limits = {"battery_percent": 20} if told == "percent" else {"battery_volts": 10.5}
        run = driving(conductor(rover(firmware), homing=Homing(is_kept=True, by_route=True, **limits)))
        wait(run, 5)
        cells = (10_000, *(65_535,) * 9) if told == "volts" else (65_535,) * 10
        status = m.BatteryStatus(id=0, voltages=cells, battery_remaining=10 if told == "percent" else -1)
        due_s = [run.now_s]

        def tell(run) -> None:
            if run.now_s >= due_s[0]:  # PX4 sends it every two seconds
                due_s[0] += 2.0
                run.down.push(m.Frame(1, 1, status), run.now_s)

        run.meddle = tell
        run.run_until(run.happened(EventName.CALLED_HOME), 15)
        assert run.last(EventName.CALLED_HOME).data["call"] == "low battery"
        run.run_until(run.happened(EventName.GOING_HOME), 30)
        arrives(run, HOME)

    @VERSIONS
    def test_the_silence_of_all_ground_stations_calls_it_home(self, firmware):
        run = ready(conductor(rover(firmware), homing=Homing(is_kept=True, by_route=True, gcs_timeout_s=5.0)))
        run.down.push(m.Frame(255, 190, m.Heartbeat(m.MavType.GCS, 8)), run.now_s)
        run.director.take_target(FAR, run.now_s)
        run.run_until(lambda: run.director.state is State.DRIVING, 60)
        run.down.push(m.Frame(255, 190, m.Heartbeat(m.MavType.GCS, 8)), run.now_s)
        run.run_until(run.happened(EventName.CALLED_HOME), 10)
        assert run.last(EventName.CALLED_HOME).data["call"] == "no ground station heard"
        arrives(run, HOME)

    def test_rtl_by_the_autopilots_own_failsafe_is_answered_each_time(self):
        run = driving(conductor(homing=Homing(is_kept=True, by_route=True)))
        wait(run, 20)
        vehicle = run.vehicles[0]
        vehicle.rover._enter((4, 5))
        vehicle.rover.is_in_failsafe = True
        run.run_until(run.happened(EventName.CALLED_HOME), 5)
        vehicle.rover.is_in_failsafe = False
        run.run_until(run.happened(EventName.GOING_HOME), 30)
        arrives(run, HOME)


class TestClashes:
    def spoof(self, run) -> None:
        run.director.receive(m.Frame(*run.director.identity, m.Heartbeat(6, 8)), run.now_s)

    @VERSIONS
    def test_a_clash_on_the_way_is_one_hold_and_a_typed_target_settles_it(self, firmware):
        run = driving(conductor(rover(firmware)))
        wait(run, 6)
        run.modes_sent.clear()
        for _ in range(50):
            self.spoof(run)
            run.step()
        wait(run, 6)
        assert run.director.state is State.CLASHED
        assert run.vehicles[0].mode == MODES.hold
        assert set(run.modes_sent) == {PX4_HOLD}
        run.down.push(m.Frame(255, 190, reposition(NEAR)), run.now_s)  # a click that is heard, and ignored
        wait(run, 3)
        assert set(run.modes_sent) == {PX4_HOLD}
        run.director.take_target(FAR, run.now_s)
        run.run_until(lambda: run.director.state is State.DRIVING, 90)
        arrives(run, FAR)

    def test_a_clash_in_mid_upload_leaves_a_whole_mission_and_drives_nothing(self):
        run = ready(conductor())
        run.director.take_target(FAR, run.now_s)
        run.run_until(lambda: run.director.state is State.UPLOADING, 30)
        self.spoof(run)
        run.run_until(lambda: run.director.state is State.CLASHED, 30)
        wait(run, 10)
        assert run.modes_sent == []
        assert not run.vehicles[0].is_armed

    def test_a_clash_while_the_fence_is_waited_for_drives_nothing(self):
        run = ready(conductor())
        run.director.take_target(FAR, run.now_s)
        run.run_until(lambda: run.director.state is State.VERIFIED, 30)
        self.spoof(run)
        wait(run, 15)
        assert run.director.state is State.CLASHED
        assert run.modes_sent == []


class TestObstacles:
    def scan(self, run, disc: tuple[LatLon, float]):
        """Return what a ring of sensors around the front sees of a disc: 72 sectors of 5°, 0 to the front."""
        vehicle = run.vehicles[0]
        pose = run.director.situation.pose.value
        here = vehicle.position
        north_m = (disc[0].lat_deg - here.lat_deg) * 111_195
        east_m = (disc[0].lon_deg - here.lon_deg) * 111_195 * math.cos(math.radians(here.lat_deg))
        bearing_deg = math.degrees(math.atan2(east_m, north_m)) - (pose.heading_deg or 0.0)
        away_m = math.hypot(north_m, east_m)
        distances = [65_535] * 72
        half_deg = math.degrees(math.asin(min(1.0, disc[1] / max(away_m, disc[1]))))
        for sector in range(72):
            off_deg = (sector * 5.0 - bearing_deg + 180) % 360 - 180
            if abs(off_deg) <= max(half_deg, 2.5) and away_m - disc[1] < 15.0:
                distances[sector] = int((away_m - disc[1]) * 100)
        return m.ObstacleDistance(
            time_usec=int(run.now_s * 1e6), sensor_type=0, distances=tuple(distances), min_distance=20, max_distance=1500,
            increment=5, increment_f=5.0, angle_offset=0.0, frame=12,
        )  # fmt: skip

    @VERSIONS
    def test_what_a_sensor_sees_is_driven_round(self, firmware):
        run = driving(conductor(rover(firmware), obstacle_sources=frozenset(ObstacleSource)))
        wait(run, 2)
        disc = (WALL.zones[-1].centre, 1.0)
        due_s, near_m = [run.now_s], [math.inf]

        def see(run) -> None:
            if run.now_s >= due_s[0]:
                due_s[0] += 0.1
                near_m[0] = min(near_m[0], distance_m(run.vehicles[0].position, disc[0]) - disc[1])
                run.down.push(m.Frame(1, 1, self.scan(run, disc)), run.now_s)

        run.meddle = see
        run.run_until(run.happened(EventName.OBSTACLE_ACROSS), 100)
        run.run_until(lambda: run.vehicles[0].mode == MODES.hold, 5)
        arrives(run, FAR, 300)
        assert near_m[0] > 0.0


class TestHoldNearAFence:
    @VERSIONS
    @pytest.mark.parametrize("after_s", [2, 6, 10, 14, 18, 22])
    def test_the_loop_stays_within_the_fence_or_is_announced(self, firmware, after_s):
        run = driving(conductor(rover(firmware, parameters={"RO_SPEED_LIM": 3.0})))
        wait(run, after_s)
        before = len(run.events)
        run.director.take_target(NEAR, run.now_s)
        run.run_until(run.happened(EventName.HOLDING, before), 30)
        wait(run, 6)
        rover_ = run.vehicles[0].rover
        told = [
            one
            for one in run.events[before:]
            if one.name is EventName.BREACH_AHEAD and one.data["best"] == "hold"
        ]
        assert rover_.breaches == 0 or told

    @VERSIONS
    def test_it_goes_on_first_where_the_loop_would_leave(self, firmware):
        """A zone beside the route, and one across it farther on: the loop of a HOLD at once would lead into the first."""
        run = driving(conductor(rover(firmware, parameters={"RO_SPEED_LIM": 3.0})))
        wait(run, 9.3)
        pose = run.director.situation.pose.value
        east, north = (one / pose.speed_mps for one in pose.velocity_mps)
        beside = placed(pose.position, 4.0 * east + 3.3 * north, 4.0 * north - 3.3 * east)
        zones = (CircleZone(ZoneKind.EXCLUSION, beside, 1.5), WALL.zones[-1])
        before = len(run.events)
        upload(run, m.MissionType.FENCE, sent_items(Fence((*FENCE.zones, *zones))))
        run.run_until(run.happened(EventName.BREACH_AHEAD, before), 10)
        assert run.last(EventName.BREACH_AHEAD).data["best"] == "go_on"
        arrives(run, FAR, 300)


def placed(place: LatLon, east_m: float, north_m: float) -> LatLon:
    """Return the place so far away."""
    lon_m = 111_195 * math.cos(math.radians(place.lat_deg))
    return LatLon(place.lat_deg + north_m / 111_195, place.lon_deg + east_m / lon_m)


class TestPersonsAtPages:
    @VERSIONS
    def test_a_hold_stops_a_drive(self, firmware):
        run = driving(conductor(rover(firmware)))
        wait(run, 5)
        run.director.hold("asked for by page 1", run.now_s)
        wait(run, 8)
        assert run.vehicles[0].mode == MODES.hold
        assert run.vehicles[0].rover.motion.speed_mps < 0.3
        assert run.director.state is State.LET_GO

    @VERSIONS
    def test_a_hold_stops_a_click_that_drives_in_hold(self, firmware):
        """HOLD is its mode already: it is sent to where it is, and its mode asked for until it is seen."""
        run = ready(conductor(rover(firmware), target_sources=frozenset()))
        unheard(run, m.CommandLong(1, 1, Command.COMPONENT_ARM_DISARM, param1=1.0))
        wait(run, 1)
        unheard(run, reposition(FAR))
        wait(run, 6)
        assert run.vehicles[0].mode == MODES.hold
        assert run.vehicles[0].rover.motion.speed_mps > 1.0
        run.director.hold("asked for by page 1", run.now_s)
        wait(run, 8)
        assert run.vehicles[0].rover.motion.speed_mps < 0.3
        sent = [one for one in run.sent if isinstance(one, m.CommandInt)]
        assert {one.command for one in sent} == {Command.DO_REPOSITION}
        assert PX4_HOLD in run.modes_sent
        wait(run, 10)
        assert run.vehicles[0].rover.motion.speed_mps < 0.3

    def test_a_drive_waits_for_the_word_and_for_the_fence(self):
        run = ready(conductor(starts_on_word=True))
        run.director.take_target(FAR, run.now_s)
        run.run_until(lambda: run.director.state is State.VERIFIED, 30)
        assert run.director._parts.fence.is_waiting
        run.director.start_drive(run.now_s)
        assert run.director.state is State.VERIFIED  # the fence first
        run.run_until(lambda: run.director.state is State.DRIVING, 30)
        assert run.last(EventName.ENFORCED).time_s <= run.last(EventName.DRIVING).time_s

    def test_a_word_after_the_fence_counts_starts_it(self):
        run = ready(conductor(starts_on_word=True))
        run.director.take_target(FAR, run.now_s)
        run.run_until(lambda: run.director.state is State.ENFORCED, 30)
        wait(run, 10)
        assert run.director.state is State.ENFORCED
        assert run.modes_sent == []
        run.director.start_drive(run.now_s)
        run.run_until(lambda: run.director.state is State.DRIVING, 30)
        arrives(run, FAR)

    def test_a_fence_across_a_mission_that_waits_is_planned_round(self):
        run = ready(conductor(starts_on_word=True))
        run.director.take_target(FAR, run.now_s)
        run.run_until(lambda: run.director.state is State.ENFORCED, 30)
        before = len(run.events)
        upload(run, m.MissionType.FENCE, sent_items(WALL))
        run.run_until(run.happened(EventName.VERIFIED, before), 60)
        run.run_until(lambda: run.director.state is State.ENFORCED, 30)
        assert run.modes_sent in ([], [PX4_HOLD])


def test_an_operator_who_drives_the_uploaded_mission_is_watched():
    run = ready(conductor(drive=False, arm=False))
    run.director.take_target(FAR, run.now_s)
    run.run_until(lambda: run.director.state is State.ENFORCED, 30)
    wait(run, 5)
    run.ground_station(m.CommandLong(1, 1, Command.COMPONENT_ARM_DISARM, param1=1.0))
    wait(run, 1)
    run.ground_station(mode_command(MODES.mission))
    run.run_until(lambda: run.director.state is State.DRIVING, 10)
    run.run_until(lambda: run.director.state is State.ARRIVED, 200)
    assert run.modes_sent == []


@pytest.mark.parametrize("is_single_job", [False, True])
def test_a_mission_that_ends_with_rtl_is_not_driven(is_single_job):
    request = Tour(targets=(FAR,), clearance_m=1.5, end=End.RTL)
    run = conductor(once=is_single_job, request=request)
    if is_single_job:
        assert run.run(60) is State.FAILED
        assert "plan the way home with --return" in str(run.director.trouble)
    else:
        ready(run)
        run.run_until(run.happened(EventName.NO_PLAN), 60)
        assert "plan the way home with --return" in run.last(EventName.NO_PLAN).text
    assert run.modes_sent == []
    assert not run.happened(EventName.UPLOADING)()


def test_the_roll_out_of_hold_is_not_foreseen_straight():
    """PX4's HOLD steers: a new route is made from where the rover stands."""
    run = driving(conductor(rover(parameters={"RO_SPEED_LIM": 3.0})))
    wait(run, 8)
    run.director.take_target(NEAR, run.now_s)
    run.run_until(lambda: run.director.state is State.HOLDING, 5)
    run.run_until(lambda: run.director.state is not State.HOLDING, 15)
    assert run.director._parts.halter.expected is None
    assert run.vehicles[0].rover.motion.speed_mps <= 0.6
    assert PX4_MISSION in run.modes_sent


@pytest.mark.parametrize("kind", ["mission", "rally"])
def test_a_place_in_a_list_is_a_target(kind):
    """PX4 has no home before its mission: a mission of one item has a place, too."""
    run = ready(conductor(target_sources=frozenset(TargetSource) - {TargetSource.HOME}))
    if kind == "mission":
        upload(run, m.MissionType.MISSION, (waypoint(FAR),))
    else:
        upload(run, m.MissionType.RALLY, rally_to_items((RallyPoint(*FAR),)))
    run.run_until(run.happened(EventName.TARGET), 90)
    assert run.last(EventName.TARGET).data["source"] == kind
    run.run_until(lambda: run.director.state is State.DRIVING, 60)
    arrives(run, FAR)
