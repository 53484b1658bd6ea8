"""Every row of the measured table "Mission protocol, server side" that is about uploads."""

from __future__ import annotations

import pytest
from simulator.station import GCS, HOME, RIVAL, TICK_S, Bench, at, kept, line, placed, square

from mavlink_bridge.mavlink import messages as m
from mavlink_bridge.mavlink.messages import MissionResult, MissionType
from mavlink_bridge.simulator import SimulatorConfig
from missions.items import Command, waypoint

FIVE = [placed(Command.NAV_WAYPOINT, HOME), *line(4)]


def acks(messages):
    return [message.type for message in messages if isinstance(message, m.MissionAck)]


def requests(messages):
    return [message.seq for message in messages if isinstance(message, m.MissionRequest)]


def test_asks_with_mission_request_and_takes_one_item_a_tick():
    bench = Bench()
    begin_s = bench.now_s
    result, _ = bench.upload([placed(Command.NAV_WAYPOINT, HOME), *line(99)])
    assert result == MissionResult.ACCEPTED
    assert bench.now_s - begin_s == pytest.approx(2.0, abs=0.05)
    assert not bench.of(m.MissionRequestInt)


def test_the_answer_waits_for_the_next_tick():
    bench = Bench()
    bench.send(m.MissionCount(1, 1, 2))
    assert bench.vehicle.messages_to_send() == []
    bench.run(TICK_S)
    assert requests(message for _, message in bench.heard) == [0]


def test_items_sent_ahead_of_the_requests_are_taken_at_once():
    bench = Bench()
    items = [placed(Command.NAV_WAYPOINT, HOME), *line(499)]
    begin_s = bench.now_s
    bench.send(m.MissionCount(1, 1, 500), *[bench.item(seq, item) for seq, item in enumerate(items)])
    bench.run_until(lambda: bench.of(m.MissionAck), 1.0)
    assert acks(bench.of(m.MissionAck)) == [MissionResult.ACCEPTED]
    ack_s = next(time_s for time_s, message in bench.heard if isinstance(message, m.MissionAck))
    assert ack_s - begin_s <= 0.043
    assert bench.vehicle.mission[1:] == line(499)


def test_a_window_of_ten_ahead_takes_ten_items_a_tick():
    bench = Bench()
    items = [placed(Command.NAV_WAYPOINT, HOME), *line(499)]
    begin_s = bench.now_s
    answers = bench.count(500)
    while not acks(answers):
        first = requests(answers)[-1]
        answers = bench.ask(*[bench.item(seq, items[seq]) for seq in range(first, min(500, first + 10))])
    assert bench.now_s - begin_s == pytest.approx(1.0, abs=0.05)


def test_a_request_is_repeated_every_second_and_given_up_after_eight():
    bench = Bench()
    begin_s = bench.now_s
    bench.count(3)
    bench.run(9.0)
    asked_s = [time_s - begin_s for time_s, message in bench.heard if isinstance(message, m.MissionRequest)]
    assert asked_s == pytest.approx([0.02 + second for second in range(9)], abs=0.2)
    assert {message.seq for message in bench.of(m.MissionRequest)} == {0}
    ((ack_s, ack),) = [(t, message) for t, message in bench.heard if isinstance(message, m.MissionAck)]
    assert ack.type == MissionResult.OPERATION_CANCELLED
    assert ack_s - begin_s == pytest.approx(8.1, abs=0.1)
    assert bench.texts() == ["Mission upload timeout"]


@pytest.mark.parametrize(
    ("mission_type", "text"),
    [
        (MissionType.FENCE, "Fence upload timeout"),
        (MissionType.RALLY, "Rally upload timeout"),
    ],
)
def test_a_timeout_names_the_list(mission_type, text):
    bench = Bench()
    bench.count(3, mission_type)
    bench.run(9.0)
    assert bench.texts() == [text]
    assert [ack.mission_type for ack in bench.of(m.MissionAck)] == [mission_type]


@pytest.mark.parametrize("seq", [0, 2, 4, 99])
def test_a_wrong_or_repeated_seq_is_refused_and_the_upload_goes_on(seq):
    bench = Bench()
    bench.count(5)
    bench.ask(bench.item(0, FIVE[0]))
    answers = bench.ask(bench.item(seq, FIVE[1]))
    assert acks(answers) == [MissionResult.INVALID_SEQUENCE]
    assert requests(answers) == []
    bench.heard.clear()
    bench.run(1.1)
    assert requests(bench.of(m.MissionRequest)) == [1]
    for index in range(1, 5):
        answers = bench.ask(bench.item(index, FIVE[index]))
    assert acks(answers) == [MissionResult.ACCEPTED]
    assert bench.vehicle.mission[1:] == line(4)


def test_wrong_items_do_not_put_the_timeout_off():
    bench = Bench()
    begin_s = bench.now_s
    bench.count(5)
    while bench.now_s - begin_s < 9.0:
        bench.ask(bench.item(3, FIVE[3]))
    assert MissionResult.OPERATION_CANCELLED in acks(bench.of(m.MissionAck))


def test_an_item_while_no_upload_is_under_way_is_an_error():
    bench = Bench()
    assert acks(bench.ask(bench.item(0, FIVE[0]))) == [MissionResult.ERROR]
    assert len(bench.vehicle.mission) == 1


def test_the_last_item_again_after_the_end_is_an_error():
    bench = Bench()
    bench.upload(FIVE)
    assert acks(bench.ask(bench.item(4, FIVE[4]))) == [MissionResult.ERROR]


def test_a_second_count_from_the_same_sender_restarts():
    bench = Bench()
    bench.count(5)
    bench.ask(bench.item(0, FIVE[0]))
    assert requests(bench.count(3)) == [0]
    for index in range(3):
        answers = bench.ask(bench.item(index, FIVE[index]))
    assert acks(answers) == [MissionResult.ACCEPTED]
    assert len(bench.vehicle.mission) == 3


@pytest.mark.parametrize(
    "question",
    [
        m.MissionCount(1, 1, 2),
        m.MissionRequestList(1, 1),
        m.MissionRequestInt(1, 1, 0),
        m.MissionRequest(1, 1, 0),
        m.MissionWritePartialList(1, 1, 0, 0),
    ],
)
def test_a_rival_is_denied_meanwhile(question):
    bench = Bench()
    bench.count(5)
    answers = bench.ask(question, sender=RIVAL)
    assert acks(answers) == [MissionResult.DENIED]
    assert (answers[0].target_system, answers[0].target_component) == RIVAL
    assert requests(bench.ask(bench.item(0, FIVE[0]))) == [1]


def test_a_rivals_item_is_denied_and_not_written():
    bench = Bench()
    bench.count(5)
    bench.ask(bench.item(0, FIVE[0]))
    assert acks(bench.ask(bench.item(1, FIVE[4]), sender=RIVAL)) == [MissionResult.DENIED]
    assert len(bench.vehicle.mission) == 1


def test_a_rival_clearing_meanwhile_gets_an_error():
    bench = Bench()
    bench.count(5)
    assert acks(bench.ask(m.MissionClearAll(1, 1), sender=RIVAL)) == [MissionResult.ERROR]


def test_fence_and_mission_can_be_uploaded_at_the_same_time():
    bench = Bench()
    fence = square(50, 0)
    bench.count(2)
    bench.count(4, MissionType.FENCE, sender=RIVAL)
    results = []
    for seq in range(4):
        results += bench.ask(bench.item(seq, fence[seq], MissionType.FENCE), sender=RIVAL)
        if seq < 2:
            results += bench.ask(bench.item(seq, FIVE[seq]))
    found = [(ack.mission_type, ack.type) for ack in results if isinstance(ack, m.MissionAck)]
    assert found == [(MissionType.MISSION, 0), (MissionType.FENCE, 0)]
    assert (len(bench.vehicle.mission), len(bench.vehicle.fence)) == (2, 4)


def test_no_items_empty_the_list_even_armed_in_auto():
    bench = Bench()
    bench.upload(FIVE)
    bench.start_auto()
    assert acks(bench.count(0)) == [MissionResult.ACCEPTED]
    assert bench.vehicle.mission == ()


@pytest.mark.parametrize("mission_type", [MissionType.FENCE, MissionType.RALLY])
def test_no_items_empty_the_other_lists(mission_type):
    items = square(50, 0) if mission_type == MissionType.FENCE else [placed(Command.RALLY_POINT, HOME)]
    items = [kept(item) for item in items]
    bench = Bench()
    assert bench.upload(items, mission_type)[0] == MissionResult.ACCEPTED
    assert acks(bench.count(0, mission_type)) == [MissionResult.ACCEPTED]
    assert bench.download(mission_type) == []


def test_clear_all_is_an_error_while_armed_in_auto():
    bench = Bench()
    bench.upload(FIVE)
    bench.start_auto()
    assert acks(bench.ask(m.MissionClearAll(1, 1))) == [MissionResult.ERROR]
    assert len(bench.vehicle.mission) == 5
    assert bench.command(Command.DO_SET_MODE, 1, 4) == 0
    assert acks(bench.ask(m.MissionClearAll(1, 1))) == [MissionResult.ACCEPTED]
    assert bench.vehicle.mission == ()


def test_clear_all_clears_a_fence():
    bench = Bench(SimulatorConfig(streams=False, fence=tuple(square(50, 0))))
    assert acks(bench.ask(m.MissionClearAll(1, 1, MissionType.FENCE))) == [MissionResult.ACCEPTED]
    assert bench.vehicle.fence == ()


@pytest.mark.parametrize(("mission_type", "limit"), [(0, 655), (1, 84), (2, 50)])
def test_a_count_over_the_limit_has_no_space_and_the_old_list_is_kept(mission_type, limit):
    bench = Bench(SimulatorConfig(streams=False, mission=line(3), fence=tuple(square(50, 0))))
    before = (bench.vehicle.mission, bench.vehicle.fence)
    assert acks(bench.count(limit + 1, mission_type)) == [MissionResult.NO_SPACE]
    assert bench.texts() == [f"Only {limit} items are supported"]
    assert (bench.vehicle.mission, bench.vehicle.fence) == before
    assert requests(bench.count(limit, mission_type)) == [0]


@pytest.mark.parametrize(
    ("name", "mission_type", "limit"), [("BRD_SD_MISSION", 0, 4368), ("BRD_SD_FENCE", 1, 4096)]
)
def test_an_sd_card_holds_more(name, mission_type, limit):
    bench = Bench(SimulatorConfig(streams=False, parameters={name: 64.0}))
    assert acks(bench.count(limit + 1, mission_type)) == [MissionResult.NO_SPACE]
    assert bench.texts() == [f"Only {limit} items are supported"]
    assert requests(bench.count(limit, mission_type)) == [0]


def test_655_items_fit():
    bench = Bench()
    items = [placed(Command.NAV_WAYPOINT, HOME), *line(654)]
    bench.send(m.MissionCount(1, 1, 655), *[bench.item(seq, item) for seq, item in enumerate(items)])
    bench.run(0.1)
    assert acks(bench.of(m.MissionAck)) == [MissionResult.ACCEPTED]


@pytest.mark.parametrize("mission_type", [255, 7])
@pytest.mark.parametrize(
    "question",
    [
        lambda kind: m.MissionCount(1, 1, 2, kind),
        lambda kind: m.MissionRequestList(1, 1, kind),
        lambda kind: m.MissionClearAll(1, 1, kind),
    ],
)
def test_other_mission_types_are_unsupported(mission_type, question):
    bench = Bench()
    answers = bench.ask(question(mission_type))
    assert acks(answers) == [MissionResult.UNSUPPORTED]
    assert answers[0].mission_type == mission_type


def test_a_partial_list_is_written_in_place():
    bench = Bench()
    bench.upload(FIVE)
    new = [kept(waypoint(at(5.0, east_m))) for east_m in (7.0, 8.0)]
    assert requests(bench.ask(m.MissionWritePartialList(1, 1, 2, 3))) == [2]
    assert requests(bench.ask(bench.item(2, new[0]))) == [3]
    assert acks(bench.ask(bench.item(3, new[1]))) == [MissionResult.ACCEPTED]
    old = line(4)
    assert bench.vehicle.mission[1:] == (old[0], *new, old[3])


@pytest.mark.parametrize(("first", "last"), [(2, 9), (-1, 2), (3, 2)])
def test_a_partial_list_past_the_ends_is_rejected(first, last):
    bench = Bench()
    bench.upload(FIVE)
    bench.heard.clear()
    assert acks(bench.ask(m.MissionWritePartialList(1, 1, first, last))) == [MissionResult.ERROR]
    assert bench.texts() == ["Flight plan update rejected"]


def test_a_partial_fence_is_judged_as_a_whole():
    bench = Bench(SimulatorConfig(streams=False, fence=tuple(square(50, 0))))
    moved = square(50, 1)[2]
    bench.ask(m.MissionWritePartialList(1, 1, 2, 2, MissionType.FENCE))
    assert acks(bench.ask(bench.item(2, moved, MissionType.FENCE))) == [MissionResult.ACCEPTED]
    assert bench.vehicle.fence[2].lon_e7 == moved.lon_e7
    assert len(bench.vehicle.fence) == 4


def test_missions_are_not_atomic():
    bench = Bench()
    bench.upload([placed(Command.NAV_WAYPOINT, HOME), *line(9)])
    new = [
        placed(Command.NAV_WAYPOINT, HOME),
        *(kept(waypoint(at(0.0, 10.0 * east))) for east in range(1, 5)),
    ]
    bench.count(5)
    bench.ask(bench.item(0, new[0]))
    bench.ask(bench.item(1, new[1]))
    bench.run(9.0)
    old = line(9)
    assert bench.vehicle.mission[1:] == (new[1], old[1], old[2], old[3])


def test_fences_are_atomic():
    old = tuple(square(50, 0))
    bench = Bench(SimulatorConfig(streams=False, fence=old))
    before = bench.vehicle.fence
    bench.count(4, MissionType.FENCE)
    for seq, item in enumerate(square(80, 0)[:3]):
        bench.ask(bench.item(seq, item, MissionType.FENCE))
    bench.run(9.0)
    assert bench.vehicle.fence == before


def test_item_0_is_home_whatever_is_sent():
    bench = Bench()
    bench.upload([placed(Command.NAV_WAYPOINT, at(77, 77)), *line(2)])
    home = bench.download()[0]
    assert (home.frame, home.command, home.x, home.y) == (0, 16, 400713740, -1052299300)


def test_a_bad_item_0_fails_the_upload():
    bench = Bench()
    bad = placed(5001, HOME, 4.0)
    assert bench.upload([bad, *line(2)])[0] == MissionResult.UNSUPPORTED


def test_a_fresh_vehicle_counts_one_and_a_cleared_one_none():
    bench = Bench()
    assert [item.command for item in bench.download()] == [Command.NAV_WAYPOINT]
    bench.ask(m.MissionClearAll(1, 1))
    assert bench.download() == []


def test_a_good_upload_says_so():
    bench = Bench()
    assert bench.upload(FIVE) == (MissionResult.ACCEPTED, ["Flight plan received"])
    said = next(message for message in bench.of(m.Statustext) if message.text == "Flight plan received")
    assert said.severity == 6


def test_float_items_are_taken():
    bench = Bench()
    bench.count(2)
    position = at(10.0, 0.0)
    for seq in (0, 1):
        item = m.MissionItem(1, 1, seq, 3, 16, 0, 1, 0, 0, 0, 0, position.lat_deg, position.lon_deg, 0.0)
        answers = bench.ask(item)
    assert acks(answers) == [MissionResult.ACCEPTED]
    read = bench.vehicle.mission[1].position
    # A float of degrees is up to 4 m off at this longitude.
    assert abs(read.lat_deg - position.lat_deg) < 2e-6
    assert abs(read.lon_deg - position.lon_deg) < 4e-6


def test_a_float_item_that_is_no_place_is_refused():
    bench = Bench()
    bench.count(2)
    bench.ask(bench.item(0, FIVE[0]))
    item = m.MissionItem(1, 1, 1, 3, 16, 0, 1, 0, 0, 0, 0, float("nan"), 0.0, 0.0)
    assert acks(bench.ask(item)) == [MissionResult.INVALID_PARAM5_X]


@pytest.mark.parametrize(("component", "answered"), [(0, True), (1, True), (190, True)])
@pytest.mark.parametrize("system", [0, 1])
def test_what_is_addressed_to_the_vehicle_is_answered(system, component, answered):
    bench = Bench()
    assert bool(bench.ask(m.MissionRequestList(system, component))) is answered


def test_another_system_is_met_with_silence():
    bench = Bench()
    assert bench.ask(m.MissionRequestList(2, 1), m.MissionCount(2, 1, 3)) == []


def test_a_neighbour_of_the_same_system_gets_its_own_mail():
    bench = Bench()
    bench.send(m.Heartbeat(18, 8), sender=(1, 195))
    assert bench.ask(m.MissionRequestList(1, 195), sender=GCS) == []
    assert bench.ask(m.MissionRequestList(1, 1), sender=(1, 195)) == [m.MissionCount(1, 195, 1, 0)]


def test_the_vehicle_does_not_hear_itself():
    bench = Bench()
    assert bench.ask(m.MissionRequestList(1, 1), sender=(1, 1)) == []


def test_a_reboot_forgets_the_upload_but_not_what_was_written():
    bench = Bench()
    bench.upload([placed(Command.NAV_WAYPOINT, HOME), *line(9)])
    bench.count(5)
    bench.ask(bench.item(0, FIVE[0]))
    bench.vehicle.reboot(bench.now_s)
    bench.heard.clear()
    assert bench.ask(m.MissionRequestList(1, 1)) == []
    bench.run(3.1)
    assert "ArduPilot Ready" in bench.texts()
    assert acks(bench.ask(bench.item(1, FIVE[1]))) == [MissionResult.ERROR]
    assert len(bench.download()) == 5
