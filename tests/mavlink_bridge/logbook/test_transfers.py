"""Which lists went over a link, as far as a log shows it."""

from __future__ import annotations

import pytest
from logbook.making import FIELD, ROVER, STATION, Log

from mavlink_bridge.fold import KINDS
from mavlink_bridge.logbook import Ending, Way
from mavlink_bridge.logbook.transfers import TransferWatch
from mavlink_bridge.mavlink import messages as m
from mavlink_bridge.mavlink.messages import Frame, MissionType
from missions.fence import fence_to_items
from missions.situation import ListKind

ITEMS = fence_to_items(FIELD)
FENCE = MissionType.FENCE


def watch(log, keep=lambda _sender, _message: True):
    watcher = TransferWatch(*ROVER)
    for time_s, sender, message in log.rows:
        if keep(sender, message):
            watcher.look(Frame(*sender, message), time_s)
    return watcher.finish()


@pytest.mark.parametrize("kind", [MissionType.MISSION, FENCE, MissionType.RALLY])
def test_an_upload_and_a_read_back(kind):
    log = Log()
    log.upload(kind, ITEMS)
    log.read_back(kind, ITEMS)
    upload, read = watch(log)
    assert (upload.kind, upload.way, upload.ending) == (KINDS[kind], Way.UPLOAD, Ending.COMPLETE)
    assert (upload.announced, upload.seen, upload.result) == (8, 8, "ACCEPTED")
    assert (read.way, read.ending, read.station, read.result) == (
        Way.READ_BACK,
        Ending.COMPLETE,
        STATION,
        None,
    )
    assert upload.station == STATION
    assert upload.ended_s < read.begun_s < read.ended_s


def test_an_upload_that_is_refused_or_never_answered():
    log = Log()
    log.upload(FENCE, ITEMS, result=int(m.MissionResult.NO_SPACE))
    log.upload(FENCE, ITEMS, result=None)
    log.upload(FENCE, ITEMS, result=99)
    refused, silent, strange = watch(log)
    assert (refused.ending, refused.result) == (Ending.REFUSED, "NO_SPACE")
    assert (silent.ending, silent.result) == (Ending.UNANSWERED, None)
    assert (strange.ending, strange.result) == (Ending.REFUSED, "99")


def test_items_missing_in_the_log_make_it_partial():
    log = Log()
    log.upload(FENCE, ITEMS)
    log.read_back(FENCE, ITEMS)
    upload, read = watch(log, lambda _, message: getattr(message, "seq", 0) != 3)
    assert (upload.ending, upload.seen, upload.announced) == (Ending.PARTIAL, 7, 8)
    assert (read.ending, read.seen) == (Ending.PARTIAL, 7)


def test_a_log_that_begins_amid_a_transfer():
    log = Log()
    log.upload(FENCE, ITEMS)
    log.read_back(FENCE, ITEMS)
    upload, read = watch(log, lambda _, message: not isinstance(message, m.MissionCount))
    assert (upload.announced, upload.seen, upload.ending) == (None, 8, Ending.PARTIAL)
    assert (read.announced, read.seen, read.ending) == (None, 8, Ending.PARTIAL)


def test_the_vehicles_side_alone_still_tells_of_an_upload():
    log = Log()
    log.upload(FENCE, ITEMS)
    (upload,) = watch(log, lambda sender, _: sender == ROVER)
    assert (upload.way, upload.station, upload.seen) == (Way.UPLOAD, STATION, 0)
    assert (upload.ending, upload.result) == (Ending.PARTIAL, "ACCEPTED")


def test_what_is_said_twice_is_one_transfer():
    log = Log()
    log.upload(FENCE, ITEMS)
    log.row(ROVER, m.MissionRequest(*STATION, 7, FENCE))  # late
    log.read_back(FENCE, ITEMS)
    log.rows = [row for row in log.rows for _ in range(2)]
    assert [transfer.ending for transfer in watch(log)] == [Ending.COMPLETE, Ending.COMPLETE]


def test_an_empty_list_is_whole_and_deletions_are_told():
    log = Log()
    log.read_back(MissionType.RALLY, ())
    log.row(STATION, m.MissionClearAll(*ROVER, MissionType.ALL))
    log.row(ROVER, m.MissionAck(*STATION, 0, MissionType.ALL))
    log.row(STATION, m.MissionClearAll(*ROVER, FENCE))
    read, *cleared, last = watch(log)
    assert (read.way, read.ending, read.announced) == (Way.READ_BACK, Ending.COMPLETE, 0)
    assert {transfer.kind for transfer in cleared} == set(ListKind)
    assert {(transfer.way, transfer.ending) for transfer in cleared} == {(Way.CLEAR, Ending.COMPLETE)}
    assert last.ending is Ending.UNANSWERED


def test_a_partial_write():
    log = Log()
    log.row(STATION, m.MissionWritePartialList(*ROVER, 2, 3, FENCE))
    for seq in (2, 3):
        log.row(STATION, m.MissionItemInt(*ROVER, seq, 0, 5001, 0, 1, 4.0, 0, 0, 0, 0, 0, 0.0, FENCE))
    log.row(ROVER, m.MissionAck(*STATION, 0, FENCE))
    (written,) = watch(log)
    assert (written.way, written.seen, written.announced) == (Way.PARTIAL_WRITE, 2, 2)
    assert written.ending is Ending.COMPLETE


def test_what_belongs_to_no_transfer_of_this_vehicle():
    log = Log()
    guided = m.MissionItemInt(*ROVER, 0, 6, 16, 2, 1, 0, 0, 0, 0, 1, 1, 0.0)
    log.row(STATION, guided)
    log.row(STATION, m.MissionCount(9, 1, 5, FENCE))
    log.row((9, 1), m.MissionCount(*STATION, 5, FENCE))
    log.row(STATION, m.MissionCount(*ROVER, 5, 77))
    log.row(ROVER, m.MissionAck(*STATION, 0, FENCE))
    assert watch(log) == ()
