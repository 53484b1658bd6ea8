"""What may lead a bridge with a PX4 rover astray: other stations' missions, odd states, operators who act between two heartbeats, restarts."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from director.px4.px4_runs import (
    FAR,
    FENCE,
    HOME,
    MODES,
    NEAR,
    PX4_MISSION,
    VERSIONS,
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
from director.soak import SETTINGS, soak
from director.test_bridge_director import reposition

from mavlink_bridge.director import EventName, State
from mavlink_bridge.director.orders import Homing, TargetSource
from mavlink_bridge.mavlink import messages as m
from missions.fence import CircleZone, Fence, ZoneKind
from missions.geo import LatLon, distance_m
from missions.items import Command, waypoint
from missions.request import Request


def arrives(run, place, within_s: float = 200) -> None:
    run.run_until(lambda: run.director.state is State.ARRIVED, within_s)
    assert distance_m(run.vehicles[0].position, place) < 1.0
    assert run.vehicles[0].rover.breaches == 0


def last_leg(run) -> int:
    return len(run.vehicles[0].mission) - 1


class TestOthersMissions:
    @VERSIONS
    def test_the_end_of_somebody_elses_mission_is_no_arrival(self, firmware):
        """It takes the new mission up at once, and ends it where it is."""
        run = driving(conductor(rover(firmware)))
        wait(run, 8)
        here = run.vehicles[0].position
        ahead = LatLon(here.lat_deg, here.lon_deg + 0.00001)
        upload(run, m.MissionType.MISSION, (replace(waypoint(ahead), current=True),))
        wait(run, 15)
        assert EventName.ARRIVED not in names(run)
        assert EventName.MISSION_CHANGED in names(run) or EventName.TAKEN_OVER in names(run)
        assert run.director.state is State.LET_GO

    @VERSIONS
    @pytest.mark.parametrize("after_s", [8.0, 8.2, 8.4, 8.6, 8.8])
    def test_nor_is_one_that_ends_at_once(self, firmware, after_s):
        run = driving(conductor(rover(firmware)))
        wait(run, after_s)
        upload(run, m.MissionType.MISSION, (replace(waypoint(run.vehicles[0].position), current=True),))
        wait(run, 15)
        assert EventName.ARRIVED not in names(run)
        assert run.director.state is State.LET_GO

    @VERSIONS
    @pytest.mark.parametrize("how", ["cleared", "invalid"])
    def test_a_mission_that_somebody_takes_away_is_not_put_back(self, firmware, how):
        run = driving(conductor(rover(firmware)))
        wait(run, 8)
        before = len(run.modes_sent)
        if how == "cleared":
            unheard(run, m.MissionClearAll(1, 1, 0))
        else:
            outside = LatLon(HOME.lat_deg + 0.01, HOME.lon_deg)
            upload(run, m.MissionType.MISSION, (replace(waypoint(outside), current=True),))
        wait(run, 25)
        assert run.vehicles[0].mode == MODES.hold
        assert PX4_MISSION not in run.modes_sent[before:]
        assert run.director.state is State.LET_GO
        assert [event.name for event in run.events if event.name is EventName.UPLOADING] == [
            EventName.UPLOADING
        ]

    @pytest.mark.parametrize("state", [State.VERIFIED, State.ENFORCED])
    def test_a_second_mission_while_the_fence_is_waited_for(self, state):
        run = ready(conductor(starts_on_word=True))
        run.director.take_target(FAR, run.now_s)
        run.run_until(lambda: run.director.state is state, 30)
        upload(run, m.MissionType.MISSION, (replace(waypoint(NEAR), current=True),))
        wait(run, 8)
        run.director.start_drive(run.now_s)
        wait(run, 10)
        assert run.modes_sent == []
        assert run.director.state is State.LET_GO


class TestBetweenHeartbeats:
    @VERSIONS
    @pytest.mark.parametrize("after_s", [0.1, 0.3, 0.6])
    def test_a_hold_just_after_the_start_stands(self, firmware, after_s):
        """The heartbeat that would have shown AUTO.MISSION never comes: ACCEPTED was heard, so that HOLD is somebody's."""
        run = ready(conductor(rover(firmware)))
        run.director.take_target(FAR, run.now_s)
        run.run_until(lambda: run.vehicles[0].mode == MODES.mission, 60)
        wait(run, after_s)
        seen = run.director.situation.mode
        unheard(run, mode_command(MODES.hold))
        wait(run, 12)
        assert run.modes_sent.count(PX4_MISSION) == 1, (seen, run.modes_sent)
        assert run.vehicles[0].mode == MODES.hold
        assert run.director.state is State.LET_GO

    @VERSIONS
    @pytest.mark.parametrize("heard", ["heard", "not heard", "no source"])
    @pytest.mark.parametrize("state", [State.VERIFIED, State.STARTING])
    def test_a_click_just_before_the_start_is_not_overridden(self, firmware, state, heard):
        sources = frozenset() if heard == "no source" else frozenset(TargetSource)
        run = ready(conductor(rover(firmware), target_sources=sources))
        unheard(run, m.CommandLong(1, 1, Command.COMPONENT_ARM_DISARM, param1=1.0))
        wait(run, 2)
        run.director.take_target(FAR, run.now_s)
        run.run_until(lambda: run.director.state is state, 60)
        wait(run, 0.6)
        sent = len(run.modes_sent)
        (unheard if heard == "not heard" else lambda run, one: run.ground_station(one))(run, reposition(NEAR))
        wait(run, 20)
        if heard == "heard":
            arrives(run, NEAR)
        else:
            assert run.director.state is State.LET_GO
            assert PX4_MISSION not in run.modes_sent[sent:]

    @VERSIONS
    @pytest.mark.parametrize("state", [State.VERIFIED, State.STARTING, State.DRIVING])
    def test_a_pause_is_a_takeover(self, firmware, state):
        """QGroundControl's "Pause" is DO_REPOSITION without a place: in HOLD already, no heartbeat shows it."""
        run = ready(conductor(rover(firmware)))
        run.director.take_target(FAR, run.now_s)
        run.run_until(lambda: run.director.state is state, 60)
        wait(run, 0.6)
        nothing = math.nan
        run.ground_station(
            m.CommandLong(1, 1, Command.DO_REPOSITION, 0, -1.0, 1.0, 0.0, nothing, nothing, nothing, nothing)
        )
        sent = len(run.modes_sent)
        wait(run, 10)
        assert run.director.state is State.LET_GO
        assert run.last(EventName.TAKEN_OVER).data["by"] == "ground_station"
        assert PX4_MISSION not in run.modes_sent[sent:]
        assert run.vehicles[0].mode == MODES.hold
        assert run.vehicles[0].rover.motion.speed_mps < 0.3


class TestTheFirstItem:
    """The same list uploaded again is not stored anew, so that its number stays; and what sets it back is not answered."""

    def again(self, firmware, lost: int):
        """Drive to the last leg, be held, stand at the start again, and want the same; so many requests for the first item are lost."""
        run = driving(conductor(rover(firmware)))
        vehicle, motion = run.vehicles[0], run.vehicles[0].rover.motion
        first, last = vehicle.mission, last_leg(run)
        run.run_until(lambda: vehicle.rover.progress.seq >= last, 60)
        unheard(run, mode_command(MODES.hold))
        run.run_until(run.happened(EventName.TAKEN_OVER), 5)
        wait(run, 8)
        motion.position_m, motion.heading_rad = 0j, 0.0
        wait(run, 3)
        receive, sent = vehicle.receive, []

        def lose(frame, now_s) -> None:
            if isinstance(frame.message, m.MissionSetCurrent):
                sent.append(now_s)
                if len(sent) <= lost:
                    return
            receive(frame, now_s)

        vehicle.receive = lose
        run.director.take_target(FAR, run.now_s)
        run.run_until(lambda: vehicle.mode == MODES.mission, 60)
        assert vehicle.mission == first
        return run, last

    @VERSIONS
    @pytest.mark.parametrize("lost", [0, 3])
    def test_it_is_asked_for_until_the_vehicle_tells_it(self, firmware, lost):
        run, last = self.again(firmware, lost)
        assert run.vehicles[0].rover.progress.seq < last
        arrives(run, FAR)
        assert EventName.TROUBLE not in names(run)

    @VERSIONS
    def test_a_drive_that_begins_elsewhere_is_stopped(self, firmware):
        run, last = self.again(firmware, 4)
        assert run.vehicles[0].rover.progress.seq == last
        run.run_until(run.happened(EventName.TROUBLE), 4)
        assert "not begun at its first item" in run.last(EventName.TROUBLE).text
        arrives(run, FAR)


class TestBreaches:
    @VERSIONS
    def test_breaches_told_by_text_are_counted(self, firmware):
        """With GF_ACTION 1 it drives on."""
        run = driving(conductor(rover(firmware, parameters={"RO_SPEED_LIM": 2.0, "GF_ACTION": 1})))
        wait(run, 5)
        run.down.push(
            m.Frame(1, 1, m.Statustext(4, "Geofence: approaching or outside geofence\t")), run.now_s
        )
        run.run_until(lambda: run.director.state is State.ARRIVED, 200)
        assert EventName.BREACH in names(run)
        assert run.last(EventName.ARRIVED).data["breaches"] == 1

    def breached(self, firmware, action: int, **asked):
        """Put a zone of no list under the rover until it has noticed, as where its estimate is off for a moment."""
        run = driving(
            conductor(
                rover(firmware, parameters={"RO_SPEED_LIM": 2.0, "GF_ACTION": action}),
                homing=Homing(is_kept=True, by_route=True),
                **asked,
            )
        )
        wait(run, 8)
        rover_ = run.vehicles[0].rover
        area, zone = rover_._area, CircleZone(ZoneKind.EXCLUSION, run.vehicles[0].position, 3.0)
        rover_._area = type(area)(sent_items(Fence((zone,))), rover_.frame)
        run.run_until(run.happened(EventName.BREACH), 5)
        wait(run, 0.1)
        rover_._area = area
        return run

    @VERSIONS
    @pytest.mark.parametrize("action", [1, 2, 3])
    def test_a_breach_calls_it_home(self, firmware, action):
        """GF_ACTION 1: it drives on; 2: it holds; 3: it holds, and drives straight home 5 s later."""
        run = self.breached(firmware, action)
        assert run.last(EventName.CALLED_HOME).data["call"] == "fence breach"
        run.run_until(lambda: run.director.state is State.ARRIVED, 200)
        assert distance_m(run.vehicles[0].position, HOME) < 1.0
        assert run.vehicles[0].rover.breaches == 1
        assert EventName.TAKEN_OVER not in names(run)
        assert len([one for one in run.events if one.name is EventName.CALLED_HOME]) == 1

    @VERSIONS
    @pytest.mark.parametrize("escape", [False, True])
    def test_out_of_a_zone_it_is_driven_only_where_that_is_allowed(self, firmware, escape):
        """As an ArduPilot rover: without --escape nothing drives it out."""
        run = driving(
            conductor(
                rover(firmware),
                homing=Homing(is_kept=True, by_route=True),
                request=Request(clearance_m=1.5, escape=escape),
            )
        )
        wait(run, 8)
        here = run.vehicles[0].position
        rover_ = run.vehicles[0].rover
        zone = CircleZone(ZoneKind.EXCLUSION, here, 2.0)
        fence = Fence((*FENCE.zones, zone))
        known = run.director.situation.fence
        run.director._core.situation = replace(run.director.situation, fence=replace(known, value=fence))
        rover_._area = type(rover_._area)(sent_items(fence), rover_.frame)
        run.run_until(run.happened(EventName.BREACH), 5)
        if escape:
            run.run_until(lambda: run.director.state is State.ARRIVED, 200)
            assert distance_m(run.vehicles[0].position, HOME) < 1.0
        else:
            run.run_until(run.happened(EventName.HOME_WAITS), 30)
            wait(run, 20)
            assert run.vehicles[0].mode == MODES.hold
            assert PX4_MISSION not in run.modes_sent[1:]
        assert EventName.TAKEN_OVER not in names(run)


class TestRefusals:
    @VERSIONS
    def test_arming_refused_leaves_the_mission_and_drives_nothing(self, firmware):
        run = ready(conductor(rover(firmware)))
        run.vehicles[0].rover._arms_from_s = run.now_s + 60
        run.director.take_target(FAR, run.now_s)
        run.run_until(run.happened(EventName.COMMAND_FAILED), 60)
        wait(run, 15)
        assert run.modes_sent == []
        assert run.last(EventName.COMMAND_FAILED).data["command"] == "COMPONENT_ARM_DISARM"
        wait(run, 60)
        assert not run.vehicles[0].is_armed
        before = len(run.events)
        run.director.take_target(FAR, run.now_s)
        run.run_until(run.happened(EventName.DRIVING, before), 60)
        arrives(run, FAR)

    def test_a_mission_that_is_refused_is_not_started_on_a_word(self):
        run = ready(conductor(starts_on_word=True))
        vehicle = run.vehicles[0]
        judge = vehicle.rover._judge_mission

        def refuse() -> None:
            judge()
            vehicle.rover.progress.is_valid = False

        vehicle.rover._judge_mission = refuse
        run.director.take_target(FAR, run.now_s)
        run.run_until(run.happened(EventName.TROUBLE), 60)
        run.director.start_drive(run.now_s)
        wait(run, 15)
        assert not vehicle.is_armed
        assert run.modes_sent == []

    @VERSIONS
    def test_a_mode_that_is_not_available_is_said_so(self, firmware):
        run = conductor(rover(firmware))
        rover_ = run.vehicles[0].rover
        enter = rover_._enter
        rover_._enter = lambda mode: None if mode == (4, 4) else enter(mode)
        ready(run)
        run.director.take_target(FAR, run.now_s)
        run.run_until(run.happened(EventName.COMMAND_FAILED), 90)
        wait(run, 5)
        assert run.director.state is State.LET_GO
        assert run.last(EventName.COMMAND_FAILED).data["result"] == "accepted, but not shown by its heartbeat"
        assert run.modes_sent == [PX4_MISSION]


class TestSilences:
    @VERSIONS
    def test_it_arrives_while_it_is_not_heard(self, firmware):
        run = driving(conductor(rover(firmware)))
        wait(run, 8)
        run.is_cut = True
        run.run_until(run.happened(EventName.LINK_LOST), 10)
        wait(run, 60)
        assert run.vehicles[0].mode == MODES.hold
        run.is_cut = False
        run.run_until(run.happened(EventName.LINK_BACK), 10)
        wait(run, 15)
        assert run.director.state in (State.READY, State.ARRIVED)
        assert EventName.TAKEN_OVER not in names(run)
        print(names(run), run.director.state)

    @VERSIONS
    def test_lost_acknowledgements(self, firmware):
        """Two of three; those of changes of mode are all lost."""
        run = conductor(rover(firmware))
        receive, count = run.director.receive, [0]

        def hear(frame, now_s) -> None:
            if isinstance(frame.message, m.CommandAck):
                count[0] += 1
                if count[0] % 3 or frame.message.command == Command.DO_SET_MODE:
                    return
            receive(frame, now_s)

        run.director.receive = hear
        driving(run)
        wait(run, 5)
        before = len(run.events)
        run.director.take_target(NEAR, run.now_s)
        run.run_until(run.happened(EventName.DRIVING, before), 60)
        arrives(run, NEAR)

    @VERSIONS
    def test_heartbeats_that_come_seldom(self, firmware):
        run = conductor(rover(firmware))
        receive = run.director.receive
        count = [0]

        def hear(frame, now_s) -> None:
            if isinstance(frame.message, m.Heartbeat):
                count[0] += 1
                if count[0] % 3:
                    return
            receive(frame, now_s)

        run.director.receive = hear
        driving(run)
        before = len(run.events)
        wait(run, 5)
        run.director.take_target(NEAR, run.now_s)
        run.run_until(run.happened(EventName.DRIVING, before), 60)
        arrives(run, NEAR)
        assert EventName.TAKEN_OVER not in names(run)

    @VERSIONS
    def test_texts_are_not_heard_at_all(self, firmware):
        run = conductor(rover(firmware))
        receive = run.director.receive
        run.director.receive = lambda frame, now_s: (
            None if isinstance(frame.message, m.Statustext) else receive(frame, now_s)
        )
        driving(run)
        place = next(one.position for one in run.vehicles[0].mission if one.is_placed)
        wait(run, 2)
        circle = CircleZone(ZoneKind.EXCLUSION, place, 3.0)
        upload(run, m.MissionType.FENCE, sent_items(Fence((*FENCE.zones, circle))))
        wait(run, 30)
        print(names(run), run.director.state, run.vehicles[0].mode)
        assert run.vehicles[0].rover.breaches == 0

    def test_a_reboot_just_after_the_start(self):
        run = driving(conductor())
        wait(run, 0.5)
        run.vehicles[0].reboot(run.now_s)
        wait(run, 30)
        assert not run.vehicles[0].is_armed
        sent = len(run.modes_sent)
        wait(run, 10)
        assert len(run.modes_sent) == sent

    @VERSIONS
    @pytest.mark.parametrize(
        "state", [State.UPLOADING, State.VERIFIED, State.ENFORCED, State.STARTING, State.HOLDING]
    )
    def test_a_reboot_in_every_state(self, firmware, state):
        run = (
            driving(conductor(rover(firmware)))
            if state is State.HOLDING
            else ready(conductor(rover(firmware)))
        )
        wait(run, 5)
        if state is State.ENFORCED:
            run.director.orders = replace(run.director.orders, starts_on_word=True)
        run.director.take_target(NEAR, run.now_s)
        run.run_until(lambda: run.director.state is state, 30)
        sent = len(run.modes_sent)
        run.vehicles[0].reboot(run.now_s)
        wait(run, 40)
        assert not run.vehicles[0].is_armed
        assert PX4_MISSION not in run.modes_sent[sent:]


class TestFences:
    def test_a_text_of_another_zone_is_told_of_the_right_one(self):
        """A text names no zone: only those that it may be about are told."""
        run = driving(conductor())
        wait(run, 10)
        run.down.push(
            m.Frame(1, 1, m.Statustext(2, "Geofence invalid, doesn't contain Home position\t")), run.now_s
        )
        wait(run, 1)
        event = run.last(EventName.NOT_ENFORCED)
        assert event.data["zones"] == ["a zone that it does not name"]

    @VERSIONS
    def test_a_late_text_of_the_fence_before_is_not_one_of_the_new(self, firmware):
        run = ready(conductor(rover(firmware), starts_on_word=True))
        run.director.take_target(FAR, run.now_s)
        run.run_until(lambda: run.director.state is State.ENFORCED, 30)
        home_zone = CircleZone(ZoneKind.EXCLUSION, HOME, 0.5)
        upload(run, m.MissionType.FENCE, sent_items(Fence((*FENCE.zones, home_zone))))
        wait(run, 8)
        upload(run, m.MissionType.FENCE, sent_items(FENCE))
        wait(run, 12)
        told = [event for event in run.events if event.name is EventName.ENFORCED]
        assert told[-1].data["not_enforced"] == []

    @VERSIONS
    def test_a_fence_again_and_again_while_it_is_waited_for(self, firmware):
        run = ready(conductor(rover(firmware)))
        run.director.take_target(FAR, run.now_s)
        run.run_until(lambda: run.director.state is State.VERIFIED, 30)
        aside = LatLon(HOME.lat_deg, HOME.lon_deg - 0.0001)
        for number in range(4):
            zone = CircleZone(ZoneKind.EXCLUSION, aside, 0.5 + 0.1 * number)
            upload(run, m.MissionType.FENCE, sent_items(Fence((*FENCE.zones, zone))))
            wait(run, 1.5)
        written_s = run.now_s - 1.5
        assert run.modes_sent == []
        run.run_until(lambda: run.director.state is State.DRIVING, 60)
        items = len(run.vehicles[0].fence)
        assert run.last(EventName.DRIVING).time_s >= written_s + 0.1 * (items + 1)
        arrives(run, FAR)


@VERSIONS
@pytest.mark.parametrize("setting", ["calm", "dense"])
def test_a_few_minutes_of_the_soak_keep_every_promise(firmware, setting):
    hours = {"calm": 0.08, "dense": 0.03}[setting]
    run = soak(2, hours, autopilot=m.Autopilot.PX4, firmware=firmware, **SETTINGS[setting])
    assert run.violations == []
    assert run.counts["target"] > 1
