"""Reading a list until nobody else was heard to write it meanwhile."""

from __future__ import annotations

from protocol.scripted import Script
from protocol.test_download import ack, count, item
from protocol.twin import PEER

from mavlink_bridge.mavlink.messages import (
    Frame,
    MissionAck,
    MissionRequest,
    MissionRequestInt,
    MissionRequestList,
    MissionType,
)
from mavlink_bridge.protocol.transitions import DownloadState, UndisturbedReadState
from mavlink_bridge.protocol.undisturbed_read import MOST_READS, UndisturbedRead
from mavlink_bridge.protocol.write_watch import WriteWatch

MISSION = MissionType.MISSION
ANOTHERS = MissionRequest(255, 190, 1)
ASKED = MissionRequestList(1, 1, 0)


def read(**options):
    return Script(UndisturbedRead(PEER, MISSION, **options))


def read_once(script, *between, salt=0):
    script.hear(count(3), item(0, salt), item(1, salt), *between)
    return script.hear(item(2, salt))


def test_a_read_that_nobody_disturbs_is_one_read():
    script = read()
    assert script.sent == [ASKED]
    read_once(script)
    outcome = script.machine.outcome
    assert outcome.is_complete
    assert len(outcome.items) == 3
    assert script.machine.progress == (3, 3)
    assert not script.machine.is_disturbed
    assert script.machine.deadline_s is None


def test_a_disturbed_one_is_read_again_when_it_is_quiet():
    script = read()
    read_once(script, ANOTHERS)
    assert script.machine.state is UndisturbedReadState.SETTLING
    assert script.machine.outcome is None
    assert script.machine.progress == (3, 3)
    script.hear(MissionAck(255, 190, 0), after_s=1.0)
    assert script.pass_time(1.4) == []
    assert script.pass_time(0.3) == [ASKED]
    read_once(script, salt=4)
    assert script.machine.outcome.items[1].lat_e7 == item(1, 4).x


def test_an_item_that_comes_twice_not_alike_disturbs():
    script = read()
    read_once(script, item(1, salt=2))
    assert script.machine.state is UndisturbedReadState.SETTLING


def test_home_and_what_comes_twice_alike_do_not():
    script = read()
    read_once(script, item(0, salt=2), item(1))
    assert script.machine.outcome.is_complete


def test_what_is_heard_before_the_read_does_not_disturb_it():
    watch = WriteWatch(PEER, MISSION)
    watch.look(Frame(1, 1, ANOTHERS), 0.0)
    script = Script(UndisturbedRead(PEER, MISSION, watch))
    read_once(script, ANOTHERS)  # the watch is somebody else's to show frames to
    assert script.machine.outcome.is_complete


def test_others_that_write_at_every_read_end_it():
    script = read()
    for _ in range(MOST_READS):
        assert not script.machine.is_done
        read_once(script, ANOTHERS)
        script.pass_time(3.0)
    assert script.machine.is_disturbed
    assert sum(isinstance(message, MissionAck) for message in script.sent) == MOST_READS


def test_others_that_never_pause_end_it():
    script = read(rival_patience_s=10.0)
    read_once(script, ANOTHERS)
    while not script.machine.is_done and script.now_s < 100.0:
        script.hear(ANOTHERS, after_s=1.0)
    assert script.machine.is_disturbed
    assert 9.0 <= script.now_s <= 12.0


def test_a_list_that_is_refused_or_silent_fails():
    script = read()
    script.pass_time(11.0)
    assert script.machine.outcome.state is DownloadState.SILENT
    assert script.machine.state is UndisturbedReadState.FAILED
    script = read(rival_patience_s=2.0)
    for _ in range(5):
        script.hear(ack(14), after_s=1.0)
    assert script.machine.outcome.state is DownloadState.BUSY
    assert not script.machine.is_disturbed


def test_all_reads_together_have_their_time():
    script = read(most_s=20.0)
    assert script.machine.bound_s == 20.0
    read_once(script, ANOTHERS)
    script.pass_time(2.5)
    script.hear(count(300))
    while not script.machine.is_done and script.now_s < 100.0:
        script.hear(item(1), after_s=1.0)
    assert script.machine.outcome.state is DownloadState.TOO_SLOW
    assert script.now_s <= 21.0
    assert "announced 300 items and sent 1 in" in script.machine.outcome.shortfall


def test_an_unstarted_one_is_quiet():
    machine = UndisturbedRead(PEER, MISSION)
    machine.handle_timer(1.0)
    machine.receive(Frame(1, 1, count(3)), 1.0)
    assert machine.messages_to_send() == []
    assert machine.progress == (0, 0)
    assert machine.deadline_s is None
    machine.start(2.0)
    machine.start(2.0)
    assert machine.messages_to_send() == [ASKED]
    assert not any(isinstance(message, MissionRequestInt) for message in machine.messages_to_send())
