"""The director for hours: targets, changes, takeovers and troubles, against a simulated rover in stepped time."""

from __future__ import annotations

from dataclasses import fields, replace
from pathlib import Path

import pytest
from director.conducting import Conductor
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely import LineString

from mavlink_bridge.director import SCHEMA, TRANSITIONS, Director, EventName, Orders, State, TargetSource
from mavlink_bridge.mavlink import messages as m
from mavlink_bridge.mavlink.rover import Mode
from mavlink_bridge.protocol.peer import Peer
from mavlink_bridge.protocol.upload import Upload
from mavlink_bridge.simulator import SimulatedVehicle, SimulatorConfig
from mavlink_bridge.simulator.faults import Faults
from missions.fence import CircleZone, Fence, ZoneKind, fence_to_items
from missions.formats import read_fence
from missions.geo import LatLon, distance_m, to_e7
from missions.items import Command, waypoint, with_home
from missions.request import Request

FENCE = read_fence(Path(__file__).parents[2] / "fields" / "yard-fence.waypoints")
HOME = LatLon(40.071374, -105.229930)
FAR = LatLon(40.0720926, -105.2286152)
NEAR = LatLon(40.0712500, -105.2292000)
IN_BARN = LatLon(40.0714600, -105.2295800)


def conductor(
    *, faults: Faults | None = None, vehicle: SimulatedVehicle | None = None, **orders
) -> Conductor:
    config = SimulatorConfig(
        home=HOME, fence=fence_to_items(FENCE), parameters={"FENCE_ENABLE": 1.0, "WP_SPEED": 3.0}
    )
    given = {"request": Request(clearance_m=2.5), "upload": True, "drive": True, "announce": True, **orders}
    return Conductor(Director(Orders(**given)), [vehicle or SimulatedVehicle(config)], faults or Faults())


def reposition(target: LatLon, component: int = 1) -> m.CommandInt:
    lat_e7, lon_e7 = to_e7(target)
    return m.CommandInt(1, component, 0, Command.DO_REPOSITION, param1=-1.0, param2=1.0, x=lat_e7, y=lon_e7)


def arm(run: Conductor) -> None:
    run.ground_station(m.CommandLong(1, 1, Command.COMPONENT_ARM_DISARM, param1=1.0))


def ready(run: Conductor) -> Conductor:
    run.run_until(lambda: run.director.state is State.READY)
    return run


def driving(run: Conductor, target: LatLon = FAR) -> Conductor:
    ready(run)
    arm(run)
    run.director.take_target(target, run.now_s)
    run.run_until(lambda: run.director.state is State.DRIVING)
    return run


def upload(run: Conductor, mission_type: m.MissionType, items) -> None:
    """Let a second ground station upload a list; the director does not hear its side."""
    identity = (255, 190)
    machine = Upload(Peer(1, 1, *identity), mission_type, items)
    machine.start(run.now_s)
    vehicle, before = run.vehicles[0], run.meddle

    def push(run: Conductor) -> None:
        for message in machine.messages_to_send():
            vehicle.receive(m.Frame(*identity, message), run.now_s)
        machine.handle_timer(run.now_s)

    receive = run.director.receive

    def listen(frame, now_s) -> None:
        machine.receive(frame, now_s)
        receive(frame, now_s)

    run.director.receive = listen
    run.meddle = push
    run.run_until(lambda: machine.is_done, 20)
    run.director.receive, run.meddle = receive, before


def wall_across_the_route() -> Fence:
    """The yard's fence with a circle on the way to the far target."""
    return Fence((*FENCE.zones, CircleZone(ZoneKind.EXCLUSION, LatLon(40.0720000, -105.2289500), 6.0)))


def test_a_click_becomes_a_verified_mission_and_a_drive():
    run = ready(conductor())
    arm(run)
    run.run_until(lambda: run.director.situation.armed)
    clicked_s = run.now_s
    run.ground_station(reposition(FAR))
    held_s = run.run_until(run.happened(EventName.HOLDING))
    assert held_s - clicked_s <= 0.5
    run.run_until(lambda: run.director.state is State.ARRIVED)
    vehicle = run.vehicles[0]
    assert distance_m(vehicle.position, FAR) < 4.0
    assert vehicle.breaches == 0
    assert run.last(EventName.ARRIVED).data["breaches"] == 0
    order = [event.name for event in run.events if event.name is not EventName.PROGRESS]
    assert order[2:] == [
        EventName.TARGET, EventName.HOLDING, EventName.PLANNED, EventName.UPLOADING, EventName.VERIFIED,
        EventName.DRIVING, EventName.ARRIVED,
    ]  # fmt: skip


@pytest.mark.parametrize("trusts", [False, True])
def test_a_plan_outside_what_was_measured_says_so_and_promises_nothing(trusts):
    config = SimulatorConfig(
        home=HOME, fence=fence_to_items(FENCE), parameters={"OA_TYPE": 2.0, "WP_SPEED": 3.0}
    )
    asked = Request(clearance_m=2.5, trusts_model=trusts)
    run = ready(conductor(vehicle=SimulatedVehicle(config), request=asked, upload=False, drive=False))
    run.ground_station(reposition(FAR))
    run.run_until(run.happened(EventName.PLANNED), 20)
    event = run.last(EventName.PLANNED)
    assert event.data["clearance_m"] == (2.5 if trusts else None)
    assert [text.split(":")[0] for text in event.data["extrapolated"]] == ["OA_TYPE 2"]
    assert "extrapolated beyond what was measured" in event.text
    usual = ready(conductor(upload=False, drive=False))
    usual.ground_station(reposition(FAR))
    usual.run_until(usual.happened(EventName.PLANNED), 20)
    assert usual.last(EventName.PLANNED).data["extrapolated"] == []


@pytest.mark.parametrize("trusts", [False, True])
def test_a_plan_outside_what_was_measured_is_uploaded_only_where_the_model_is_trusted(trusts):
    config = SimulatorConfig(
        home=HOME, fence=fence_to_items(FENCE), parameters={"OA_TYPE": 2.0, "WP_SPEED": 3.0}
    )
    asked = Request(clearance_m=2.5, trusts_model=trusts)
    run = ready(conductor(vehicle=SimulatedVehicle(config), request=asked))
    run.ground_station(reposition(FAR))
    run.run_until(run.happened(EventName.VERIFIED if trusts else EventName.NO_PLAN), 40)
    if trusts:
        assert run.last(EventName.PLANNED).data["clearance_m"] == 2.5
        return
    refused = run.last(EventName.NO_PLAN)
    assert refused.data["error"] == "ExtrapolatedError"
    assert refused.text.startswith("not uploaded: the drive is extrapolated beyond what was measured")
    assert not any(event.name in {EventName.PLANNED, EventName.UPLOADING} for event in run.events)
    assert len(run.vehicles[0].mission) == 1  # home


def test_without_orders_to_drive_it_changes_no_mode_and_warns_of_an_unsafe_straight_line():
    run = ready(conductor(drive=False))
    arm(run)
    run.ground_station(m.SetMode(1, 1, Mode.GUIDED))
    run.run_until(lambda: run.director.situation.mode == Mode.GUIDED and run.director.situation.armed)
    run.ground_station(reposition(FAR))
    run.run_until(run.happened(EventName.VERIFIED), 20)
    assert run.last(EventName.STRAIGHT_LINE_UNSAFE).data["fence"] == "exclusion polygon 1"
    assert not [
        message
        for message in run.sent
        if isinstance(message, m.CommandLong) and message.command == Command.DO_SET_MODE
    ]


def test_without_orders_to_upload_it_only_reports():
    run = ready(conductor(upload=False, drive=False))
    before = run.vehicles[0].mission
    run.director.take_target(FAR, run.now_s)
    run.run_until(lambda: run.director.state is State.PROPOSED)
    run.run_until(lambda: run.now_s > 20)
    assert run.vehicles[0].mission == before
    assert run.director.state is State.PROPOSED
    assert not run.backups


def test_waits_for_a_yes_where_it_has_to():
    run = ready(conductor(drive=False, confirm=True))
    run.director.take_target(FAR, run.now_s)
    run.run_until(lambda: run.director.state is State.PROPOSED)
    for _ in range(200):
        run.step()
    assert run.director.state is State.PROPOSED
    run.director.confirm(run.now_s)
    run.run_until(lambda: run.director.state is State.VERIFIED, 10)


def test_target_to_verified_mission_within_a_second():
    run = ready(conductor(drive=False))
    run.director.take_target(FAR, run.now_s)
    asked_s = run.now_s
    assert run.run_until(lambda: run.director.state is State.VERIFIED, 10) - asked_s <= 1.0


def test_a_blocked_target_is_reported_and_the_bridge_goes_on():
    run = ready(conductor())
    run.director.take_target(IN_BARN, run.now_s)
    run.run_until(run.happened(EventName.NO_PLAN), 5)
    assert run.last(EventName.NO_PLAN).data["error"] == "TargetBlockedError"
    run.director.take_target(FAR, run.now_s)
    run.run_until(run.happened(EventName.VERIFIED), 10)


def test_a_command_to_our_own_component_is_answered():
    run = ready(conductor(drive=False))
    run.ground_station(reposition(FAR, component=195))
    run.run_until(run.happened(EventName.VERIFIED), 10)
    results = [message.result for message in run.sent if isinstance(message, m.CommandAck)]
    assert results == [m.MavResult.IN_PROGRESS, m.MavResult.ACCEPTED]
    run.ground_station(reposition(IN_BARN, component=195))
    run.run_until(run.happened(EventName.NO_PLAN), 10)
    run.step()
    answers = [message for message in run.sent if isinstance(message, m.CommandAck)]
    assert answers[-1].result == m.MavResult.DENIED
    assert (answers[-1].target_system, answers[-1].target_component) == (255, 190)
    said = "the target is inside exclusion polygon 1"
    run.run_until(
        lambda: any(said in message.text for message in run.sent if isinstance(message, m.Statustext)), 15
    )


def test_a_target_that_is_only_said_again_changes_nothing():
    run = ready(conductor(drive=False))
    for _ in range(5):
        run.ground_station(reposition(FAR))
        for _ in range(20):
            run.step()
    run.run_until(lambda: run.director.state is State.VERIFIED, 10)
    assert sum(event.name is EventName.TARGET for event in run.events) == 1


@pytest.mark.parametrize(
    ("source", "message"),
    [
        (TargetSource.POSITION_TARGET, m.SetPositionTargetGlobalInt(0, 0, 0, 6, 0xDFC, *to_e7(FAR), 0.0)),
        (
            TargetSource.GUIDED_ITEM,
            m.MissionItemInt(1, 1, 0, 6, 16, 2, 1, 0.0, 0.0, 0.0, 0.0, *to_e7(FAR), 0.0),
        ),
    ],
)
def test_other_ways_to_ask_and_how_to_close_them(source, message):
    run = ready(conductor(drive=False))
    run.ground_station(message)
    run.run_until(run.happened(EventName.VERIFIED), 10)
    assert run.last(EventName.TARGET).data["source"] == source
    deaf = ready(conductor(drive=False, target_sources=frozenset({TargetSource.TYPED})))
    deaf.ground_station(message)
    for _ in range(100):
        deaf.step()
    assert deaf.director.state is State.READY


def test_the_echo_of_a_target_in_guided():
    run = ready(conductor(drive=False, target_sources=frozenset({TargetSource.ECHO})))
    run.ground_station(m.SetMode(1, 1, Mode.GUIDED))
    run.run_until(lambda: run.director.situation.mode == Mode.GUIDED)
    echo = m.Frame(1, 1, m.PositionTargetGlobalInt(0, 0, 0xDF8, *to_e7(FAR), 0.0))
    for _ in range(3):
        run.down.push(echo, run.now_s)
        run.step()
    run.run_until(run.happened(EventName.VERIFIED), 10)
    assert [event.data["source"] for event in run.events if event.name is EventName.TARGET] == [
        TargetSource.ECHO
    ]


def test_the_last_place_of_a_mission_somebody_uploads():
    sources = frozenset({TargetSource.MISSION})
    run = ready(conductor(drive=False, target_sources=sources))
    upload(run, m.MissionType.MISSION, with_home((waypoint(FAR),), HOME))
    run.run_until(run.happened(EventName.VERIFIED), 20)
    assert run.last(EventName.TARGET).data["position"] == list(FAR)
    assert len(run.vehicles[0].mission) > 2
    events = len(run.events)
    for _ in range(400):
        run.step()
    assert not run.happened(EventName.TARGET, events)()


def test_a_fence_across_the_route_while_driving():
    run = driving(conductor())
    run.run_until(lambda: run.director.drive is not None and run.director.drive.driven_m > 15)
    upload(run, m.MissionType.FENCE, fence_to_items(wall_across_the_route()))
    known_s = run.run_until(run.happened(EventName.FENCE_CHANGED), 5)
    held_s = run.run_until(lambda: run.vehicles[0].mode == Mode.HOLD, 5)
    assert held_s - known_s <= 0.5
    assert run.last(EventName.ROUTE_BROKEN).data["fence"] == "exclusion circle 2"
    run.run_until(lambda: run.director.state is State.ARRIVED)
    vehicle = run.vehicles[0]
    assert vehicle.breaches == 0
    assert distance_m(vehicle.position, FAR) < 4.0


@pytest.mark.parametrize("wait_s", [0.0, 0.2, 0.4, 0.6, 0.8])
def test_a_new_route_right_after_the_start_does_not_believe_the_heartbeat_before_hold(wait_s):
    # At walking pace it stands again before its next heartbeat; the last one still says AUTO.
    run = driving(conductor())
    begins_s = run.now_s + wait_s
    run.run_until(lambda: run.now_s >= begins_s)
    run.director.take_target(NEAR, run.now_s)
    run.run_until(run.happened(EventName.HOLDING))
    run.run_until(lambda: run.director.state is State.ARRIVED)
    assert not run.happened(EventName.UPLOAD_FAILED)()
    assert distance_m(run.vehicles[0].position, NEAR) < 4.0


@pytest.mark.parametrize("list_ids", [True, False])
def test_the_ids_in_mission_current_tell_of_a_fence_that_changed_unheard(list_ids):
    config = SimulatorConfig(
        home=HOME, fence=fence_to_items(FENCE), parameters={"FENCE_ENABLE": 1.0}, list_ids=list_ids
    )
    run = ready(conductor(vehicle=SimulatedVehicle(config), drive=False))
    run.run_until(lambda: run.now_s > 5)
    push = run.down.push

    def deaf(frame: m.Frame, now_s: float) -> None:
        """Lose every other sign of it."""
        is_theirs = getattr(frame.message, "target_component", 195) == 190
        if not is_theirs and not isinstance(frame.message, m.ParamValue | m.Statustext):
            push(frame, now_s)

    run.down.push = deaf
    fence = fence_to_items(wall_across_the_route())
    vehicle = run.vehicles[0]
    vehicle.receive(m.Frame(255, 190, m.MissionCount(1, 1, len(fence), m.MissionType.FENCE)), run.now_s)
    for seq, item in enumerate(fence):
        for _ in range(3):
            run.step()
        values = (*item.params, item.lat_e7, item.lon_e7, 0.0, m.MissionType.FENCE)
        vehicle.receive(
            m.Frame(255, 190, m.MissionItemInt(1, 1, seq, 3, item.command, 0, 1, *values)), run.now_s
        )
    changed_s = run.now_s
    noticed_s = run.run_until(run.happened(EventName.FENCE_CHANGED), 70) - changed_s
    assert noticed_s < 2.0 if list_ids else noticed_s > 30.0  # without ids the slow poll finds it


def test_the_id_of_a_mission_tells_of_one_that_somebody_changed():
    config = SimulatorConfig(
        home=HOME, fence=fence_to_items(FENCE), parameters={"FENCE_ENABLE": 1.0}, list_ids=True
    )
    run = ready(conductor(vehicle=SimulatedVehicle(config), drive=False))
    run.director.take_target(FAR, run.now_s)
    run.run_until(lambda: run.director.state is State.VERIFIED, 10)
    run.run_until(lambda: run.now_s > 15)
    assert not run.happened(EventName.MISSION_CHANGED)()  # our own change is no news
    theirs = (*run.vehicles[0].mission[1:-1], waypoint(NEAR))  # as many items as before
    upload(run, m.MissionType.MISSION, with_home(theirs, HOME))
    run.run_until(run.happened(EventName.MISSION_CHANGED), 3)
    assert run.director.state is State.LET_GO


def test_a_fence_that_leaves_the_route_alone_is_only_reported():
    run = driving(conductor())
    aside = Fence((*FENCE.zones, CircleZone(ZoneKind.EXCLUSION, LatLon(40.0721500, -105.2301500), 3.0)))
    upload(run, m.MissionType.FENCE, fence_to_items(aside))
    run.run_until(run.happened(EventName.FENCE_CHANGED), 5)
    run.run_until(lambda: run.director.state is State.ARRIVED)
    assert not run.happened(EventName.ROUTE_BROKEN)()
    assert not run.happened(EventName.HOLDING)()


def test_a_fence_across_the_route_without_orders_to_drive_is_a_loud_warning():
    run = ready(conductor(drive=False))
    run.director.take_target(FAR, run.now_s)
    run.run_until(lambda: run.director.state is State.VERIFIED, 10)
    before = len(run.events)
    upload(run, m.MissionType.FENCE, fence_to_items(wall_across_the_route()))
    run.run_until(run.happened(EventName.VERIFIED, before), 10)
    assert run.happened(EventName.ROUTE_BROKEN, before)()


@pytest.mark.parametrize("mode", [Mode.HOLD, 0, 11])
def test_the_operator_takes_over_and_a_new_target_gives_back(mode):
    run = driving(conductor())
    run.run_until(lambda: run.director.drive is not None and run.director.drive.driven_m > 10)
    run.ground_station(m.SetMode(1, 1, mode))
    run.run_until(lambda: run.director.state is State.LET_GO, 5)
    sent = len(run.sent)
    for _ in range(1000):
        run.step()
    assert run.vehicles[0].mode == mode
    assert not [message for message in run.sent[sent:] if isinstance(message, m.CommandLong)]
    run.ground_station(m.SetMode(1, 1, Mode.HOLD))
    run.director.take_target(NEAR, run.now_s)
    run.run_until(lambda: run.director.state is State.ARRIVED)
    assert distance_m(run.vehicles[0].position, NEAR) < 4.0


def test_the_operator_takes_over_while_a_route_is_made():
    run = driving(conductor(confirm=False))
    run.run_until(lambda: run.director.drive is not None and run.director.drive.driven_m > 10)
    run.director.orders = replace(run.director.orders, confirm=True)
    run.director.take_target(NEAR, run.now_s)
    run.run_until(lambda: run.director.state is State.PROPOSED, 20)
    run.ground_station(m.SetMode(1, 1, 0))
    run.run_until(lambda: run.director.state is State.LET_GO, 5)
    run.director.confirm(run.now_s)
    for _ in range(300):
        run.step()
    assert run.vehicles[0].mode == 0
    assert run.director.state is State.LET_GO


def test_a_link_lost_while_driving_and_found_again_goes_on_watching():
    run = driving(conductor())
    run.run_until(lambda: run.director.drive is not None and run.director.drive.driven_m > 5)
    run.is_cut = True
    run.run_until(lambda: run.director.state is State.LOST, 10)
    run.is_cut = False
    before = len(run.events)
    run.run_until(lambda: run.director.state is State.ARRIVED)
    assert not run.happened(EventName.HOLDING, before)()
    assert distance_m(run.vehicles[0].position, FAR) < 4.0


def test_a_mission_changed_by_somebody_else_is_noticed_and_left():
    run = driving(conductor())
    theirs = with_home((waypoint(LatLon(40.0712200, -105.2300000)), waypoint(NEAR)), HOME)
    upload(run, m.MissionType.MISSION, theirs)
    run.run_until(run.happened(EventName.MISSION_CHANGED), 10)
    for _ in range(500):
        run.step()
    assert run.vehicles[0].mission[1:] == tuple(run.director.situation.mission.value.items)
    assert [item.position for item in run.vehicles[0].mission[1:]] == [item.position for item in theirs[1:]]
    assert run.director.state is State.LET_GO


def test_a_new_target_while_driving_stops_it_first():
    run = driving(conductor())
    run.run_until(lambda: run.director.drive is not None and run.director.drive.driven_m > 15)
    before = len(run.events)
    run.ground_station(reposition(NEAR))
    run.run_until(run.happened(EventName.HOLDING, before), 1)
    run.run_until(lambda: run.director.state is State.ARRIVED)
    assert distance_m(run.vehicles[0].position, NEAR) < 4.0
    assert run.vehicles[0].breaches == 0


def test_a_target_during_an_upload_comes_next():
    run = ready(conductor(drive=False))
    run.director.take_target(FAR, run.now_s)
    run.run_until(lambda: run.director.state is State.UPLOADING)
    run.director.take_target(NEAR, run.now_s)
    run.run_until(
        lambda: run.director.state is State.VERIFIED and run.vehicles[0].mission[-1].position == NEAR, 10
    )


def test_a_lost_link_is_told_and_all_is_read_anew_when_it_is_back():
    run = ready(conductor(drive=False))
    run.is_cut = True
    run.run_until(run.happened(EventName.LINK_LOST), 10)
    assert run.director.state is State.LOST
    run.is_cut = False
    run.run_until(lambda: run.director.state is State.READY, 20)
    assert run.happened(EventName.LINK_BACK)()


def test_a_reboot_is_noticed():
    run = ready(conductor(drive=False))
    run.run_until(lambda: run.now_s > 15)
    run.vehicles[0].reboot(run.now_s)
    run.run_until(run.happened(EventName.REBOOTED), 20)
    run.run_until(lambda: run.director.state is State.READY, 20)


def test_does_not_arm_unasked():
    run = ready(conductor())
    run.director.take_target(FAR, run.now_s)
    mode = run.vehicles[0].mode
    run.run_until(run.happened(EventName.TROUBLE), 20)
    assert "not armed" in run.last(EventName.TROUBLE).text
    for _ in range(200):
        run.step()
    assert (run.vehicles[0].is_armed, run.vehicles[0].mode) == (False, mode)
    sent = [message for message in run.sent if isinstance(message, m.CommandLong)]
    assert Command.COMPONENT_ARM_DISARM not in {message.command for message in sent}


def test_speaks_as_the_vehicles_own_path_planner_and_not_too_often():
    run = driving(conductor())
    assert run.director.identity == (1, 195)
    run.run_until(lambda: run.director.state is State.ARRIVED)
    texts = [message for message in run.sent if isinstance(message, m.Statustext)]
    assert texts
    assert all(message.text.startswith("pbpp: ") and len(message.text) <= 50 for message in texts)
    assert len(texts) <= run.now_s


@pytest.mark.parametrize("seed", range(3))
def test_over_a_bad_link_a_fence_across_the_route_is_driven_around_within_ten_seconds(seed):
    run = conductor(faults=Faults(loss=0.05, latency_s=0.1), arm=True)
    run.up, run.down = (type(run.up)(run.faults, 10 * seed + side) for side in (1, 2))
    ready(run)
    run.director.take_target(FAR, run.now_s)
    run.run_until(lambda: run.director.state is State.DRIVING, 60)
    run.run_until(lambda: run.director.drive is not None and run.director.drive.driven_m > 12)
    upload(run, m.MissionType.FENCE, fence_to_items(wall_across_the_route()))
    changed_s = run.now_s
    run.run_until(lambda: run.vehicles[0].mode == Mode.HOLD, 20)
    assert run.run_until(lambda: run.director.state is State.DRIVING, 20) - changed_s <= 10
    run.run_until(lambda: run.director.state is State.ARRIVED)
    assert run.vehicles[0].breaches == 0


def test_another_autopilot_is_refused_with_a_clear_word():
    run = conductor()
    push = run.down.push

    def as_another(frame: m.Frame, now_s: float) -> None:
        if isinstance(frame.message, m.Heartbeat):
            frame = replace(frame, message=replace(frame.message, autopilot=4))
        push(frame, now_s)

    run.down.push = as_another
    run.run_until(lambda: run.director.is_done, 10)
    assert run.director.state is State.FAILED
    assert "neither ArduPilot nor PX4 (MAV_AUTOPILOT 4)" in str(run.director.trouble)
    assert not run.sent


def test_a_fence_by_older_messages_is_no_missing_fence():
    run = conductor(once=True)
    push = run.down.push

    def without_fence_lists(frame: m.Frame, now_s: float) -> None:
        if isinstance(frame.message, m.MissionCount) and frame.message.mission_type == m.MissionType.FENCE:
            answer = m.MissionAck(1, 195, m.MissionResult.UNSUPPORTED, m.MissionType.FENCE)
            frame = replace(frame, message=answer)
        push(frame, now_s)

    run.down.push = without_fence_lists
    run.run_until(lambda: run.director.is_done, 30)
    assert "FENCE_POINT" in str(run.director.trouble)
    assert run.director.trouble.details["result"] == "UNSUPPORTED"


def test_every_event_follows_its_schema():
    run = driving(conductor())
    run.run_until(lambda: run.director.state is State.ARRIVED)
    for event in run.events:
        severity, keys = SCHEMA[event.name]
        assert tuple(event.data) == keys
        assert event.as_json()["severity"] == severity.name.lower()


def test_every_state_is_in_the_table_and_can_be_reached():
    assert set(TRANSITIONS) == set(State)
    reached = {State.LISTENING}
    for _ in State:
        reached |= {after for state in reached for after in TRANSITIONS[state].values()}
    assert reached == set(State)


def test_the_driven_track_keeps_what_was_promised():
    run = driving(conductor())
    track = []
    run.meddle = lambda run: track.append(run.vehicles[0].position)
    run.run_until(lambda: run.director.state is State.ARRIVED)
    ground = run.director.plan.ground
    assert ground.clearance_m(LineString(ground.frame.to_local_array(track))) >= 2.5


@settings(max_examples=30)
@given(st.data())
def test_no_message_from_anyone_breaks_it(data):
    run = ready(conductor(drive=False))
    small = st.integers(0, 255)
    whole = st.integers(-(2**31), 2**31 - 1)
    real = st.floats(width=32)
    kinds = {"int": st.one_of(small, whole), "float": real, "str": st.text(max_size=16)}
    kinds["tuple[int, ...]"] = st.lists(small, max_size=18).map(tuple)
    for _ in range(data.draw(st.integers(1, 12))):
        message_class = data.draw(st.sampled_from(sorted(m.MESSAGES.values(), key=lambda c: c.__name__)))
        values = [data.draw(kinds[str(field.type)]) for field in fields(message_class)]
        frame = m.Frame(
            data.draw(st.sampled_from([1, 2, 255])),
            data.draw(st.sampled_from([1, 190, 195])),
            message_class(*values),
        )
        run.down.push(frame, run.now_s)
        for _ in range(data.draw(st.integers(1, 40))):
            run.step()
    run.director.deadline_s  # noqa: B018 - must not raise either


@pytest.mark.parametrize("came", [float("nan"), float("inf")])
def test_a_parameter_that_comes_as_no_number_while_it_drives_is_told_once_and_changes_nothing(came):
    run = driving(conductor())
    for name in ("FENCE_TYPE", "FENCE_OPTIONS", "FENCE_MARGIN", "BRD_SD_MISSION", "MIS_DONE_BEHAVE"):
        before = len(run.events)
        for _ in range(3):
            run.down.push(m.Frame(1, 1, m.ParamValue(name, came, 9, 1, 0)), run.now_s)
            for _ in range(20):
                run.step()
        assert run.director.state is State.DRIVING
        told = [event for event in run.events[before:] if event.name is EventName.TROUBLE]
        matters = name.startswith("FENCE_")
        assert len(told) == matters
        if matters:
            assert told[0].text.startswith(f"{name} received as {came}, which is not a number: last value ")
    run.run_until(lambda: run.director.state is State.ARRIVED)


@pytest.mark.parametrize(
    ("name", "came"), [("FENCE_TYPE", 1e38), ("FENCE_OPTIONS", -3.0), ("BRD_SD_FENCE", 1e38)]
)
def test_a_parameter_that_cannot_be_does_not_end_the_bridge(name, came):
    run = driving(conductor())
    run.down.push(m.Frame(1, 1, m.ParamValue(name, came, 9, 1, 0)), run.now_s)
    for _ in range(200):
        run.step()
    assert run.director.state is not State.FAILED
    if name == "BRD_SD_FENCE":
        assert run.director.state is State.DRIVING
        return
    run.director.take_target(HOME, run.now_s)
    run.run_until(lambda: run.events[-1].name is EventName.NO_PLAN)
    assert f"{name} is {came:g}; allowed: 0 to 32767" in run.events[-1].text
