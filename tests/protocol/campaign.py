"""Seeded transfers over bad links, judged by what the vehicle really held.

The judge does not use the code under test: what a list becomes when stored is learnt by storing it in a fresh vehicle.
"""

from __future__ import annotations

import random
from dataclasses import dataclass

from protocol.twin import (
    PEER,
    RIVAL,
    WRITES,
    Client,
    Faults,
    Twin,
    Vehicle,
    plain_fence,
    plain_mission,
)

from mavlink_bridge.messages import MissionRequestList, MissionType
from mavlink_bridge.protocol.download import Download
from mavlink_bridge.protocol.upload import Upload
from mavlink_bridge.protocol.verified_upload import Held, OutcomeKind, VerifiedUpload

CLAIMS = {Held.WANTED: "wanted", Held.OLD: "old"}


@dataclass(frozen=True)
class Scenario:
    """One transfer: the lists, the link and what happens meanwhile."""

    seed: int
    faults: Faults
    mission_type: MissionType = MissionType.MISSION
    count: int = 20
    old_count: int = 12
    reboots: tuple[tuple[float, float], ...] = ()
    rival: str | None = None
    rival_begins_s: float = 0.0


@dataclass(frozen=True)
class Judged:
    """How a transfer ended, and what was untrue in what it said."""

    scenario: Scenario
    outcome: object
    took_s: float
    lies: tuple[str, ...]


def scenario_of(seed: int, loss: float | None = None) -> Scenario:
    """Draw a scenario: loss 0 to 40 % each way, duplicates, reordering, jitter to 400 ms, reboots, rivals."""
    draw = random.Random(f"scenario {seed}")
    loss = draw.choice((0.0, 0.05, 0.1, 0.2, 0.3, 0.4)) if loss is None else loss
    least_s, most_s = draw.choice(((0.001, 0.002), (0.01, 0.05), (0.01, 0.4), (0.1, 0.15)))
    faults = Faults(loss, draw.choice((0.0, 0.1)), least_s, most_s, keeps_order=draw.random() < 0.5)
    reboots = ()
    if draw.random() < 0.2:
        begin_s = draw.uniform(0.0, 8.0)
        reboots = ((begin_s, begin_s + draw.choice((0.1, 3.0, 12.0))),)
    rival = draw.choice(("upload", "half an upload", "download")) if draw.random() < 0.25 else None
    fence = draw.random() < 0.25
    return Scenario(
        seed,
        faults,
        MissionType.FENCE if fence else MissionType.MISSION,
        count=draw.choice((1, 2, 5)) * 4 if fence else draw.choice((1, 2, 5, 20, 20, 40)),
        old_count=draw.choice((0, 8, 12)) if fence else draw.choice((0, 1, 12, 20, 30)),
        reboots=reboots,
        rival=rival,
        rival_begins_s=draw.uniform(0.0, 10.0),
    )


def transfer(scenario: Scenario) -> Judged:
    """Run a scenario to its end and judge it."""
    kind = scenario.mission_type
    wanted = _list(kind, scenario.count, 0)
    old = _list(kind, scenario.old_count, 1)
    vehicle = Vehicle(off=list(scenario.reboots))
    vehicle.hold(kind, old)
    client = Client(VerifiedUpload(PEER, kind, wanted, is_active=False), PEER)
    clients = [client, *_rivals(scenario)]
    twin = Twin(vehicle, clients, scenario.faults, scenario.seed)
    timeline = _watch(twin, kind)
    twin.run_until_ended(client, client.machine.bound_s + 1.0)
    if client.ended_s is None:
        return Judged(scenario, None, twin.now_s, ("it has not ended",))
    outcome = client.machine.outcome
    stored = {"wanted": _as_stored(kind, wanted), "old": _as_stored(kind, old)}
    if scenario.rival is not None and outcome.backup is not None:
        stored["old"] = outcome.backup  # the rival may have been first
    lies = _lies(scenario, client, outcome, stored, timeline)
    if scenario.rival is None:
        twin.drain()
        held = vehicle.held(kind)
        lies += _lies_after(outcome, held, stored)
    return Judged(scenario, outcome, client.ended_s, tuple(lies))


def _lies(scenario, client, outcome, stored, timeline):
    """Compare what the outcome claims with what the vehicle held while the last read-back ran."""
    lies = []
    if client.ended_s > client.machine.bound_s:
        lies.append(f"it took {client.ended_s:.0f} s, longer than its bound")
    reads = [time_s for time_s, message in client.sent if isinstance(message, MissionRequestList)]
    last_read_s = reads[-1] if reads else 0.0
    claim = CLAIMS.get(outcome.held)
    if outcome.pushes == 0 and outcome.held is Held.OLD:
        claim = None  # "as it was", whatever that is
        if any(isinstance(message, WRITES) for _, message in client.sent):
            lies.append("it says nothing was written, but something was")
    if claim and not _held_between(timeline, last_read_s, client.ended_s, stored[claim]):
        lies.append(f"it says the {claim} list is there, but it never was during the last read-back")
    if outcome.kind is OutcomeKind.VERIFIED:
        if outcome.held is not Held.WANTED or _body(outcome.found) != _body(stored["wanted"]):
            lies.append("verified, but what was read back is not the list")
        if any(time_s > last_read_s and isinstance(message, WRITES) for time_s, message in client.sent):
            lies.append("verified, but something was written after the read-back began")
    if outcome.kind is OutcomeKind.REFUSED:
        lies.append("refused, but the vehicle refuses nothing in this list")
    if scenario.rival is None and outcome.held is Held.FOREIGN:
        lies.append("a foreign list, but there was no rival")
    return lies


def _lies_after(outcome, held, stored):
    """Compare with what the vehicle holds when everything under way has arrived; nobody else was there."""
    truth = next((name for name, items in stored.items() if _body(items) == _body(held)), "a mix")
    lies = []
    if outcome.kind is OutcomeKind.VERIFIED and truth != "wanted":
        lies.append(f"verified, but in the end the vehicle holds {truth}")
    if outcome.kind in (OutcomeKind.RESTORED, OutcomeKind.UNCHANGED, OutcomeKind.REFUSED) and truth != "old":
        lies.append(f"{outcome.kind}, but in the end the vehicle holds {truth}")
    if truth == "a mix" and outcome.kind not in (OutcomeKind.DIFFERENT, OutcomeKind.UNKNOWN):
        lies.append(f"a mixed list reported as {outcome.kind}")
    return lies


def _body(items):
    """Leave the home item of a mission out: it is the vehicle's own."""
    return tuple(item for seq, item in enumerate(items) if seq > 0 or item.command != 16)


def _list(kind, count, salt):
    if kind is MissionType.FENCE:
        return plain_fence(count // 4, salt)
    return plain_mission(count, salt) if count else []


def _as_stored(kind, items):
    fresh = Vehicle()
    fresh.hold(kind, items)
    return fresh.held(kind)


def _rivals(scenario):
    if scenario.rival is None:
        return []
    kind = scenario.mission_type
    items = _list(kind, 16, 5)
    machine = Download(RIVAL, kind) if scenario.rival == "download" else Upload(RIVAL, kind, items, window=1)
    rival = Client(machine, RIVAL, scenario.rival_begins_s)
    if scenario.rival == "half an upload":
        rival.mute_after = 6
    return [rival]


def _watch(twin, kind):
    """Record each list the vehicle holds and from when."""
    vehicle = twin.vehicle
    timeline = [(0.0, vehicle.held(kind))]

    def note():
        held = vehicle.held(kind)
        if held != timeline[-1][1]:
            timeline.append((twin.now_s, held))

    twin.after_vehicle = note
    return timeline


def _held_between(timeline, begin_s, end_s, items):
    for index, (from_s, held) in enumerate(timeline):
        until_s = timeline[index + 1][0] if index + 1 < len(timeline) else float("inf")
        if from_s <= end_s and until_s >= begin_s and _body(held) == _body(items):
            return True
    return False
