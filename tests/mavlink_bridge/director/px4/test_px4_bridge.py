"""The bridge with a PX4 rover, both versions: targets, fences, takeovers, troubles; each message that is sent is read for its mode."""

from __future__ import annotations

import pytest
from director.px4.px4_runs import (
    FAR,
    FENCE,
    HOME,
    MODES,
    NEAR,
    PX4_HOLD,
    PX4_MISSION,
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

from mavlink_bridge.director import EventName, State, TargetSource
from mavlink_bridge.director.orders import Homing, ObstacleSource
from mavlink_bridge.mavlink import messages as m
from mavlink_bridge.simulator.faults import Faults, FaultyLink
from missions.errors import NoRouteError
from missions.fence import CircleZone, Fence, ZoneKind
from missions.geo import distance_m
from missions.items import Command
from missions.request import Request


@VERSIONS
def test_a_typed_target_becomes_a_verified_mission_a_drive_and_an_arrival(firmware):
    run = driving(conductor(rover(firmware)))
    run.run_until(lambda: run.director.state is State.ARRIVED, 200)
    vehicle = run.vehicles[0]
    assert distance_m(vehicle.position, FAR) < 1.0
    assert (vehicle.rover.breaches, run.last(EventName.ARRIVED).data["breaches"]) == (0, 0)
    assert names(run) == [
        EventName.VEHICLE_FOUND, EventName.LEARNT, EventName.TARGET, EventName.PLANNED, EventName.UPLOADING, EventName.VERIFIED,
        EventName.ENFORCED, EventName.DRIVING, EventName.ARRIVED,
    ]  # fmt: skip
    assert run.modes_sent == [PX4_MISSION]  # a PX4 mission ends in HOLD by itself
    assert vehicle.mode == MODES.hold
    assert "; HOLD" not in run.last(EventName.ARRIVED).text
    assert not any(
        isinstance(one, m.CommandLong) and one.command == Command.MISSION_START for one in run.sent
    )
    assert run.director.peer.autopilot.name == f"PX4 {firmware.major}.{firmware.minor}"
    assert any("PX4 keeps no margin" in text for text in run.last(EventName.PLANNED).data["info"])


@VERSIONS
def test_a_second_target_is_driven_from_where_it_holds(firmware):
    """MISSION_ITEM_REACHED of the mission before is repeated for ten seconds: it is no arrival of the next one."""
    run = driving(conductor(rover(firmware)), NEAR)
    run.run_until(lambda: run.director.state is State.ARRIVED, 200)
    run.director.take_target(FAR, run.now_s)
    run.run_until(lambda: run.director.state is State.DRIVING, 60)
    wait(run, 12)
    assert run.director.state is State.DRIVING
    run.run_until(lambda: run.director.state is State.ARRIVED, 200)
    assert distance_m(run.vehicles[0].position, FAR) < 1.0
    run.director.take_target(HOME, run.now_s)
    run.run_until(lambda: run.director.state is State.DRIVING, 60)
    run.run_until(lambda: run.director.state is State.ARRIVED, 200)
    assert distance_m(run.vehicles[0].position, HOME) < 1.0


@VERSIONS
def test_a_click_is_stopped_where_the_rover_is_and_becomes_a_route(firmware):
    """A click drives a PX4 rover in HOLD, straight: HOLD again would not stop it."""
    run = ready(conductor(rover(firmware), arm=False))
    run.ground_station(m.CommandLong(1, 1, Command.COMPONENT_ARM_DISARM, param1=1.0))
    run.run_until(lambda: run.director.situation.armed)
    run.ground_station(reposition(FAR))
    run.run_until(run.happened(EventName.HOLDING), 1)
    sent = [one for one in run.sent if isinstance(one, m.CommandInt)]
    run.run_until(lambda: run.director.state is State.DRIVING, 60)
    sent = [one for one in run.sent if isinstance(one, m.CommandInt)]
    assert {(one.command, one.param2) for one in sent} == {(Command.DO_REPOSITION, 1.0)}
    run.run_until(lambda: run.director.state is State.ARRIVED, 200)
    assert distance_m(run.vehicles[0].position, FAR) < 1.0
    assert run.vehicles[0].rover.breaches == 0


@VERSIONS
def test_a_click_that_comes_to_the_vehicle_late_is_stopped_too(firmware):
    run = ready(conductor(rover(firmware), arm=False))
    run.ground_station(m.CommandLong(1, 1, Command.COMPONENT_ARM_DISARM, param1=1.0))
    run.run_until(lambda: run.director.situation.armed)
    click = reposition(FAR)
    run.down.push(m.Frame(255, 190, click), run.now_s)  # the bridge hears it at once
    wait(run, 1.0)
    unheard(run, click)
    run.run_until(lambda: run.director.state is State.ARRIVED, 200)
    assert run.vehicles[0].rover.breaches == 0
    assert distance_m(run.vehicles[0].position, FAR) < 1.0


def test_a_click_on_the_way_leads_elsewhere():
    run = driving(conductor())
    wait(run, 8)
    run.ground_station(reposition(NEAR))
    run.run_until(run.happened(EventName.HOLDING), 1)
    run.run_until(lambda: run.director.state is State.ARRIVED, 200)
    assert distance_m(run.vehicles[0].position, NEAR) < 1.0
    assert EventName.TAKEN_OVER not in names(run)


@VERSIONS
def test_a_fence_put_across_the_route_is_driven_round(firmware):
    run = driving(conductor(rover(firmware)))
    wait(run, 8)
    before = len(run.events)
    upload(run, m.MissionType.FENCE, sent_items(WALL))
    run.run_until(run.happened(EventName.ROUTE_BROKEN, before), 5)
    run.run_until(run.happened(EventName.DRIVING, before), 60)
    run.run_until(lambda: run.director.state is State.ARRIVED, 200)
    vehicle = run.vehicles[0]
    assert vehicle.rover.breaches == 0
    assert distance_m(vehicle.position, FAR) < 1.0
    assert PX4_HOLD in run.modes_sent


@VERSIONS
def test_a_fence_on_a_later_waypoint_holds_the_rover_and_is_driven_round(firmware):
    """The vehicle itself refuses the mission then, and holds: that is nobody's takeover."""
    run = driving(conductor(rover(firmware)))
    place = next(one.position for one in run.vehicles[0].mission if one.is_placed)
    wait(run, 2)
    circle = CircleZone(ZoneKind.EXCLUSION, place, 3.0)
    before = len(run.events)
    upload(run, m.MissionType.FENCE, sent_items(Fence((*FENCE.zones, circle))))
    run.run_until(run.happened(EventName.DRIVING, before), 60)
    run.run_until(lambda: run.director.state is State.ARRIVED, 200)
    assert run.vehicles[0].rover.breaches == 0
    assert EventName.TAKEN_OVER not in [event.name for event in run.events[before:]]


def test_the_fence_counts_before_the_rover_starts():
    """0.1 s for each vertex and once more, from when it was read at the latest."""
    run = ready(conductor())
    run.director.take_target(FAR, run.now_s)
    run.run_until(lambda: run.director.state is State.VERIFIED, 10)
    run.run_until(lambda: run.director.state is State.ENFORCED or run.director.state is State.STARTING, 10)
    learnt_s = next(event.time_s for event in run.events if event.name is EventName.LEARNT)
    enforced = run.last(EventName.ENFORCED)
    items = len(run.vehicles[0].fence)
    assert enforced.time_s >= learnt_s - 0.2 + 0.1 * (items + 1)
    assert enforced.data == {"zones": 4, "vertices": FENCE.vertex_count, "not_enforced": []}


def test_a_fence_that_changes_while_the_rover_is_about_to_start_is_waited_for():
    run = ready(conductor())
    wait(run, 5)
    run.director.take_target(FAR, run.now_s)
    run.run_until(lambda: run.director.state is State.VERIFIED, 20)
    aside = type(HOME)(HOME.lat_deg, HOME.lon_deg - 0.0001)
    upload(
        run,
        m.MissionType.FENCE,
        sent_items(Fence((*FENCE.zones, CircleZone(ZoneKind.EXCLUSION, aside, 0.5)))),
    )
    written_s = run.now_s
    run.run_until(lambda: run.director.state is State.DRIVING, 60)
    items = len(run.vehicles[0].fence)
    assert [event.data["zones"] for event in run.events if event.name is EventName.ENFORCED] == [4, 5]
    assert run.last(EventName.ENFORCED).time_s >= written_s + 0.1 * (items + 1)
    assert run.last(EventName.DRIVING).time_s >= run.last(EventName.ENFORCED).time_s


@VERSIONS
def test_a_zone_with_home_in_it_is_said_to_be_not_enforced(firmware):
    run = driving(conductor(rover(firmware)))
    before = len(run.events)
    home_zone = CircleZone(ZoneKind.EXCLUSION, HOME, 2.0)
    wait(run, 10)
    upload(run, m.MissionType.FENCE, sent_items(Fence((*FENCE.zones, home_zone))))
    run.run_until(run.happened(EventName.NOT_ENFORCED, before), 10)
    event = run.last(EventName.NOT_ENFORCED)
    assert event.data["reason"] == "home"
    assert len(event.data["zones"]) == 1
    assert "home is on its forbidden side" in event.text
    run.run_until(run.happened(EventName.ENFORCED, before), 10)
    assert run.last(EventName.ENFORCED).data["not_enforced"] == event.data["zones"]
    told = [one for one in run.events[before:] if one.name is EventName.NOT_ENFORCED]
    assert len(told) == 1


def test_a_zone_that_the_armed_rover_is_put_into_is_said_to_be_not_enforced():
    run = driving(conductor())
    wait(run, 10)
    before = len(run.events)
    place = run.vehicles[0].position
    upload(
        run,
        m.MissionType.FENCE,
        sent_items(Fence((*FENCE.zones, CircleZone(ZoneKind.EXCLUSION, place, 5.0)))),
    )
    run.run_until(run.happened(EventName.NOT_ENFORCED, before), 10)
    assert run.last(EventName.NOT_ENFORCED).data["reason"] == "the vehicle"


def test_a_mission_that_the_vehicle_refuses_is_not_driven():
    """A limit that the bridge does not know of: the vehicle says of a verified mission that it is not valid."""
    run = conductor(once=True, request=Request(clearance_m=1.5).to(FAR))
    vehicle = run.vehicles[0]
    judge = vehicle.rover._judge_mission

    def refuse() -> None:
        judge()
        vehicle.rover.progress.is_valid = False
        vehicle.rover._say(2, "Geofence violation for waypoint 2")

    vehicle.rover._judge_mission = refuse
    assert run.run(30) is State.FAILED
    assert "PX4 reports it as not valid" in str(run.director.trouble)
    assert "Geofence violation for waypoint 2" in str(run.director.trouble)
    assert not vehicle.is_armed
    assert run.modes_sent == []


class TestTakeovers:
    @VERSIONS
    @pytest.mark.parametrize("mode", [MODES.hold, MODES.rtl], ids=["hold", "rtl"])
    @pytest.mark.parametrize("is_heard", [False, True])
    def test_on_the_way(self, firmware, mode, is_heard):
        run = driving(conductor(rover(firmware)))
        wait(run, 8)
        (run.ground_station if is_heard else lambda one: unheard(run, one))(mode_command(mode))
        run.run_until(run.happened(EventName.TAKEN_OVER), 5)
        event, sent = run.last(EventName.TAKEN_OVER), len(run.modes_sent)
        assert run.director.state is State.LET_GO
        assert event.data["by"] == ("ground_station" if is_heard else "unknown")
        assert event.data["mode"] == MODES.named(mode)
        wait(run, 5)
        assert len(run.modes_sent) == sent
        assert run.director.state is State.LET_GO

    def test_disarming_on_the_way_puts_it_back_to_hold(self):
        run = driving(conductor())
        wait(run, 8)
        unheard(run, m.CommandLong(1, 1, Command.COMPONENT_ARM_DISARM, param1=0.0))
        run.run_until(run.happened(EventName.TAKEN_OVER), 5)
        wait(run, 6)
        assert run.vehicles[0].mode == MODES.hold  # in AUTO.MISSION, arming it would drive off
        assert not run.vehicles[0].is_armed

    @pytest.mark.parametrize(
        "state", [State.UPLOADING, State.VERIFIED, State.STARTING, State.HOLDING, State.PLANNING]
    )
    @pytest.mark.parametrize("is_disarming", [False, True])
    def test_in_every_state(self, state, is_disarming):
        run = driving(conductor())
        wait(run, 5)
        run.planning_s = 0.5
        run.director.take_target(NEAR, run.now_s)
        run.run_until(lambda: run.director.state is state, 30)
        wait(run, 0.6)  # what is overheard so soon after a target may have been said before it
        if is_disarming:
            unheard(run, m.CommandLong(1, 1, Command.COMPONENT_ARM_DISARM, param1=0.0))
        else:
            unheard(run, mode_command(MODES.rtl))
        run.run_until(run.happened(EventName.TAKEN_OVER), 10)
        wait(run, 0.5)
        sent, armings = len(run.modes_sent), armings_sent(run)
        wait(run, 10)
        assert run.director.state is State.LET_GO
        assert [one for one in run.modes_sent[sent:] if one != PX4_HOLD] == []
        assert armings_sent(run) == armings

    def test_disarmed_just_before_the_start_it_is_not_armed_again(self):
        """AUTO.MISSION, unlike MISSION_START, arms nothing: a disarming that crosses it stands."""
        run = ready(conductor())
        run.director.take_target(FAR, run.now_s)
        run.run_until(lambda: PX4_MISSION in run.modes_sent, 20)
        unheard(run, m.CommandLong(1, 1, Command.COMPONENT_ARM_DISARM, param1=0.0))
        wait(run, 6)
        assert not run.vehicles[0].is_armed
        assert run.director.state is State.LET_GO
        assert run.vehicles[0].mode == MODES.hold

    def test_hold_at_the_very_end_is_the_arrival(self):
        run = driving(conductor())
        run.run_until(lambda: distance_m(run.vehicles[0].position, FAR) < 0.9, 200)
        unheard(run, mode_command(MODES.hold))
        run.run_until(lambda: run.director.state is State.ARRIVED, 5)
        assert EventName.TAKEN_OVER not in names(run)

    def test_a_click_of_nobodys_that_is_not_heard_takes_the_vehicle(self):
        run = driving(conductor())
        wait(run, 8)
        unheard(run, reposition(HOME))
        run.run_until(run.happened(EventName.TAKEN_OVER), 5)
        assert run.director.state is State.LET_GO

    def test_somebody_who_drives_it_in_hold_while_it_is_stopped_has_it(self):
        run = driving(conductor())
        wait(run, 8)
        run.director.take_target(NEAR, run.now_s)
        run.run_until(lambda: run.director.state is State.HOLDING, 5)
        wait(run, 0.3)
        unheard(run, reposition(FAR))
        run.run_until(run.happened(EventName.TAKEN_OVER), 15)
        assert run.director.state is State.LET_GO


def armings_sent(run) -> int:
    return sum(
        isinstance(one, m.CommandLong) and one.command == Command.COMPONENT_ARM_DISARM for one in run.sent
    )


class TestFailsafes:
    @VERSIONS
    def test_a_breach_is_the_autopilots_own_hold(self, firmware):
        run = driving(conductor(rover(firmware)))
        wait(run, 8)
        rover_ = run.vehicles[0].rover
        rover_._area = type(rover_._area)(
            sent_items(Fence((CircleZone(ZoneKind.EXCLUSION, run.vehicles[0].position, 3.0),))), rover_.frame
        )
        run.run_until(run.happened(EventName.TAKEN_OVER), 5)
        assert run.last(EventName.TAKEN_OVER).data["by"] == "autopilot"
        assert "AUTO.LOITER itself: fence breach" in run.last(EventName.TAKEN_OVER).text
        assert EventName.BREACH in names(run)
        wait(run, 8)
        assert run.director.state is State.LET_GO  # where it was stopped it is left

    def test_a_failsafe_without_a_text_is_seen_in_the_heartbeat(self):
        run = driving(conductor())
        wait(run, 8)
        run.vehicles[0].rover._enter((4, 5))
        run.vehicles[0].rover.is_in_failsafe = True
        run.run_until(run.happened(EventName.TAKEN_OVER), 5)
        assert run.last(EventName.TAKEN_OVER).text.startswith(
            "the autopilot switched the vehicle to AUTO.RTL itself: failsafe"
        )

    def test_a_text_alone_blames_nobody(self):
        run = driving(conductor())
        wait(run, 8)
        run.down.push(m.Frame(1, 1, m.Statustext(2, "Failsafe activated")), run.now_s)
        wait(run, 0.5)
        unheard(run, mode_command(MODES.hold))
        run.run_until(run.happened(EventName.TAKEN_OVER), 5)
        assert run.last(EventName.TAKEN_OVER).data["by"] == "unknown"


class TestLinks:
    @VERSIONS
    def test_a_link_that_was_cut_is_taken_up_again(self, firmware):
        run = driving(conductor(rover(firmware)))
        wait(run, 8)
        run.is_cut = True
        run.run_until(run.happened(EventName.LINK_LOST), 10)
        run.is_cut = False
        run.run_until(run.happened(EventName.LINK_BACK), 10)
        run.run_until(lambda: run.director.state is State.DRIVING, 20)
        run.run_until(lambda: run.director.state is State.ARRIVED, 200)
        assert EventName.TAKEN_OVER not in names(run)

    def test_a_reboot_ends_all_that_was_wanted(self):
        run = driving(conductor())
        wait(run, 8)
        run.vehicles[0].reboot(run.now_s)
        run.run_until(run.happened(EventName.REBOOTED), 20)
        run.run_until(lambda: run.director.state is State.READY, 20)
        sent = len(run.modes_sent)
        wait(run, 10)
        assert len(run.modes_sent) == sent

    @VERSIONS
    @pytest.mark.parametrize("seed", range(3))
    def test_over_a_bad_link_it_arrives(self, firmware, seed):
        faults = Faults(loss=0.1, duplicate=0.05, latency_s=0.1, jitter_s=0.05)
        run = conductor(rover(firmware))
        run.up, run.down = FaultyLink(faults, 2 * seed), FaultyLink(faults, 2 * seed + 1)
        driving(run)
        run.run_until(lambda: run.director.state is State.ARRIVED, 300)
        assert distance_m(run.vehicles[0].position, FAR) < 1.0
        assert run.vehicles[0].rover.breaches == 0

    def test_an_autopilot_that_was_swapped_is_not_believed(self):
        run = driving(conductor())
        wait(run, 5)
        run.down.push(m.Frame(1, 1, m.Heartbeat(10, 3, 81, 10, 4)), run.now_s)
        wait(run, 1)
        assert run.director.state is State.DRIVING


class TestSingleJobs:
    @VERSIONS
    def test_plan_upload_drive(self, firmware):
        run = conductor(rover(firmware), once=True, request=Request(clearance_m=1.5).to(FAR))
        assert run.run(200) is State.DONE
        assert distance_m(run.vehicles[0].position, FAR) < 1.0

    def test_without_arming_a_disarmed_rover_is_left(self):
        run = conductor(once=True, arm=False, request=Request(clearance_m=1.5).to(FAR))
        assert run.run(60) is State.FAILED
        assert "not armed" in str(run.director.trouble)
        assert run.modes_sent == []

    def test_planning_alone_sends_no_mode(self):
        run = conductor(
            once=True, upload=False, drive=False, arm=False, request=Request(clearance_m=1.5).to(FAR)
        )
        assert run.run(60) is State.DONE
        assert run.modes_sent == []

    def test_an_upload_alone_ends_verified(self):
        run = conductor(once=True, drive=False, arm=False, request=Request(clearance_m=1.5).to(FAR))
        assert run.run(60) is State.DONE
        assert [one.command for one in run.vehicles[0].mission][-1] == Command.NAV_WAYPOINT
        assert EventName.ENFORCED not in names(run)


def test_somebody_elses_mission_is_noticed_by_its_id():
    run = driving(conductor())
    wait(run, 5)
    upload(run, m.MissionType.MISSION, run.vehicles[0].mission[:2])
    run.run_until(run.happened(EventName.MISSION_CHANGED), 10)
    assert run.director.state is State.LET_GO


def test_a_target_out_of_reach_is_refused():
    run = ready(conductor())
    run.director.take_target(replace_lat(HOME), run.now_s)
    run.run_until(run.happened(EventName.NO_PLAN), 30)
    assert run.last(EventName.NO_PLAN).data["error"] in (NoRouteError.__name__, "TargetBlockedError")


def replace_lat(place):
    return type(place)(place.lat_deg + 0.003, place.lon_deg)


def test_an_obstacle_across_the_route_is_driven_round():
    run = driving(conductor(obstacle_sources=frozenset({ObstacleSource.KEYBOARD})))
    wait(run, 8)
    before = len(run.events)
    run.director.take_obstacle(WALL.zones[-1].centre, 3.0, run.now_s)
    run.run_until(run.happened(EventName.OBSTACLE_ACROSS, before), 10)
    run.run_until(run.happened(EventName.DRIVING, before), 60)
    run.run_until(lambda: run.director.state is State.ARRIVED, 200)
    assert distance_m(run.vehicles[0].position, FAR) < 1.0


@VERSIONS
def test_rtl_is_answered_by_a_route_once(firmware):
    run = driving(conductor(rover(firmware), homing=Homing(is_kept=True, by_route=True)))
    wait(run, 20)
    before = len(run.events)
    unheard(run, mode_command(MODES.rtl))
    run.run_until(run.happened(EventName.CALLED_HOME, before), 5)
    run.run_until(run.happened(EventName.GOING_HOME, before), 30)
    run.run_until(run.happened(EventName.DRIVING, before), 60)
    run.run_until(lambda: run.director.state is State.ARRIVED, 200)
    assert distance_m(run.vehicles[0].position, HOME) < 1.0
    assert run.vehicles[0].rover.breaches == 0


def test_the_second_rtl_is_the_operators():
    run = driving(conductor(homing=Homing(is_kept=True, by_route=True)))
    wait(run, 20)
    unheard(run, mode_command(MODES.rtl))
    run.run_until(run.happened(EventName.GOING_HOME), 30)
    wait(run, 6)
    unheard(run, mode_command(MODES.rtl))
    run.run_until(run.happened(EventName.TAKEN_OVER), 10)
    assert run.director.state is State.LET_GO


def test_position_targets_and_guided_items_are_none_to_px4():
    run = ready(conductor(target_sources=frozenset(TargetSource) - {TargetSource.HOME}))
    lat_e7, lon_e7 = 400_720_926, -1_052_286_152
    run.ground_station(m.SetPositionTargetGlobalInt(1, 1, 0, 6, 0xFFC, lat_e7, lon_e7, 0.0))
    wait(run, 2)
    assert EventName.TARGET not in names(run)
