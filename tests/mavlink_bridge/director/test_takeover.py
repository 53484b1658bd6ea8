"""The operator's word in the middle of every step of ours; and what other surprises must not make of the bridge."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import pytest
from director.promises import Promises
from director.test_bridge_director import (
    FAR,
    FENCE,
    HOME,
    IN_BARN,
    NEAR,
    arm,
    conductor,
    driving,
    ready,
    reposition,
    upload,
    wall_across_the_route,
)

from mavlink_bridge.director import EventName, State, TargetSource
from mavlink_bridge.mavlink import messages as m
from mavlink_bridge.mavlink.rover import Mode
from mavlink_bridge.simulator import SimulatedVehicle, SimulatorConfig
from missions.fence import fence_to_items
from missions.geo import LatLon, distance_m, to_e7
from missions.items import Command, MissionItem, waypoint, with_home

if TYPE_CHECKING:
    from director.conducting import Conductor

MANUAL = 0


def unheard(run: Conductor, message: m.Message) -> None:
    """Let somebody act on the vehicle whom the bridge does not hear: a remote control, a ground station on a link of its own."""
    run.vehicles[0].receive(m.Frame(255, 190, message), run.now_s)


def modes_sent(run: Conductor, since: int = 0) -> list[int]:
    return [
        int(message.param2)
        for message in run.sent[since:]
        if isinstance(message, m.CommandLong) and message.command == Command.DO_SET_MODE
    ]


def armings_sent(run: Conductor, since: int = 0) -> int:
    return sum(
        isinstance(message, m.CommandLong) and message.command == Command.COMPONENT_ARM_DISARM
        for message in run.sent[since:]
    )


def is_holding(message: m.Message) -> bool:
    return isinstance(message, m.Heartbeat) and message.custom_mode == Mode.HOLD


def wait(run: Conductor, seconds: float) -> None:
    until_s = run.now_s + seconds
    while run.now_s < until_s:
        run.step()


def deaf_to(run: Conductor, *kinds: type[m.Message]) -> None:
    """Lose some of what the vehicle says to the bridge or to everyone."""
    push = run.down.push

    def hear(frame: m.Frame, now_s: float) -> None:
        is_anothers = getattr(frame.message, "target_component", 195) not in (0, 195)
        if is_anothers or not isinstance(frame.message, kinds):
            push(frame, now_s)

    run.down.push = hear


def hearing_all(run: Conductor) -> None:
    run.down.push = type(run.down).push.__get__(run.down)


def left_alone(run: Conductor, mode: int, seconds: float = 20.0) -> bool:
    """Return whether the vehicle stays as the operator has it, and nothing is sent to change that."""
    wait(run, 1.5)  # a heartbeat tells
    sent = len(run.sent)
    wait(run, seconds)
    return run.vehicles[0].mode == mode and not modes_sent(run, sent) and not armings_sent(run, sent)


@pytest.mark.parametrize("after_s", [0.1, 0.3, 0.6, 0.9, 1.2])
@pytest.mark.parametrize("mode", [MANUAL, 11])
def test_a_takeover_nobody_announces_right_after_our_hold(mode, after_s):
    run = driving(conductor())
    wait(run, 6)
    run.director.take_target(NEAR, run.now_s)
    run.run_until(lambda: run.vehicles[0].mode == Mode.HOLD, 2)
    wait(run, after_s)
    unheard(run, m.SetMode(1, 1, mode))
    assert left_alone(run, mode)
    assert run.director.state is State.LET_GO


def test_a_takeover_while_hold_is_in_flight():
    run = driving(conductor())
    wait(run, 6)
    run.director.take_target(NEAR, run.now_s)
    deaf_to(run, m.CommandAck)
    run.step()
    unheard(run, m.SetMode(1, 1, MANUAL))
    assert left_alone(run, MANUAL)
    assert run.director.state is State.LET_GO


def test_a_takeover_while_auto_is_in_flight():
    run = ready(conductor())
    arm(run)
    run.director.take_target(FAR, run.now_s)
    run.run_until(lambda: run.director.state is State.VERIFIED or run.director.state is State.STARTING, 20)
    deaf_to(run, m.CommandAck)
    run.run_until(lambda: Mode.AUTO in modes_sent(run), 5)
    wait(run, 0.1)
    unheard(run, m.SetMode(1, 1, MANUAL))
    assert left_alone(run, MANUAL)
    assert run.director.state is State.LET_GO


def test_a_hold_that_somebody_presses_is_told_from_ours_where_it_is_overheard():
    run = driving(conductor())
    wait(run, 6)
    run.director.take_target(NEAR, run.now_s)
    run.run_until(lambda: run.director.state is State.UPLOADING, 10)
    run.ground_station(m.SetMode(1, 1, Mode.HOLD))
    run.run_until(run.happened(EventName.TAKEN_OVER), 2)
    run.run_until(lambda: run.director.state is State.LET_GO, 20)
    assert left_alone(run, Mode.HOLD)


def test_a_takeover_and_back_to_hold_during_an_upload_is_not_forgotten():
    run = driving(conductor())
    wait(run, 6)
    run.director.take_target(NEAR, run.now_s)
    run.run_until(lambda: run.director.state is State.UPLOADING, 10)
    deaf_to(run, m.MissionRequest, m.MissionRequestInt, m.MissionAck, m.MissionCount, m.MissionItemInt)
    unheard(run, m.SetMode(1, 1, MANUAL))
    run.run_until(run.happened(EventName.TAKEN_OVER), 3)
    assert run.director.state is State.WITHDRAWING
    unheard(run, m.SetMode(1, 1, Mode.HOLD))
    hearing_all(run)
    run.run_until(lambda: run.director.state is State.LET_GO, 60)
    assert left_alone(run, Mode.HOLD)
    assert run.vehicles[0].mission[-1].position == NEAR  # no half mission was left behind


def test_a_click_during_an_upload_stops_the_vehicle_at_once():
    run = driving(conductor())
    wait(run, 6)
    run.director.take_target(NEAR, run.now_s)
    run.run_until(lambda: run.director.state is State.UPLOADING, 10)
    clicked_s = run.now_s
    run.ground_station(reposition(FAR))
    run.run_until(lambda: run.vehicles[0].mode == Mode.GUIDED, 0.2)
    assert run.run_until(lambda: run.vehicles[0].mode == Mode.HOLD, 2) - clicked_s <= 0.5
    run.run_until(lambda: run.director.state is State.ARRIVED)
    assert distance_m(run.vehicles[0].position, FAR) < 4.0
    assert run.vehicles[0].breaches == 0


def test_a_click_while_the_bridge_still_learns_stops_the_vehicle_at_once():
    run = conductor()
    run.run_until(lambda: run.director.state is State.LEARNING)
    arm(run)
    run.ground_station(reposition(FAR))
    clicked_s = run.now_s
    assert run.run_until(lambda: run.vehicles[0].mode == Mode.HOLD, 2) - clicked_s <= 0.5
    run.run_until(lambda: run.director.state is State.ARRIVED)
    assert distance_m(run.vehicles[0].position, FAR) < 4.0


@pytest.mark.parametrize(
    "state", [State.HOLDING, State.PLANNING, State.PROPOSED, State.STARTING, State.DRIVING]
)
def test_a_second_click_stops_it_again(state):
    run = ready(conductor(confirm=state is State.PROPOSED))
    arm(run)
    run.ground_station(reposition(NEAR))
    run.run_until(lambda: run.director.state is state, 20)
    wait(run, 0.3 if state is State.HOLDING else 0.0)
    clicked_s = run.now_s
    run.ground_station(reposition(FAR))
    assert run.run_until(lambda: run.vehicles[0].mode == Mode.HOLD, 2) - clicked_s <= 0.5
    run.director.orders = replace(run.director.orders, confirm=False)
    run.run_until(lambda: run.director.state is State.ARRIVED)
    assert distance_m(run.vehicles[0].position, FAR) < 4.0
    assert run.vehicles[0].breaches == 0


@pytest.mark.parametrize("again_after_s", [0.3, 1.0, 2.0, 2.9])
def test_a_click_that_the_ground_station_repeats_stops_it_again(again_after_s):
    run = ready(conductor())
    arm(run)
    run.ground_station(reposition(FAR))
    run.run_until(lambda: run.vehicles[0].mode == Mode.HOLD, 1)
    wait(run, again_after_s)
    run.ground_station(reposition(FAR))
    again_s = run.now_s
    assert run.run_until(lambda: run.vehicles[0].mode == Mode.HOLD, 2) - again_s <= 0.5
    run.run_until(lambda: run.director.state is State.ARRIVED)
    assert run.vehicles[0].breaches == 0


def test_a_click_that_reaches_the_vehicle_after_our_hold():
    run = ready(conductor())
    arm(run)
    run.down.push(m.Frame(255, 190, reposition(FAR)), run.now_s)  # we hear it first
    run.run_until(lambda: run.vehicles[0].mode == Mode.HOLD, 1)
    wait(run, 0.2)
    unheard(run, reposition(FAR))
    run.run_until(lambda: run.director.state is State.ARRIVED)
    assert run.vehicles[0].breaches == 0
    assert not run.happened(EventName.TAKEN_OVER)()


@pytest.mark.parametrize("after_s", [0.0, 0.1, 0.5, 1.0])
def test_a_target_while_it_starts_does_not_drive_the_route_before(after_s):
    run = ready(conductor())
    arm(run)
    run.director.take_target(FAR, run.now_s)
    run.run_until(lambda: run.director.state is State.STARTING, 20)
    wait(run, after_s)
    run.director.take_target(NEAR, run.now_s)
    run.run_until(lambda: run.director.state is State.UPLOADING, 20)
    assert run.vehicles[0].mode == Mode.HOLD
    run.run_until(lambda: run.director.state is State.ARRIVED)
    assert distance_m(run.vehicles[0].position, NEAR) < 4.0


def test_a_fence_that_changes_during_an_upload_is_not_driven_into():
    run = ready(conductor())
    arm(run)
    run.director.take_target(FAR, run.now_s)
    run.run_until(lambda: run.director.state is State.UPLOADING, 20)
    deaf_to(run, m.MissionRequest, m.MissionRequestInt)
    upload_overheard(run, fence_to_items(wall_across_the_route()))
    assert run.director.state is State.UPLOADING
    hearing_all(run)
    run.run_until(lambda: run.director.state is State.DRIVING, 40)
    assert run.happened(EventName.ROUTE_BROKEN)()
    run.run_until(lambda: run.director.state is State.ARRIVED)
    assert run.vehicles[0].breaches == 0


def upload_overheard(run: Conductor, items: tuple[MissionItem, ...]) -> None:
    """Let a ground station upload a fence, both sides of it heard by the bridge."""
    run.ground_station(m.MissionCount(1, 1, len(items), m.MissionType.FENCE))
    for seq, item in enumerate(items):
        wait(run, 0.04)
        run.ground_station(_item_message(item, seq, m.MissionType.FENCE))
    wait(run, 0.2)


def test_a_fence_that_changed_unheard_is_read_before_the_drive():
    run = ready(conductor())
    arm(run)
    run.director.take_target(FAR, run.now_s)
    run.run_until(lambda: run.director.state is State.UPLOADING, 20)
    deaf_to(run, m.MissionRequest, m.MissionRequestInt)
    vehicle = run.vehicles[0]
    # Only the vehicle's word to the other ground station is heard.
    upload(run, m.MissionType.FENCE, fence_to_items(wall_across_the_route()))
    hearing_all(run)
    broken_before_driving = []
    run.meddle = lambda run: broken_before_driving.append(vehicle.mode == Mode.AUTO)
    run.run_until(run.happened(EventName.ROUTE_BROKEN), 40)
    assert not any(broken_before_driving)
    run.meddle = None
    run.run_until(lambda: run.director.state is State.ARRIVED)
    assert vehicle.breaches == 0


def test_after_a_lost_link_nothing_is_driven_that_the_operator_had_taken_over():
    run = driving(conductor(arm=True))
    wait(run, 5)
    run.ground_station(m.SetMode(1, 1, MANUAL))
    run.run_until(lambda: run.director.state is State.LET_GO, 5)
    cut(run)
    run.run_until(lambda: run.director.state is State.READY, 20)
    assert left_alone(run, MANUAL)


def cut(run: Conductor, seconds: float = 8.0) -> None:
    run.is_cut = True
    wait(run, seconds)
    run.is_cut = False


def test_after_a_lost_link_a_takeover_in_the_meantime_counts():
    run = driving(conductor(arm=True))
    wait(run, 5)
    run.is_cut = True
    unheard(run, m.SetMode(1, 1, MANUAL))
    run.run_until(lambda: run.director.state is State.LOST, 10)
    unheard(run, m.SetMode(1, 1, Mode.HOLD))
    run.is_cut = False
    run.run_until(lambda: run.director.state is State.READY, 20)
    assert left_alone(run, Mode.HOLD)


def test_after_arrival_a_lost_link_drives_nowhere():
    run = driving(conductor(arm=True), NEAR)
    run.run_until(lambda: run.director.state is State.ARRIVED)
    run.run_until(lambda: run.vehicles[0].mode == Mode.HOLD, 2)
    wait(run, 1)
    unheard(run, m.SetMode(1, 1, MANUAL))
    cut(run)
    run.run_until(lambda: run.director.state is State.READY, 20)
    assert left_alone(run, MANUAL)


def test_a_fence_that_broke_the_route_while_the_link_was_lost():
    run = driving(conductor())
    wait(run, 3)
    run.is_cut = True
    run.run_until(lambda: run.director.state is State.LOST, 10)
    upload_unheard(run, m.MissionType.FENCE, fence_to_items(wall_across_the_route()))
    run.is_cut = False
    run.run_until(run.happened(EventName.ROUTE_BROKEN), 20)
    run.run_until(lambda: run.director.state is State.ARRIVED)
    assert run.vehicles[0].breaches == 0
    assert distance_m(run.vehicles[0].position, FAR) < 4.0


def upload_unheard(run: Conductor, mission_type: m.MissionType, items: tuple[MissionItem, ...]) -> None:
    """Let somebody upload a list on a link of his own."""
    unheard(run, m.MissionCount(1, 1, len(items), mission_type))
    for seq, item in enumerate(items):
        wait(run, 0.04)
        unheard(run, _item_message(item, seq, mission_type))
    wait(run, 0.2)


def _item_message(item: MissionItem, seq: int, mission_type: m.MissionType) -> m.MissionItemInt:
    place = (item.lat_e7, item.lon_e7, 0.0)
    return m.MissionItemInt(1, 1, seq, 3, item.command, 0, 1, *item.params, *place, mission_type)


@pytest.mark.parametrize("state", [State.HOLDING, State.UPLOADING, State.STARTING, State.DRIVING])
def test_a_vehicle_that_was_switched_off_and_on_is_not_armed_and_driven_again(state):
    run = ready(conductor(arm=True))
    run.run_until(lambda: run.now_s > 15)
    arm(run)
    run.ground_station(reposition(FAR))
    run.run_until(lambda: run.director.state is state, 20)
    run.vehicles[0].reboot(run.now_s)
    run.run_until(run.happened(EventName.REBOOTED), 30)
    run.run_until(lambda: run.director.state is State.READY, 60)
    assert left_alone(run, run.vehicles[0].mode, 60)
    assert not run.vehicles[0].is_armed
    run.director.take_target(NEAR, run.now_s)  # a new target is a new word
    run.run_until(lambda: run.director.state is State.ARRIVED)


def test_disarming_is_a_takeover():
    run = driving(conductor(arm=True))
    wait(run, 5)
    unheard(run, m.CommandLong(1, 1, Command.COMPONENT_ARM_DISARM, param1=0.0))
    run.run_until(run.happened(EventName.TAKEN_OVER), 3)
    assert "disarmed" in run.last(EventName.TAKEN_OVER).text
    upload(run, m.MissionType.FENCE, fence_to_items(wall_across_the_route()))
    assert left_alone(run, run.vehicles[0].mode)
    assert not run.vehicles[0].is_armed


def test_a_target_that_was_blocked_long_ago_takes_no_vehicle_from_its_operator():
    run = ready(conductor())
    arm(run)
    run.director.take_target(IN_BARN, run.now_s)
    run.run_until(run.happened(EventName.NO_PLAN), 10)
    unheard(run, m.SetMode(1, 1, Mode.GUIDED))
    wait(run, 5)
    upload(run, m.MissionType.FENCE, fence_to_items(wall_across_the_route()))
    assert left_alone(run, Mode.GUIDED)


def test_a_yes_to_nothing_is_no_yes_to_what_comes():
    run = ready(conductor(confirm=True, drive=False))
    run.director.confirm(run.now_s)
    run.director.take_target(FAR, run.now_s)
    run.director.confirm(run.now_s)
    run.run_until(lambda: run.director.state is State.PROPOSED, 5)
    wait(run, 5)
    assert run.director.state is State.PROPOSED


def test_a_mission_that_comes_with_the_fence_that_broke_ours_is_not_overwritten():
    run = driving(conductor())
    wait(run, 5)
    theirs = with_home((waypoint(LatLon(40.0712200, -105.2300000)), waypoint(NEAR)), HOME)
    deaf_to(run, m.MissionAck, m.MissionCurrent, m.Statustext)
    run.down.push = _without_signs(run.down.push)
    upload_unheard(run, m.MissionType.MISSION, theirs)
    wait(run, 2)
    upload(run, m.MissionType.FENCE, fence_to_items(wall_across_the_route()))
    run.run_until(run.happened(EventName.MISSION_CHANGED), 30)
    wait(run, 10)
    assert [item.position for item in run.vehicles[0].mission[1:]] == [item.position for item in theirs[1:]]
    assert run.director.state is State.LET_GO


def _without_signs(push):
    """Lose the vehicle's acknowledgement of a mission to another ground station."""

    def hear(frame: m.Frame, now_s: float) -> None:
        message = frame.message
        is_sign = isinstance(message, m.MissionAck) and message.mission_type == m.MissionType.MISSION
        if not is_sign or message.target_component == 195:
            push(frame, now_s)

    return hear


def test_a_parameter_of_the_fence_that_changes_under_the_drive():
    run = driving(conductor())
    wait(run, 8)
    position = run.vehicles[0].position
    radius_m = distance_m(position, HOME) + 8.0
    for name, value in (("FENCE_TYPE", 6.0), ("FENCE_RADIUS", radius_m)):
        run.ground_station(m.ParamSet(1, 1, name, value, 9))
        wait(run, 0.5)
    run.run_until(run.happened(EventName.ROUTE_BROKEN), 5)
    run.run_until(lambda: run.vehicles[0].mode == Mode.HOLD, 1)
    run.run_until(run.happened(EventName.NO_PLAN), 20)  # the target lies outside the circle
    assert run.vehicles[0].breaches == 0


def test_a_straight_line_is_warned_of_before_any_heartbeat_tells_guided():
    run = ready(conductor(drive=False))
    arm(run)
    run.run_until(lambda: run.director.situation.armed)
    run.ground_station(reposition(FAR))
    wait(run, 0.1)
    assert run.happened(EventName.STRAIGHT_LINE_UNSAFE)()


def test_commands_to_our_component_are_all_answered():
    run = ready(conductor(drive=False))
    run.ground_station(m.CommandLong(1, 195, 42000))
    wait(run, 0.2)
    nowhere = replace(reposition(FAR, component=195), x=0, y=0)
    run.ground_station(nowhere)
    wait(run, 0.2)
    run.ground_station(reposition(FAR, component=195))
    run.run_until(lambda: run.director.state is State.VERIFIED, 5)
    run.ground_station(reposition(FAR, component=195))  # the answer was lost
    wait(run, 0.2)
    answers = [(message.command, message.result) for message in run.sent if isinstance(message, m.CommandAck)]
    assert answers == [
        (42000, m.MavResult.UNSUPPORTED),
        (Command.DO_REPOSITION, m.MavResult.DENIED),
        (Command.DO_REPOSITION, m.MavResult.IN_PROGRESS),
        (Command.DO_REPOSITION, m.MavResult.ACCEPTED),
        (Command.DO_REPOSITION, m.MavResult.ACCEPTED),
    ]
    run.run_until(
        lambda: any("has no position" in text.text for text in run.sent if isinstance(text, m.Statustext)),
        5,
    )


def test_a_command_to_our_component_is_denied_where_it_is_not_heeded():
    run = ready(conductor(drive=False, target_sources=frozenset({TargetSource.TYPED})))
    run.ground_station(reposition(FAR, component=195))
    wait(run, 1)
    answers = [message.result for message in run.sent if isinstance(message, m.CommandAck)]
    assert answers == [m.MavResult.DENIED]
    assert run.director.state is State.READY


def test_a_bridge_with_a_system_id_of_its_own_is_commanded_by_it():
    run = ready(conductor(drive=False, identity=(2, 195)))
    run.ground_station(replace(reposition(FAR, component=195), target_system=2))
    run.run_until(lambda: run.director.state is State.VERIFIED, 5)
    answers = [message.result for message in run.sent if isinstance(message, m.CommandAck)]
    assert answers == [m.MavResult.IN_PROGRESS, m.MavResult.ACCEPTED]


def test_another_askers_target_cancels_the_one_before():
    run = ready(conductor(drive=False, confirm=True))
    run.ground_station(reposition(IN_BARN, component=195))
    run.down.push(m.Frame(254, 190, reposition(FAR, component=195)), run.now_s + 0.01)
    wait(run, 0.4)
    answers = {
        message.target_system: message.result for message in run.sent if isinstance(message, m.CommandAck)
    }
    assert answers[255] in (m.MavResult.CANCELLED, m.MavResult.DENIED)
    assert answers[254] == m.MavResult.ACCEPTED


def test_somebody_who_drives_the_uploaded_mission_is_watched():
    run = ready(conductor(drive=False))
    run.director.take_target(FAR, run.now_s)
    run.run_until(lambda: run.director.state is State.VERIFIED, 10)
    arm(run)
    run.ground_station(m.SetMode(1, 1, Mode.AUTO))
    run.run_until(lambda: run.director.state is State.DRIVING, 5)
    run.run_until(run.happened(EventName.ARRIVED), 200)
    assert not modes_sent(run)


def test_a_lost_link_does_not_make_the_upload_only_bridge_forget():
    run = ready(conductor(drive=False))
    run.director.take_target(FAR, run.now_s)
    run.run_until(lambda: run.director.state is State.VERIFIED, 10)
    cut(run)
    run.run_until(lambda: run.director.state is State.VERIFIED, 20)
    assert sum(event.name is EventName.UPLOADING for event in run.events) == 1


def test_a_rally_point_that_somebody_sets_is_a_target_where_asked_for():
    rally = (MissionItem(Command.RALLY_POINT, 3, (0.0, 0.0, 0.0, 0.0), *to_e7(NEAR), 0.0),)
    vehicle = SimulatedVehicle(
        SimulatorConfig(home=HOME, fence=fence_to_items(FENCE), parameters={"FENCE_ENABLE": 1.0})
    )
    run = ready(conductor(vehicle=vehicle, drive=False, target_sources=frozenset({TargetSource.RALLY})))
    upload(run, m.MissionType.RALLY, rally)
    run.run_until(run.happened(EventName.VERIFIED), 30)
    assert run.last(EventName.TARGET).data["source"] == TargetSource.RALLY
    assert distance_m(LatLon(*run.last(EventName.TARGET).data["position"]), NEAR) < 0.1
    targets = sum(event.name is EventName.TARGET for event in run.events)
    wait(run, 130)  # two slow polls
    assert sum(event.name is EventName.TARGET for event in run.events) == targets


def test_it_drives_only_after_a_heartbeat_that_is_younger_than_the_upload():
    run = ready(conductor())
    arm(run)
    run.director.take_target(FAR, run.now_s)
    run.run_until(run.happened(EventName.VERIFIED), 20)
    deaf_to(run, m.Heartbeat)
    wait(run, 3)
    assert Mode.AUTO not in modes_sent(run)
    hearing_all(run)
    run.run_until(lambda: run.director.state is State.DRIVING, 5)


def test_the_heartbeat_before_the_drive_is_asked_for():
    run = ready(conductor())
    arm(run)
    run.director.take_target(FAR, run.now_s)
    verified_s = run.run_until(run.happened(EventName.VERIFIED), 20)
    assert run.run_until(lambda: Mode.AUTO in modes_sent(run), 5) - verified_s <= 0.2


def test_hold_is_sent_again_after_a_second_of_silence_and_once_a_heartbeat_shows_that_it_was_lost():
    run = driving(conductor())
    wait(run, 6)
    run.up.push = lambda _frame, _now_s: None
    begun = len(run.sent)
    run.director.take_target(NEAR, run.now_s)
    wait(run, 1.9)
    sent = modes_sent(run, begun)
    assert set(sent) == {Mode.HOLD}
    assert 2 <= len(sent) <= 4  # a heartbeat comes each second


def test_a_heartbeat_that_was_overtaken_is_no_takeover():
    run = ready(conductor())
    arm(run)
    heard, push = [], run.down.push
    run.down.push = lambda frame, now_s: (heard.append(frame), push(frame, now_s))
    run.director.take_target(FAR, run.now_s)
    run.run_until(lambda: Mode.AUTO in modes_sent(run), 20)
    held = next(frame for frame in heard if is_holding(frame.message))
    run.run_until(lambda: run.director.situation.mode == Mode.AUTO, 5)
    run.director.receive(held, run.now_s + 0.1)
    run.run_until(lambda: run.director.state is State.ARRIVED)


def test_a_fence_whose_writing_is_never_confirmed_is_read_again_all_the_same():
    """The word that somebody's list is accepted may be lost on its way to us: the vehicle asked for its items."""
    run = driving(conductor())
    receive = run.director.receive

    def without_words(frame: m.Frame, now_s: float) -> None:
        if not isinstance(frame.message, m.MissionAck | m.Statustext):
            receive(frame, now_s)

    run.director.receive = without_words
    upload(run, m.MissionType.FENCE, fence_to_items(wall_across_the_route()))
    run.director.receive = receive
    written_s = run.now_s
    assert run.run_until(run.happened(EventName.FENCE_CHANGED), 10) - written_s <= 2.0


@pytest.mark.parametrize("is_operator", [False, True], ids=["overtaken", "operator"])
def test_after_arming_auto_waits_for_a_heartbeat_that_shows_hold(is_operator):
    run = ready(conductor(arm=True))
    run.vehicles[0].rover.mode = type(run.vehicles[0].mode)(MANUAL)
    told, push = [], run.down.push
    run.down.push = lambda frame, now_s: (told.append(frame), push(frame, now_s))
    wait(run, 1.5)
    before = next(frame for frame in reversed(told) if isinstance(frame.message, m.Heartbeat))
    assert before.message.custom_mode == MANUAL
    run.director.take_target(FAR, run.now_s)
    run.run_until(lambda: armings_sent(run) > 0, 20)
    if is_operator:
        unheard(run, m.SetMode(1, 1, MANUAL))
    run.director.receive(before, run.now_s)
    promises = Promises(run)
    promises._mode = MANUAL
    wait(run, 4)
    assert promises.broken == []
    assert (Mode.AUTO in modes_sent(run)) is not is_operator
    assert run.vehicles[0].mode == (MANUAL if is_operator else Mode.AUTO)
