"""Somebody else speaks with our own ids: refused at the start, survived later, and nothing more is done until a target is typed."""

from __future__ import annotations

import pytest
from director.test_bridge_director import FAR, HOME, NEAR, arm, conductor, driving, ready, reposition
from director.test_takeover import deaf_to, modes_sent, unheard, wait

from mavlink_bridge.director import EventName, Severity, State
from mavlink_bridge.errors import IdentityTakenError, OutcomeError
from mavlink_bridge.mavlink import messages as m
from mavlink_bridge.mavlink.rover import Mode
from mavlink_bridge.simulator.faults import Faults
from missions.geo import distance_m, to_e7
from missions.items import Command
from missions.request import Request

OURS = (1, 195)
HEARTBEAT = m.Heartbeat(6, 8)
HARMLESS = (m.Statustext, m.CommandAck)
TOLD = "another program on the link uses our ids (system 1 component 195)"


def spoof(run, message: m.Message = HEARTBEAT, count: int = 1) -> None:
    for _ in range(count):
        run.director.receive(m.Frame(*OURS, message), run.now_s)


def clashes(run) -> list:
    return [event for event in run.events if event.name is EventName.IDENTITY_CLASH]


def asked_of_vehicle(run, since: int) -> list[m.Message]:
    """Return what was sent that asks the vehicle for something or changes it."""
    return [message for message in run.sent[since:] if not isinstance(message, HARMLESS)]


def is_left_alone(run, seconds: float = 30.0) -> bool:
    """Return whether nothing is sent, whatever is clicked, typed as a yes, or forged."""
    since = len(run.sent)
    for number in range(10):
        wait(run, seconds / 10)
        spoof(run, count=3)
        run.ground_station(reposition(NEAR if number % 2 else FAR, component=number % 2 or 195))
        run.director.confirm(run.now_s)
    return asked_of_vehicle(run, since) == []


def single_job(**orders):
    return conductor(once=True, request=Request(targets=(FAR,), clearance_m=2.5), **orders)


def is_writing(run):
    return lambda: any(isinstance(message, m.MissionItemInt) for message in run.sent)


def test_a_flood_while_it_drives_is_one_event_and_one_hold():
    run = driving(conductor())
    wait(run, 3)
    since = len(run.sent)
    for _ in range(150):
        spoof(run, count=20)
        run.step()
    assert run.vehicles[0].mode == Mode.HOLD
    (told,) = clashes(run)
    assert told.severity is Severity.CRITICAL
    assert told.data == {"system": 1, "component": 195, "held": True}
    assert told.text == f"{TOLD}; HOLD; waiting for a typed target; map clicks are ignored"
    assert [message.param2 for message in asked_of_vehicle(run, since)] == [Mode.HOLD]
    assert run.director.state is State.CLASHED
    assert run.director.drive is None
    assert is_left_alone(run)
    assert len(clashes(run)) == 1
    assert not run.director.is_done


def test_a_typed_target_settles_it_and_all_is_read_anew():
    run = driving(conductor())
    wait(run, 3)
    spoof(run)
    run.run_until(lambda: run.vehicles[0].mode == Mode.HOLD, 3)
    wait(run, 2)
    told = len(run.events)
    run.director.take_target(NEAR, run.now_s)
    assert run.director.state is State.LEARNING
    run.run_until(lambda: run.director.state is State.ARRIVED)
    assert distance_m(run.vehicles[0].position, NEAR) < 4.0
    names = [event.name for event in run.events[told:] if event.name is not EventName.PROGRESS]
    assert names == [
        EventName.LEARNT, EventName.TARGET, EventName.PLANNED, EventName.UPLOADING, EventName.VERIFIED, EventName.DRIVING,
        EventName.ARRIVED,
    ]  # fmt: skip


def test_it_is_told_again_after_it_was_settled():
    run = driving(conductor())
    spoof(run)
    wait(run, 3)
    run.director.take_target(NEAR, run.now_s)
    run.step()
    spoof(run, count=100)
    wait(run, 3)
    assert [event.data["held"] for event in clashes(run)] == [True, False]
    assert run.director.state is State.CLASHED
    assert is_left_alone(run, 10)


@pytest.mark.parametrize(
    "state",
    [State.READY, State.PLANNING, State.PROPOSED, State.LET_GO, State.ARRIVED, State.VERIFIED, State.LOST, State.LEARNING],
)  # fmt: skip
def test_without_a_drive_of_ours_nothing_is_sent(state):
    orders = {
        State.PROPOSED: {"drive": False, "confirm": True},
        State.VERIFIED: {"drive": False},
        State.ARRIVED: {"arm": True},
    }
    run = ready(conductor(**orders.get(state, {})))
    if state in (State.PLANNING, State.PROPOSED, State.VERIFIED, State.ARRIVED):
        run.planning_s = 5.0 if state is State.PLANNING else 0.0
        run.director.take_target(NEAR, run.now_s)
    elif state is State.LET_GO:
        run.director.take_target(NEAR, run.now_s)
        run.ground_station(m.SetMode(1, 1, 0))
        wait(run, 1)
        run.ground_station(m.SetMode(1, 1, 0))
    elif state is State.LOST:
        run.is_cut = True
    elif state is State.LEARNING:
        wait(run, 8)
        run.vehicles[0].reboot(run.now_s)
    run.run_until(lambda: run.director.state is state, 90)
    if state is State.ARRIVED:
        wait(run, 3)  # until it is shown in HOLD, where our drives end
    run.director.messages_to_send()
    spoof(run, count=5)
    (told,) = [event for event in run.director.take_events() if event.name is EventName.IDENTITY_CLASH]
    assert told.data["held"] is False
    assert run.director.state is State.CLASHED
    run.is_cut = False
    assert is_left_alone(run)
    assert run.director.state is State.CLASHED


def test_an_upload_under_way_is_brought_to_its_end_and_nothing_more():
    run = ready(conductor(arm=True))
    arm(run)
    run.director.take_target(FAR, run.now_s)
    run.run_until(is_writing(run), 20)
    spoof(run, count=50)
    assert run.director.state is State.CLASHING
    run.run_until(lambda: run.director.state is State.CLASHED, 20)
    (told,) = clashes(run)
    assert told.text.startswith(f"{TOLD}; the upload is finished first; ")
    assert run.happened(EventName.VERIFIED)()
    assert run.vehicles[0].mission[-1].position == FAR
    run.step()  # the read-back's last MISSION_ACK
    assert is_left_alone(run)
    assert Mode.AUTO not in modes_sent(run)


def test_a_target_typed_while_the_upload_ends_is_gone_into_then():
    run = ready(conductor(arm=True))
    arm(run)
    run.director.take_target(FAR, run.now_s)
    run.run_until(is_writing(run), 20)
    spoof(run)
    run.director.take_target(NEAR, run.now_s)
    assert run.director.state is State.CLASHING
    run.run_until(lambda: run.director.state is State.ARRIVED)
    assert distance_m(run.vehicles[0].position, NEAR) < 4.0
    assert run.last(EventName.TARGET).data["position"] == list(NEAR)


def test_another_clash_while_the_upload_ends_revokes_what_was_typed_since_and_says_so():
    run = ready(conductor(arm=True))
    arm(run)
    run.director.take_target(FAR, run.now_s)
    run.run_until(is_writing(run), 20)
    spoof(run)
    run.director.take_target(NEAR, run.now_s)
    spoof(run, count=20)
    assert run.director.state is State.CLASHING
    run.run_until(lambda: run.director.state is State.CLASHED, 20)
    assert len(clashes(run)) == 2
    assert run.happened(EventName.VERIFIED)()
    run.step()  # the read-back's last MISSION_ACK
    assert is_left_alone(run)
    assert run.vehicles[0].mission[-1].position == FAR
    run.director.take_target(NEAR, run.now_s)
    assert run.director.state is State.LEARNING


def test_a_takeover_then_a_clash_while_an_upload_ends():
    run = ready(conductor(arm=True, faults=Faults(latency_s=0.1)))
    arm(run)
    run.director.take_target(FAR, run.now_s)
    run.run_until(is_writing(run), 20)
    run.ground_station(m.SetMode(1, 1, 0))
    run.run_until(lambda: run.director.state is State.WITHDRAWING, 2)
    spoof(run)
    run.run_until(lambda: run.director.state is State.CLASHED, 20)
    run.step()
    assert is_left_alone(run)


def test_a_hold_that_does_not_get_through_is_sent_again():
    run = driving(conductor())
    wait(run, 3)
    push, cut_until_s = run.up.push, run.now_s + 2.0
    run.up.push = lambda frame, now_s: push(frame, now_s) if now_s > cut_until_s else None
    spoof(run, count=10)
    run.run_until(lambda: run.vehicles[0].mode == Mode.HOLD, 4)
    assert set(modes_sent(run, -10)) == {Mode.HOLD}
    wait(run, 2)
    assert is_left_alone(run)


@pytest.mark.parametrize("has_target", [False, True])
@pytest.mark.parametrize("is_disarming", [False, True])
def test_who_takes_the_vehicle_while_our_hold_is_under_way_has_it(has_target, is_disarming):
    run = driving(conductor())
    wait(run, 3)
    deaf_to(run, m.CommandAck)
    if has_target:
        run.director.take_target(NEAR, run.now_s)
    spoof(run)
    run.step()
    if is_disarming:
        unheard(run, m.CommandLong(1, 1, Command.COMPONENT_ARM_DISARM, param1=0.0))
    unheard(run, m.SetMode(1, 1, 0))
    wait(run, 1.5)
    assert is_left_alone(run)
    assert run.vehicles[0].mode in (0, Mode.GUIDED)  # by the clicks
    assert run.director.state is State.CLASHED


def test_a_hold_that_is_refused_is_told():
    run = driving(conductor())
    deaf_to(run, m.CommandAck, m.Heartbeat)
    spoof(run)
    run.run_until(run.happened(EventName.COMMAND_FAILED), 20)
    assert run.last(EventName.COMMAND_FAILED).text == "the vehicle did not switch to HOLD"
    assert run.director.state is State.CLASHED


def test_a_hold_under_way_is_not_doubled():
    run = driving(conductor())
    wait(run, 3)
    since = len(run.sent)
    run.director.take_target(NEAR, run.now_s)
    spoof(run, count=10)
    wait(run, 5)
    assert run.director.state is State.CLASHED
    assert run.vehicles[0].mode == Mode.HOLD
    assert modes_sent(run, since) == [Mode.HOLD]


def test_our_drive_that_is_out_of_sight_is_held_too():
    run = driving(conductor())
    wait(run, 3)
    run.is_cut = True
    run.run_until(lambda: run.director.state is State.LOST, 20)
    spoof(run)
    wait(run, 1)
    assert clashes(run)[0].data["held"] is True
    assert run.vehicles[0].mode == Mode.HOLD


def test_without_orders_to_drive_no_mode_is_switched():
    run = ready(conductor(drive=False))
    run.director.take_target(FAR, run.now_s)
    run.run_until(lambda: run.director.state is State.VERIFIED)
    arm(run)
    run.ground_station(m.SetMode(1, 1, Mode.AUTO))
    run.run_until(lambda: run.director.state is State.DRIVING, 5)
    spoof(run, count=10)
    wait(run, 5)
    assert modes_sent(run) == []
    assert run.vehicles[0].mode == Mode.AUTO
    assert clashes(run)[0].data["held"] is False


def test_what_is_said_with_our_ids_is_no_target_and_no_news_of_the_vehicle():
    run = driving(conductor())
    before = run.director.situation
    lat_e7, lon_e7 = to_e7(HOME)
    spoof(run, m.CommandInt(1, 1, 0, Command.DO_REPOSITION, param1=-1.0, param2=1.0, x=lat_e7, y=lon_e7))
    assert run.director.situation is before
    assert run.director.state is State.CLASHED


@pytest.mark.parametrize(
    "orders", [{"system": 1}, {"identity": OURS}, {}], ids=["system", "identity", "neither"]
)
@pytest.mark.parametrize("once", [False, True])
def test_at_the_start_it_is_refused(orders, once):
    run = conductor(once=once, **orders)
    run.run_until(lambda: True)
    spoof(run)
    run.run_until(lambda: run.director.is_done, 10)
    assert run.director.state is State.FAILED
    assert isinstance(run.director.trouble, IdentityTakenError)
    assert str(run.director.trouble) == (
        "another program on the link already uses system 1 component 195, perhaps another pbpp command; choose other ids with --source-component (or --source-system)"
    )
    assert run.sent == []


def test_while_the_vehicle_is_learnt_for_the_first_time_it_is_refused_once():
    run = conductor()
    run.run_until(lambda: run.director.state is State.LEARNING)
    spoof(run, count=100)
    run.step()
    assert run.director.state is State.FAILED
    assert isinstance(run.director.trouble, IdentityTakenError)
    assert [event.name for event in run.events] == [EventName.VEHICLE_FOUND, EventName.TROUBLE]


def test_somebody_who_had_our_ids_long_ago_is_gone():
    run = conductor(vehicle=None)
    run.is_cut = True
    run.run_until(lambda: run.now_s > 1.0)
    spoof(run)
    run.run_until(lambda: run.now_s > 10.0)
    run.is_cut = False
    ready(run)


@pytest.mark.parametrize("confirm", [True, False])
def test_a_single_job_that_has_not_written_yet_ends_as_at_the_start(confirm):
    wanted = State.PROPOSED if confirm else State.UPLOADING
    run = single_job(drive=False, confirm=confirm)
    run.run_until(lambda: run.director.state is wanted)
    spoof(run, count=5)
    assert isinstance(run.director.trouble, IdentityTakenError)
    run.run()
    assert run.vehicles[0].mission[1:] == ()


def test_a_single_upload_goes_on_to_its_verified_end():
    run = single_job(drive=False)
    run.run_until(is_writing(run))
    spoof(run, count=50)
    assert run.run() is State.DONE
    assert run.director.upload_outcome.is_verified
    assert run.director.trouble is None
    assert run.vehicles[0].mission[-1].position == FAR
    assert [event.text for event in clashes(run)] == [f"{TOLD}; the upload is finished first"]


def test_a_single_drive_is_not_begun():
    run = single_job(arm=True)
    run.run_until(is_writing(run))
    spoof(run, count=50)
    assert run.run() is State.FAILED
    assert isinstance(run.director.trouble, OutcomeError)
    assert (
        str(run.director.trouble) == f"{TOLD}: the mission is verified on the vehicle, but it is not driven"
    )
    assert modes_sent(run) == []


@pytest.mark.parametrize("state", [State.STARTING, State.DRIVING])
def test_a_single_drive_is_held(state):
    run = single_job(arm=True)
    run.run_until(lambda: run.director.state is state)
    wait(run, 0.5 if state is State.DRIVING else 0.0)
    spoof(run, count=50)
    assert run.run() is State.FAILED
    assert isinstance(run.director.trouble, OutcomeError)
    assert str(run.director.trouble) == f"{TOLD}: the vehicle was switched to HOLD; the mission is on it"
    assert "--source-component" in run.director.trouble.details["advice"]
    wait(run, 3)
    assert run.vehicles[0].mode == Mode.HOLD
    assert len(clashes(run)) == 1


def test_a_director_that_only_listens_has_no_ids_of_its_own():
    run = conductor(passive=True, upload=False, drive=False)
    run.run_until(lambda: run.director.state is State.READY)
    spoof(run, count=5)
    wait(run, 2)
    assert clashes(run) == []
    assert run.director.state is State.READY


def test_another_autopilot_with_the_vehicles_ids_is_no_news_of_it():
    run = driving(conductor())
    wait(run, 3)
    since = len(run.sent)
    for mode, flags in ((Mode.HOLD, 0), (Mode.GUIDED, 128), (0, 129)):
        run.director.receive(m.Frame(1, 1, m.Heartbeat(10, 12, flags, mode)), run.now_s)
        wait(run, 0.5)
        assert run.director.situation.mode == Mode.AUTO
    assert run.director.state is State.DRIVING
    assert modes_sent(run, since) == []


def test_a_vehicle_whose_autopilot_was_swapped_is_driven_no_more():
    run = driving(conductor())
    wait(run, 3)
    since, receive = len(run.sent), run.director.receive

    def swapped(frame, now_s):
        if isinstance(frame.message, m.Heartbeat) and frame.system == 1 and frame.component == 1:
            frame = m.Frame(1, 1, m.Heartbeat(10, 12, 129, Mode.AUTO))
        receive(frame, now_s)

    run.director.receive = swapped
    run.run_until(lambda: run.director.state is State.LOST, 10)
    assert run.happened(EventName.LINK_LOST)()
    assert modes_sent(run, since) == []
