"""Seeded transfers over bad links: whatever the link does, the outcome is true and comes in time."""

from __future__ import annotations

import pytest
from protocol.campaign import MOMENTS, RIVALS, Scenario, scenario_of, transfer
from protocol.twin import PEER, RIVAL, Client, Faults, Twin, Vehicle, plain_fence, plain_mission

from mavlink_bridge.mavlink.messages import MissionItemInt, MissionType
from mavlink_bridge.protocol.download import Download
from mavlink_bridge.protocol.verified_upload import Held, OutcomeKind, VerifiedUpload

MISSION, FENCE, RALLY = MissionType.MISSION, MissionType.FENCE, MissionType.RALLY


@pytest.mark.parametrize("hundred", [0, 1, pytest.param(2, marks=pytest.mark.campaign)])
def test_hundreds_of_transfers_tell_the_truth(hundred):
    # `make campaign` goes on with the same seeds
    lies = {}
    for seed in range(100 * hundred, 100 * hundred + 100):
        judged = transfer(scenario_of(seed))
        if judged.lies:
            lies[seed] = judged.lies
    assert lies == {}


@pytest.mark.parametrize(("loss", "least_verified"), [(0.05, 150), (0.1, 150), (0.2, 148)])
def test_most_uploads_end_verified(loss, least_verified):
    kinds = [_standard(seed, Faults(loss, 0.0, 0.05, 0.1)).kind for seed in range(150)]
    assert kinds.count(OutcomeKind.VERIFIED) >= least_verified


def test_duplicates_alone_do_no_harm():
    kinds = {_standard(seed, Faults(0.0, 0.05, 0.05, 0.1)).kind for seed in range(150)}
    assert kinds == {OutcomeKind.VERIFIED}


@pytest.mark.parametrize("count", [0, 1, 2, 20, 500])
def test_a_clean_link_takes_one_push(count):
    twin, client = _run(MISSION, plain_mission(count) if count else [], plain_mission(12, salt=1))
    outcome = client.machine.outcome
    assert (outcome.kind, outcome.held, outcome.pushes) == (OutcomeKind.VERIFIED, Held.WANTED, 1)
    assert len(twin.vehicle.held(MISSION)) == count


def test_five_hundred_items_are_up_and_verified_in_half_a_second():
    _, client = _run(MISSION, plain_mission(500), plain_mission(12, salt=1))
    assert client.machine.outcome.is_verified
    assert client.ended_s <= 0.5


def test_a_hundred_items_over_a_slow_and_lossy_link_take_less_than_eight_seconds():
    times = []
    for seed in range(40):
        _, client = _run(MISSION, plain_mission(100), plain_mission(12, 1), Faults(0.02, 0.0, 0.1, 0.1), seed)
        assert client.machine.outcome.is_verified
        times.append(client.ended_s)
    assert max(times) <= 8.0


@pytest.mark.parametrize("queue_bytes", [300, 1000, 16000])
@pytest.mark.parametrize(("bytes_per_s", "within_s"), [(1000, 40.0), (5000, 15.0)])
def test_a_narrow_link_takes_no_more_pushes_than_a_wide_one(bytes_per_s, within_s, queue_bytes):
    # A telemetry radio: what is pushed ahead waits in its queue, or is dropped where that is full.
    for seed in range(4):
        faults = Faults(0.02, 0.0, 0.05, 0.1, bytes_per_s=bytes_per_s, queue_bytes=queue_bytes)
        _, client = _run(MISSION, plain_mission(100), plain_mission(12, 1), faults, seed)
        outcome = client.machine.outcome
        assert (outcome.kind, outcome.pushes) == (OutcomeKind.VERIFIED, 1)
        assert client.ended_s <= within_s


@pytest.mark.parametrize(
    "faults",
    [
        Faults(0.0, 0.0, 0.65, 0.65),
        Faults(0.0, 0.0, 0.05, 0.1, bytes_per_s=1000, queue_bytes=4000),
    ],
    ids=["1.3 s round trip", "telemetry radio"],
)
def test_what_is_only_late_is_hardly_sent_again(faults):
    _, client = _run(MISSION, plain_mission(100), plain_mission(12, 1), faults)
    items = sum(isinstance(message, MissionItemInt) for _, message in client.sent)
    assert client.machine.outcome.is_verified
    assert items <= 105


def test_answers_to_repeated_items_do_not_end_the_read_back():
    # Half a minute of queue each way: the items sent twice are answered with ERROR while the list is asked for.
    for seed in (0, 4):
        faults = Faults(0.0, 0.0, 0.05, 0.1, bytes_per_s=800, queue_bytes=16000)
        _, client = _run(MISSION, plain_mission(60), plain_mission(12, 1), faults, seed)
        assert client.machine.outcome.is_verified


def test_a_list_that_is_there_already_is_not_written_again():
    _, client = _run(MISSION, plain_mission(20), plain_mission(20))
    assert client.machine.outcome.is_verified
    assert client.machine.outcome.pushes == 0


def test_fence_and_mission_go_up_at_the_same_time():
    vehicle = Vehicle()
    mission = Client(VerifiedUpload(PEER, MISSION, plain_mission(20), is_active=False), PEER)
    fence = Client(VerifiedUpload(PEER, FENCE, plain_fence(5), is_active=False), PEER)
    Twin(vehicle, [mission, fence]).run()
    assert mission.machine.outcome.is_verified
    assert fence.machine.outcome.is_verified


def test_an_abandoned_upload_is_restored():
    # From 1.5 s on nothing of ours gets through for so long that the vehicle gives up, once for every push.
    vehicle = Vehicle()
    vehicle.hold(MISSION, plain_mission(12, salt=1))
    old = vehicle.held(MISSION)
    machine = VerifiedUpload(PEER, MISSION, plain_mission(40), is_active=False, window=1)
    client = Client(machine, PEER)
    twin = Twin(vehicle, [client], Faults(0.0, 0.0, 0.1, 0.1))
    dropped = []

    def drop_later_items(frame):
        if getattr(frame.message, "x", None) is not None and frame.message.seq > 5 and not restoring():
            dropped.append(frame)
        else:
            deliver(frame)

    def restoring():
        return machine.state == "restoring"

    deliver, twin._to_vehicle = twin._to_vehicle, drop_later_items
    twin.run()
    assert dropped
    assert machine.outcome.kind is OutcomeKind.RESTORED
    assert machine.outcome.held is Held.OLD
    assert vehicle.held(MISSION) == old


def test_a_rival_that_keeps_the_list_is_reported():
    vehicle = Vehicle()
    rival = Client(_Forever(), RIVAL)
    client = Client(
        VerifiedUpload(PEER, MISSION, plain_mission(5), is_active=False, rival_patience_s=5.0), PEER, 1.0
    )
    twin = Twin(vehicle, [rival, client])
    twin.run_until_ended(client, 100.0)
    assert client.machine.outcome.kind is OutcomeKind.BUSY
    assert client.machine.outcome.pushes == 0
    assert client.ended_s < 10.0


def test_a_rival_that_goes_away_is_waited_for():
    vehicle = Vehicle()
    rival = Client(_Forever(until_s=6.0), RIVAL)
    client = Client(VerifiedUpload(PEER, MISSION, plain_mission(5), is_active=False), PEER, 1.0)
    Twin(vehicle, [rival, client]).run_until_ended(client, 100.0)
    assert client.machine.outcome.is_verified


def test_somebody_elses_list_is_left_alone():
    # A rival uploads its own list between our last item and our read-back.
    vehicle = Vehicle()
    vehicle.hold(MISSION, plain_mission(12, salt=1))
    client = Client(VerifiedUpload(PEER, MISSION, plain_mission(20), is_active=False), PEER)
    twin = Twin(vehicle, [client])
    foreign = plain_mission(9, salt=4)
    deliver = twin._to_clients

    def replace_list(frame):
        if client.machine.state == "pushing" and getattr(frame.message, "type", None) == 0:
            vehicle.hold(MISSION, foreign)
        deliver(frame)

    twin._to_clients = replace_list
    twin.run()
    outcome = client.machine.outcome
    assert (outcome.kind, outcome.held) == (OutcomeKind.DIFFERENT, Held.FOREIGN)
    assert outcome.differences
    assert len(vehicle.held(MISSION)) == 9


def test_rally_points_and_the_home_item_come_back():
    vehicle = Vehicle()
    vehicle.hold(MISSION, plain_mission(3, salt=2))
    client = Client(Download(PEER, MISSION), PEER)
    Twin(vehicle, [client]).run()
    outcome = client.machine.outcome
    assert outcome.is_complete
    assert outcome.items == vehicle.held(MISSION)


def test_scenarios_differ():
    scenarios = [scenario_of(seed) for seed in range(300)]
    assert all(isinstance(scenario, Scenario) for scenario in scenarios)
    assert {scenario.rival for scenario in scenarios} == {None, *RIVALS}
    assert {scenario.rival_begins_in for scenario in scenarios if scenario.rival} == set(MOMENTS)
    for kind in ("rival_has_our_ids", "is_shared", "odd_items", "breaks_after"):
        assert 10 < sum(bool(getattr(scenario, kind)) for scenario in scenarios) < 200
    assert {scenario.faults.loss for scenario in scenarios} == {0.0, 0.02, 0.05, 0.1, 0.2, 0.3, 0.4}
    assert any(scenario.reboots for scenario in scenarios)


class _Forever:
    """A rival that announces a list of two again and again and never sends an item."""

    pending_backup = None

    def __init__(self, until_s=1e9):
        self._next_s, self._until_s, self._due = 0.0, until_s, False

    @property
    def deadline_s(self):
        return self._next_s

    @property
    def is_done(self):
        return self._next_s > self._until_s

    def start(self, now_s):
        self.handle_timer(now_s)

    def receive(self, frame, now_s):
        pass

    def handle_timer(self, now_s):
        if now_s >= self._next_s:
            self._next_s, self._due = now_s + 2.0, True

    def messages_to_send(self):
        from mavlink_bridge.mavlink.messages import MissionCount

        due, self._due = self._due, False
        return [MissionCount(1, 1, 2)] if due else []


def _standard(seed, faults):
    return _run(MISSION, plain_mission(20), plain_mission(12, salt=1), faults, seed)[1].machine.outcome


def _run(kind, wanted, old, faults=None, seed=0):
    vehicle = Vehicle()
    vehicle.hold(kind, old)
    client = Client(VerifiedUpload(PEER, kind, wanted, is_active=False), PEER)
    twin = Twin(vehicle, [client], faults, seed)
    twin.run()
    return twin, client
