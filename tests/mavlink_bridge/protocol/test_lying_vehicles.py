"""Vehicles that lie, in stepped time: "verified" is said only where the vehicle holds the list, and every upload ends within its bound.

Each vehicle is honest but for one thing. What it really holds is compared with what was uploaded when the upload ends.
"""

from __future__ import annotations

import heapq
import itertools
import math
from dataclasses import dataclass, replace

import pytest
from protocol.twin import PEER, RIVAL, Client, Faults, PartialWriter, Twin, plain_mission
from protocol.twin import Vehicle as TwinVehicle

from mavlink_bridge.mavlink import messages as m
from mavlink_bridge.mavlink.messages import Frame, MissionResult, MissionType
from mavlink_bridge.protocol.download import Download
from mavlink_bridge.protocol.outcomes import upload_trouble
from mavlink_bridge.protocol.transitions import VerifiedUploadState
from mavlink_bridge.protocol.verified_upload import Held, OutcomeKind, VerifiedUpload
from mavlink_bridge.protocol.wire import item_from_message
from missions.items import MissionItem

MISSION = MissionType.MISSION
LATENCY_S = 0.05
TICK_S = 0.25
WANTED = plain_mission(6)
FOREIGN = tuple(MissionItem(16, 3, lat_e7=5, lon_e7=5) for _ in range(4))

VERIFIED, DIFFERENT, UNKNOWN = OutcomeKind.VERIFIED, OutcomeKind.DIFFERENT, OutcomeKind.UNKNOWN
UNCHANGED, NO_ANSWER, REFUSED = OutcomeKind.UNCHANGED, OutcomeKind.NO_ANSWER, OutcomeKind.REFUSED


class Vehicle:
    """A vehicle that answers as ArduPilot does; its methods are what a liar does otherwise."""

    delay_s = 0.0

    def __init__(self):
        self.items = list(plain_mission(3, salt=1))
        self.wanted = None  # the item that it waits for, and how many there will be
        self.out = []
        self.writes = 0
        self.stored_s = None
        self.now_s = 0.0

    def send(self, message, sender=(1, 1)):
        self.out.append(Frame(*sender, message))

    def hear(self, message):
        match message:
            case m.MissionRequestList():
                self.list_asked()
            case m.MissionRequestInt():
                self.item_asked(message.seq)
            case m.MissionCount():
                self.writes += 1
                self.count_came(message.count)
            case m.MissionItemInt():
                self.item_came(message)

    def tick(self):
        pass

    def list_asked(self):
        self.send(m.MissionCount(*OURS, len(self.items)))

    def item_asked(self, seq):
        if seq < len(self.items):
            self.give(seq, self.items[seq])
        else:
            self.ack(MissionResult.INVALID_SEQUENCE)

    def give(self, seq, item, sender=(1, 1), kind=0):
        values = (item.frame, item.command, 0, 1, *item.params, item.lat_e7, item.lon_e7, item.alt_m)
        self.send(m.MissionItemInt(*OURS, seq, *values, kind), sender)

    def count_came(self, count):
        del self.items[count:]
        self.wanted = (0, count)
        self.ask(0)

    def ask(self, seq):
        self.send(m.MissionRequest(*OURS, seq))

    def item_came(self, message):
        if self.wanted is None:
            self.ack(MissionResult.ERROR)
        elif message.seq != self.wanted[0]:
            self.ack(MissionResult.INVALID_SEQUENCE)
        else:
            seq, count = self.wanted
            self.store(seq, item_from_message(message))
            self.wanted = (seq + 1, count) if seq + 1 < count else None
            if self.wanted:
                self.ask(seq + 1)
            else:
                self.stored_s = self.now_s
                self.finish()

    def store(self, seq, item):
        self.items[seq : seq + 1] = [item]

    def finish(self):
        self.ack(MissionResult.ACCEPTED)

    def ack(self, result, target=None):
        self.send(m.MissionAck(*(target or OURS), result))


OURS = (PEER.own_system, PEER.own_component)


def meddling(change):
    """Make a vehicle that changes its list when it has come, before it says yes."""

    class Meddling(Vehicle):
        def finish(self):
            change(self.items)
            super().finish()

    return Meddling


def put(seq, **fields):
    return meddling(lambda items: items.__setitem__(seq, replace(items[seq], **fields)))


def swap(items):
    items[2], items[3] = items[3], items[2]


class NeverStores(Vehicle):
    def store(self, seq, item):
        pass


class AckAtCount(Vehicle):
    def count_came(self, count):
        self.ack(MissionResult.ACCEPTED)


class ChangedAfterAck(Vehicle):
    """Its first item is another one when the last was read: that goes unheard, but the list is no more what was read."""

    def item_asked(self, seq):
        super().item_asked(seq)
        if self.stored_s is not None and seq == len(self.items) - 1:
            self.items[1] = replace(self.items[1], lat_e7=self.items[1].lat_e7 + 1000)


class RivalDuringReadBack(Vehicle):
    rounds = 99

    def item_asked(self, seq):
        super().item_asked(seq)
        if self.stored_s is not None and seq == 2 and self.rounds:
            self.rounds -= 1
            for one in range(3):
                self.send(m.MissionRequest(255, 190, one))
                self.items[one] = FOREIGN[one]
            self.ack(MissionResult.ACCEPTED, (255, 190))


class RivalOnce(RivalDuringReadBack):
    rounds = 1


class RivalWithOurIds(Vehicle):
    """Somebody else speaks with our ids: the vehicle asks us for an item that we do not send."""

    done = False

    def item_asked(self, seq):
        super().item_asked(seq)
        if self.stored_s is not None and seq == 3 and not self.done:
            self.done = True
            self.ask(1)
            self.items[1] = FOREIGN[1]
            self.ack(MissionResult.ACCEPTED)


class RivalHeardItself(Vehicle):
    """Only what the other station sends is heard, not what the vehicle answers it."""

    ids = (255, 190)
    done = False

    def item_asked(self, seq):
        super().item_asked(seq)
        if self.stored_s is not None and seq == 3 and not self.done:
            self.done = True
            self.send(m.MissionWritePartialList(1, 1, 1, 1), self.ids)
            self.items[1] = FOREIGN[1]


class OurIdsHeardThemselves(RivalHeardItself):
    ids = OURS


class FlipsList(Vehicle):
    asked = 0

    def list_asked(self):
        self.asked += 1
        if self.asked > 1:
            self.items = [replace(item, lat_e7=self.asked) for item in FOREIGN]
        super().list_asked()


class CountFlood(Vehicle):
    numbers = itertools.cycle((3, 500, 1, 7, 0, 65535, 6))

    def tick(self):
        if self.writes:
            for _ in range(5):
                self.send(m.MissionCount(*OURS, next(self.numbers)))


class AsksForever(Vehicle):
    seq = 0

    def item_came(self, message):
        self.ask(self.seq)


class AsksHuge(AsksForever):
    seq = 60000


class LastFirst(Vehicle):
    def count_came(self, count):
        super().count_came(count)
        self.ask(count - 1)


class AcksAnother(Vehicle):
    def count_came(self, count):
        self.ack(MissionResult.ACCEPTED, (255, 190))


class AcksAnotherList(Vehicle):
    def ack(self, result, target=None):
        self.send(m.MissionAck(*(target or OURS), result, MissionType.FENCE))


class GivesAnotherList(Vehicle):
    def give(self, seq, item, sender=(1, 1), kind=0):
        super().give(seq, item, kind=int(MissionType.FENCE))


class WrongSeqs(Vehicle):
    def give(self, seq, item, sender=(1, 1), kind=0):
        super().give((seq + 1) % len(self.items), item, sender, kind)


class Slow(Vehicle):
    delay_s = 3.0


class BigCount(Vehicle):
    def list_asked(self):
        self.send(m.MissionCount(*OURS, 65535))

    def item_asked(self, seq):
        pass


class BigDrip(BigCount):
    last_s = -9.0

    def item_asked(self, seq):
        if self.now_s >= self.last_s + 2.0:
            self.last_s = self.now_s
            self.give(seq, FOREIGN[0])


class Drip(BigDrip):
    def list_asked(self):
        self.send(m.MissionCount(*OURS, 300))


class Ack250(Vehicle):
    def finish(self):
        self.ack(250)


class Escapes(Vehicle):
    def count_came(self, count):
        self.send(m.Statustext(3, "\x1b]0;PWNED\x07\x1b[2J\x1b[31mverified\r\n error"))
        self.ack(MissionResult.NO_SPACE)


class TextFlood(Vehicle):
    def tick(self):
        for number in range(20):
            self.send(m.Statustext(4, f"flood {number}"))


class BackToFront(Vehicle):
    """Answers each request for an item with all items, the last first."""

    def item_asked(self, seq):
        for one in reversed(range(len(self.items))):
            self.give(one, self.items[one])


class GoodFromAnother(Vehicle):
    """Stores one item wrong; the right one comes at every read from another component."""

    def finish(self):
        self.items[2] = replace(self.items[2], lat_e7=self.items[2].lat_e7 + 7)
        super().finish()

    def give(self, seq, item, sender=(1, 1), kind=0):
        if seq == 2 and self.stored_s is not None:
            super().give(seq, replace(item, lat_e7=item.lat_e7 - 7), (1, 100), kind)
        super().give(seq, item, sender, kind)


class TwiceUnlike(Vehicle):
    """Gives one item right and then as it is: the list changed while it was read, or the first was a late copy."""

    def finish(self):
        self.items[2] = replace(self.items[2], lat_e7=self.items[2].lat_e7 + 7)
        super().finish()

    def give(self, seq, item, sender=(1, 1), kind=0):
        if seq == 2 and self.stored_s is not None:
            super().give(seq, replace(item, lat_e7=item.lat_e7 - 7), sender, kind)
        super().give(seq, item, sender, kind)


class Unequal(Vehicle):
    """Keeps an item that is not equal to itself: a parameter that is no number beside an infinite altitude."""

    def give(self, seq, item, sender=(1, 1), kind=0):
        if seq == 2 and self.stored_s is not None:
            item = replace(item, params=(0.0, float("nan"), 0.0, 0.0), alt_m=math.inf)
        super().give(seq, item, sender, kind)


CASES = {
    "honest": (Vehicle, VERIFIED),
    "north by 1e-7 degrees": (put(3, lat_e7=WANTED[3].lat_e7 + 1), DIFFERENT),
    "west by 1e-7 degrees": (put(5, lon_e7=WANTED[5].lon_e7 - 1), DIFFERENT),
    "two items swapped": (meddling(swap), DIFFERENT),
    "another command": (put(2, command=17), DIFFERENT),
    "another frame": (put(2, frame=0), DIFFERENT),
    "a delay": (put(2, params=(30.0, 0.0, 0.0, 0.0)), DIFFERENT),
    "nothing but NaN": (put(2, params=(math.nan,) * 4, alt_m=math.nan), DIFFERENT),
    "one less": (meddling(list.pop), DIFFERENT),
    "one more": (meddling(lambda items: items.append(FOREIGN[0])), DIFFERENT),
    "never stores": (NeverStores, UNCHANGED),
    "says yes to the count": (AckAtCount, UNCHANGED),
    "a rival at each read-back": (RivalDuringReadBack, UNKNOWN),
    "a rival once": (RivalOnce, DIFFERENT),
    "a rival with our ids": (RivalWithOurIds, DIFFERENT),
    "a rival that is heard itself": (RivalHeardItself, DIFFERENT),
    "our ids heard themselves": (OurIdsHeardThemselves, DIFFERENT),
    "another's list after the yes": (meddling(lambda items: items.__setitem__(slice(None), FOREIGN)), DIFFERENT),
    "another list at each read": (FlipsList, UNKNOWN),
    "a flood of counts": (CountFlood, None),
    "asks for item 0 for ever": (AsksForever, None),
    "asks for item 60000": (AsksHuge, None),
    "asks for the last first": (LastFirst, VERIFIED),
    "says yes to another": (AcksAnother, UNCHANGED),
    "says yes to another list": (AcksAnotherList, None),
    "gives another list": (GivesAnotherList, NO_ANSWER),
    "numbers items wrong": (WrongSeqs, None),
    "answers after 3 s": (Slow, VERIFIED),
    "65535 items, none comes": (BigCount, NO_ANSWER),
    "65535 items, one in 2 s": (BigDrip, NO_ANSWER),
    "300 items, one in 2 s": (Drip, NO_ANSWER),
    "an unknown result": (Ack250, None),
    "refuses with control characters": (Escapes, None),
    "a flood of texts": (TextFlood, VERIFIED),
    "all items, back to front": (BackToFront, VERIFIED),
    "the right item from another component": (GoodFromAnother, DIFFERENT),
    "an item twice, not alike": (TwiceUnlike, UNKNOWN),
    "an item unequal to itself": (Unequal, DIFFERENT),
}  # fmt: skip


@dataclass(frozen=True)
class Ended:
    """How an upload ended."""

    machine: VerifiedUpload
    vehicle: Vehicle
    took_s: float

    @property
    def holds(self):
        """Whether the vehicle holds what was uploaded, item for item; home and what it does not store left out."""

        def kept(items):
            return [(int(item.command), item.lat_e7, item.lon_e7) for item in items[1:]]

        return kept(self.vehicle.items) == kept(WANTED)


def upload(vehicle, wanted=WANTED):
    """Upload to a vehicle in stepped time, everything on its way for a moment."""
    machine = VerifiedUpload(PEER, MISSION, wanted, is_active=False)
    events, order = [], itertools.count()
    now_s, tick_s = 0.0, TICK_S
    machine.start(now_s)
    for _ in range(200_000):
        if machine.pending_backup is not None:
            machine.backup_stored(now_s)
        for message in machine.messages_to_send():
            heapq.heappush(events, (now_s + LATENCY_S + vehicle.delay_s, next(order), vehicle.hear, message))
        for frame in vehicle.out:
            heapq.heappush(events, (now_s + LATENCY_S, next(order), None, frame))
        vehicle.out = []
        if machine.is_done:
            return Ended(machine, vehicle, now_s)
        due = [tick_s, machine.deadline_s, *(events[0][:1] if events else ())]
        now_s = max(now_s, min(due))
        vehicle.now_s = now_s
        if events and events[0][0] <= now_s:
            _, _, hear, what = heapq.heappop(events)
            if hear is None:
                machine.receive(what, now_s)
            else:
                hear(what)
        elif tick_s <= now_s:
            tick_s += TICK_S
            vehicle.send(m.Heartbeat(10, 3, base_mode=1, custom_mode=4))
            vehicle.tick()
        if (deadline_s := machine.deadline_s) is not None and deadline_s <= now_s:
            machine.handle_timer(now_s)
    raise AssertionError(f"it has not ended after {now_s:.0f} s")


@pytest.mark.parametrize("name", CASES)
def test_verified_only_where_it_holds(name):
    vehicle, kind = CASES[name]
    ended = upload(vehicle())
    outcome = ended.machine.outcome
    assert not outcome.is_verified or ended.holds
    assert ended.took_s <= ended.machine.bound_s
    assert kind is None or outcome.kind is kind, outcome
    if ended.vehicle.writes and not outcome.is_verified:
        assert ended.machine.has_written
        assert outcome.backup is not None
        assert upload_trouble(outcome) is not None


def test_what_no_message_tells_is_not_seen():
    # The limit of what a read-back can prove: the list was there when it was read; what changes silently afterwards is not heard.
    ended = upload(ChangedAfterAck())
    assert ended.machine.outcome.is_verified
    assert not ended.holds
    assert [item.lat_e7 for item in ended.machine.outcome.found[1:]] == [item.lat_e7 for item in WANTED[1:]]


@pytest.mark.parametrize("items", ["65535 items, one in 2 s", "300 items, one in 2 s"])
def test_a_list_that_cannot_come_in_time_is_refused_early_with_its_numbers(items):
    ended = upload(CASES[items][0]())
    assert ended.took_s < 25.0
    announced = items.split()[0]
    trouble = str(upload_trouble(ended.machine.outcome))
    assert f"the vehicle announced {announced} items and sent 10 in 20 s; a list may take" in trouble
    assert trouble.endswith("; nothing was written")
    assert not ended.machine.has_written


def test_a_rival_at_each_read_back_is_named():
    outcome = upload(RivalDuringReadBack()).machine.outcome
    assert (outcome.kind, outcome.held, outcome.writer) == (OutcomeKind.UNKNOWN, Held.UNKNOWN, (255, 190))
    assert "system 255 component 190 wrote to the list meanwhile" in str(upload_trouble(outcome))


def test_a_rival_while_the_old_list_is_read_makes_it_read_again():
    class Early(Vehicle):
        rounds = 2

        def item_asked(self, seq):
            super().item_asked(seq)
            if seq == 1 and self.rounds:
                self.rounds -= 1
                self.ask_another(1)

        def ask_another(self, seq):
            self.send(m.MissionRequest(255, 190, seq))
            self.items[seq] = replace(self.items[seq], lat_e7=self.items[seq].lat_e7 + 1)

    ended = upload(Early())
    assert ended.machine.outcome.is_verified
    assert ended.holds
    assert (
        ended.machine.outcome.backup[1].lat_e7 == plain_mission(3, salt=1)[1].lat_e7 + 2
    )  # as it was when we began to write


def test_a_rival_that_writes_on_and_on_before_we_write_leaves_it_to_him():
    class OnAndOn(Vehicle):
        def item_asked(self, seq):
            self.send(m.MissionRequest(255, 190, 1))
            super().item_asked(seq)

    ended = upload(OnAndOn())
    outcome = ended.machine.outcome
    assert (outcome.kind, outcome.writer) == (OutcomeKind.BUSY, (255, 190))
    assert not ended.machine.has_written
    assert ended.vehicle.writes == 0


def test_a_list_written_by_others_while_the_backup_is_stored_is_backed_up_again():
    machine = VerifiedUpload(PEER, MISSION, WANTED, is_active=False)
    machine.start(0.0)
    machine.receive(Frame(1, 1, m.MissionCount(*OURS, 0)), 0.1)
    assert machine.pending_backup == ()
    machine.receive(Frame(1, 1, m.MissionAck(255, 190, 0)), 0.2)
    machine.messages_to_send()
    machine.backup_stored(0.3)
    assert machine.messages_to_send() == [m.MissionRequestList(1, 1, 0)]
    assert not machine.has_written
    machine.receive(Frame(1, 1, m.MissionCount(*OURS, 0)), 0.4)
    machine.backup_stored(0.5)
    assert machine.messages_to_send()[-1] == m.MissionCount(1, 1, 6, 0)
    assert machine.has_written


@pytest.mark.parametrize("latency_s", [0.01, 0.3])
@pytest.mark.parametrize("is_blind", [False, True])
def test_a_part_replaced_at_any_moment_of_a_long_read_back_is_never_verified(latency_s, is_blind):
    # What another station does with MISSION_WRITE_PARTIAL_LIST while 400 items are read back.
    wanted, foreign = plain_mission(400), plain_mission(2, salt=9)[1]
    read_s = 12 * latency_s
    for step in range(8):
        vehicle = TwinVehicle()
        client = Client(VerifiedUpload(PEER, MISSION, wanted, is_active=False), PEER)
        rival = Client(PartialWriter(RIVAL, MISSION, 1, [foreign], is_blind=is_blind), RIVAL, math.inf)
        twin = Twin(vehicle, [client, rival], Faults(0.0, 0.0, latency_s, latency_s))

        def begin(acting, step=step, twin=twin, client=client, rival=rival):
            if acting is client and client.machine.state is VerifiedUploadState.READING_BACK:
                twin.after_client = None
                twin.begin(rival, twin.now_s + step * read_s / 8)

        twin.after_client = begin
        twin.run_until_ended(client, 700.0)
        asked = [sent_s for sent_s, _, frame in client.heard if isinstance(frame.message, m.MissionItemInt)]
        written_s = (
            next((s for s, message in rival.sent if isinstance(message, m.MissionItemInt)), math.inf)
            + latency_s
        )
        if client.machine.outcome.is_verified:
            assert max(asked) <= written_s + 0.02  # it came after the last item had been sent
        else:
            assert client.machine.outcome.held in (Held.FOREIGN, Held.UNKNOWN)


def test_stations_that_only_read_do_not_disturb():
    # Ground stations read the mission all the time.
    vehicle = TwinVehicle()
    client = Client(VerifiedUpload(PEER, MISSION, plain_mission(200), is_active=False), PEER)
    readers = [Client(Download(RIVAL, MISSION), RIVAL, 0.5 + step * 0.7) for step in range(12)]
    Twin(vehicle, [client, *readers], Faults(0.0, 0.0, 0.2, 0.2), is_shared=True).run_until_ended(
        client, 700.0
    )
    assert (client.machine.outcome.kind, client.machine.outcome.pushes) == (OutcomeKind.VERIFIED, 1)
    counted = [message for _, message in client.sent if isinstance(message, m.MissionRequestList)]
    assert len(counted) <= 6  # asked for twice, and again only where the first was not answered yet
    assert client.ended_s < 15.0


def test_a_link_that_breaks_at_any_message_leaves_no_silent_end():
    number = itertools.count(1)
    while True:
        vehicle = TwinVehicle()
        vehicle.hold(MISSION, plain_mission(3, salt=1))
        before = vehicle.held(MISSION)
        client = Client(
            VerifiedUpload(PEER, MISSION, plain_mission(4), is_active=False), PEER, breaks_after=next(number)
        )
        Twin(vehicle, [client], Faults(0.0, 0.0, 0.01, 0.01)).run_until_ended(client, 700.0)
        if not client.is_broken:
            break
        machine = client.machine
        has_written = any(isinstance(message, m.MissionCount) for _, message in client.sent)
        assert machine.outcome is None or machine.outcome.is_verified  # it broke at our last word of thanks
        assert machine.has_written or not has_written
        if machine.has_written:
            assert machine.backup == before
        else:
            assert vehicle.held(MISSION) == before
    assert next(number) > 25
