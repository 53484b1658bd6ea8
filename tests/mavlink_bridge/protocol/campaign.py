"""Seeded transfers over bad links, judged by what the vehicle really held.

The judge does not use the code under test: what a list becomes when stored is learnt by storing it in a fresh vehicle, and lists are compared by how
they print, so that an item that is not a number is equal to itself.

Run it with ``make campaign COUNT=10000``, or ``python tests/mavlink_bridge/protocol/campaign.py --count 10000``. It ends with 1 if anything was untrue.
"""

from __future__ import annotations

import argparse
import math
import operator
import platform
import random
import sys
from collections import Counter
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path

if __name__ == "__main__":
    sys.path.insert(0, str(Path(__file__).parent.parent))

from protocol.twin import (
    PEER,
    RIVAL,
    WRITES,
    Client,
    Faults,
    PartialWriter,
    Twin,
    plain_fence,
    plain_mission,
    vehicle_of,
)

from mavlink_bridge.mavlink.autopilots import ARDUPILOT, PX4_1_17, PX4_1_18, AutopilotTable
from mavlink_bridge.mavlink.messages import (
    MissionAck,
    MissionItemInt,
    MissionRequest,
    MissionRequestInt,
    MissionRequestList,
    MissionResult,
    MissionType,
)
from mavlink_bridge.protocol.download import Download
from mavlink_bridge.protocol.transitions import VerifiedUploadState
from mavlink_bridge.protocol.upload import Upload
from mavlink_bridge.protocol.verified_upload import Held, OutcomeKind, VerifiedUpload

WHOLE_RIVALS = ("upload", "half an upload", "download")
PARTIAL_RIVALS = ("a part", "a part unasked", "a part again and again")
RIVALS = (*WHOLE_RIVALS, *PARTIAL_RIVALS)
MOMENTS = {
    None: 0.25,  # at any time
    VerifiedUploadState.READING_OLD: 0.05,
    VerifiedUploadState.PUSHING: 0.1,
    VerifiedUploadState.READING_BACK: 0.6,
}
"""When a rival comes that replaces a part, and how likely: mostly while the list is read back."""

AUTOPILOTS = {"ardupilot": (ARDUPILOT,), "px4": (PX4_1_17, PX4_1_18)}
"""Whose vehicles the transfers are with; with several, by turns."""

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
    rival_begins_in: VerifiedUploadState | None = None  # so long after this state was entered
    rival_has_our_ids: bool = False
    is_shared: bool = False
    odd_items: bool = False  # the vehicle keeps one otherwise, not even equal to itself
    breaks_after: int | None = None
    autopilot: AutopilotTable = field(default=ARDUPILOT, repr=False)


@dataclass(frozen=True)
class Judged:
    """How a transfer ended, and what was untrue in what it said; ``unheard`` where a write came that no message told of."""

    scenario: Scenario
    outcome: object
    took_s: float
    lies: tuple[str, ...]
    unheard: bool = False


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
    scenario = Scenario(
        seed,
        faults,
        MissionType.FENCE if fence else MissionType.MISSION,
        count=draw.choice((1, 2, 5)) * 4 if fence else draw.choice((1, 2, 5, 20, 20, 40)),
        old_count=draw.choice((0, 8, 12)) if fence else draw.choice((0, 1, 12, 20, 30)),
        reboots=reboots,
        rival=rival,
        rival_begins_s=draw.uniform(0.0, 10.0),
    )
    return _with_malice(scenario, random.Random(f"malice {seed}"))


def _with_malice(scenario: Scenario, draw: random.Random) -> Scenario:
    """Draw what else goes wrong: parts replaced, our ids spoken by others, items unequal to themselves, links that break."""
    if scenario.rival is None and draw.random() < 0.45:
        moment = draw.choices(list(MOMENTS), list(MOMENTS.values()))[0]
        within_s = 10.0 if moment is None else draw.choice((0.5, 1.5, 3.0))
        scenario = replace(
            scenario,
            rival=draw.choice(PARTIAL_RIVALS),
            rival_begins_in=moment,
            rival_begins_s=draw.uniform(0.0, within_s),
        )
        if draw.random() < 0.5 and scenario.mission_type is MissionType.MISSION:
            # Long and far away: most of the read-back is still under way when the rival writes.
            faults = Faults(draw.choice((0.0, 0.0, 0.02, 0.1)), 0.0, 0.2, 0.25)
            scenario = replace(scenario, faults=faults, count=draw.choice((100, 150, 250)), reboots=())
    if scenario.rival is not None and draw.random() < 0.25:
        scenario = replace(scenario, rival_has_our_ids=True)
    if draw.random() < 0.15:
        scenario = replace(scenario, odd_items=True)
    if draw.random() < 0.15:
        scenario = replace(
            scenario, breaks_after=draw.randint(1, 4 * scenario.count + 2 * scenario.old_count + 8)
        )
    return replace(scenario, is_shared=draw.random() < 0.3)


def transfer(scenario: Scenario) -> Judged:
    """Run a scenario to its end and judge it."""
    kind = scenario.mission_type
    autopilot = scenario.autopilot
    peer = replace(PEER, autopilot=autopilot)
    wanted = _list(scenario, scenario.count, 0)
    old = _list(scenario, scenario.old_count, 1)
    vehicle = vehicle_of(autopilot, off=list(scenario.reboots), keeps=_odd(scenario))
    vehicle.hold(kind, old)
    if scenario.odd_items:
        vehicle.spoil(kind)
    before = vehicle.held(kind)
    client = Client(
        VerifiedUpload(peer, kind, wanted, is_active=False), PEER, breaks_after=scenario.breaks_after
    )
    rivals = _rivals(scenario)
    twin = Twin(vehicle, [client, *rivals], scenario.faults, scenario.seed, is_shared=scenario.is_shared)
    timeline = _watch(twin, kind)
    _await_moment(twin, client, rivals, scenario)
    twin.run_until_ended(client, client.machine.bound_s + 1.0)
    if client.is_broken:
        return Judged(scenario, None, twin.now_s, tuple(_broken_lies(scenario, client, vehicle, before)))
    if client.ended_s is None:
        return Judged(scenario, None, twin.now_s, ("it has not ended",))
    outcome = client.machine.outcome
    stored = {"wanted": _as_stored(scenario, wanted), "old": before}
    if scenario.rival is not None and outcome.backup is not None:
        stored["old"] = outcome.backup  # the rival may have been first
    lies = _lies(scenario, client, outcome, stored, timeline)
    told, unheard = _rival_lies(scenario, client, outcome, stored["wanted"], timeline)
    lies += told
    if scenario.rival is None:
        twin.drain()
        held = vehicle.held(kind)
        lies += _lies_after(outcome, held, stored)
    return Judged(scenario, outcome, client.ended_s, tuple(lies), unheard)


def _broken_lies(scenario, client, vehicle, before):
    """Judge a transfer whose link broke: whoever ends it must be able to say that something was written, and what was there before."""
    machine = client.machine
    has_written = any(isinstance(message, WRITES) for _, message in client.sent)
    lies = []
    is_verified = (
        machine.outcome is not None and machine.outcome.is_verified
    )  # it broke at our last word of thanks
    held = vehicle.held(scenario.mission_type)
    if is_verified and scenario.rival is None and _body(held) != _body(machine.outcome.found):
        lies.append("the link broke, and it says verified of what is not there")
    if has_written and not machine.has_written:
        lies.append("a silent end: something was written, and it says that nothing was")
    if has_written and machine.backup is None:
        lies.append("a silent end: something was written, and there is no backup")
    is_as_before = _body(held) == _body(before)
    if scenario.rival is None and not machine.has_written and not is_as_before:
        lies.append("it says that nothing was written, but the list is another one")
    return lies


def _rival_lies(scenario, client, outcome, wanted, timeline):
    """Judge a verified list that a rival may have changed before the vehicle sent its last item of it."""
    if outcome.kind is not OutcomeKind.VERIFIED or scenario.rival is None:
        return [], False
    begun_s = max(time_s for time_s, message in client.sent if isinstance(message, MissionRequestList))
    items = [
        entry
        for entry in client.heard
        if isinstance(entry[2].message, MissionItemInt) and entry[0] >= begun_s
    ]
    last_s = max(
        (sent_s for sent_s, _, frame in items if frame.message.target_system == PEER.own_system),
        default=begun_s,
    )
    held = next(items for from_s, items in reversed(timeline) if from_s <= last_s)
    is_changed = _body(held) != _body(wanted)
    tells = [
        frame for sent_s, _, frame in client.heard if begun_s <= sent_s <= last_s and _tells_of_rival(frame)
    ]
    lies = []
    if tells:
        lies.append(
            "verified, though the vehicle was heard to take items from somebody else during the read-back"
        )
    faults = scenario.faults
    if is_changed and faults.keeps_order and faults.loss == 0:
        lies.append(
            "verified, though the list was changed before its last item was sent, and nothing was lost"
        )
    return lies, is_changed


def _tells_of_rival(frame):
    message = frame.message
    is_word = isinstance(message, MissionRequest | MissionRequestInt) or (
        isinstance(message, MissionAck) and message.type == MissionResult.ACCEPTED
    )
    is_ours = is_word and (message.target_system, message.target_component) == (
        PEER.own_system,
        PEER.own_component,
    )
    return (frame.system, frame.component) == (1, 1) and is_word and not is_ours


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
    if scenario.rival is None and not scenario.odd_items and outcome.held is Held.FOREIGN:
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
    """Leave the home item of a mission out: it is the vehicle's own, the only one in frame 0. Items as they print: NaN is not equal to itself."""
    return tuple(
        _printed(item) for seq, item in enumerate(items) if seq > 0 or (item.command, item.frame) != (16, 0)
    )


def _printed(item):
    numbers = (*map(float, item.params), float(item.alt_m))
    return repr((int(item.command), int(item.frame), item.lat_e7, item.lon_e7, *numbers))


def _list(scenario, count, salt):
    if scenario.mission_type is MissionType.FENCE:
        return plain_fence(count // 4, salt)
    if scenario.autopilot is ARDUPILOT:
        return plain_mission(count, salt) if count else []
    return plain_mission(count + 1, salt)[1:]


def _as_stored(scenario, items):
    fresh = vehicle_of(scenario.autopilot)
    fresh.hold(scenario.mission_type, items)
    return fresh.held(scenario.mission_type)


def _rivals(scenario):
    if scenario.rival is None:
        return []
    peer = replace(PEER if scenario.rival_has_our_ids else RIVAL, autopilot=scenario.autopilot)
    machine = _rival_machine(scenario, peer, _list(scenario, 16, 5))
    begins_s = scenario.rival_begins_s if scenario.rival_begins_in is None else math.inf
    rival = Client(machine, peer, begins_s)
    if scenario.rival == "half an upload":
        rival.mute_after = 6
    return [rival]


def _rival_machine(scenario, peer, items):
    kind = scenario.mission_type
    if scenario.rival == "download":
        return Download(peer, kind)
    if scenario.rival in WHOLE_RIVALS:
        return Upload(peer, kind, items, window=1)
    seq = random.Random(scenario.seed).randrange(1, max(min(scenario.count, 16), 2))
    if scenario.rival == "a part again and again":
        places = [replace(items[seq % len(items)], lat_e7=400700000 + 10 * step) for step in range(200)]
        return PartialWriter(peer, kind, seq, places, every_s=1.0 + scenario.seed % 5)
    return PartialWriter(
        peer, kind, seq, [items[seq % len(items)]], is_blind=scenario.rival == "a part unasked"
    )


def _await_moment(twin, client, rivals, scenario):
    """Let the rival begin when the transfer has come to a state."""
    if not rivals or scenario.rival_begins_in is None:
        return

    def begin_rival(acting):
        if acting is client and client.machine.state is scenario.rival_begins_in:
            twin.after_client = None
            twin.begin(rivals[0], twin.now_s + scenario.rival_begins_s)

    twin.after_client = begin_rival


def _odd(scenario):
    """Return the item that the vehicle keeps otherwise."""
    if not scenario.odd_items:
        return {}
    seq = random.Random(scenario.seed).randrange(1, max(scenario.count, 2))
    odd = _list(scenario, 8, 3)[seq % 4 + 4]
    return {seq: replace(odd, params=(odd.params[0], math.nan, math.nan, math.nan), alt_m=math.inf)}


def _watch(twin, kind):
    """Record each list the vehicle holds and from when."""
    vehicle = twin.vehicle
    timeline = [(0.0, vehicle.held(kind))]
    stored = [list(vehicle.lists[kind].items)]

    def note():
        items = vehicle.lists[kind].items
        if len(items) != len(stored[0]) or any(map(operator.is_not, items, stored[0])):
            stored[0] = list(items)
            timeline.append((twin.now_s, vehicle.held(kind)))

    twin.after_vehicle = note
    return timeline


def _held_between(timeline, begin_s, end_s, items):
    for index, (from_s, held) in enumerate(timeline):
        until_s = timeline[index + 1][0] if index + 1 < len(timeline) else float("inf")
        if from_s <= end_s and until_s >= begin_s and _body(held) == _body(items):
            return True
    return False


def main() -> int:
    """Run the campaign, and print how it ended."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=10_000)
    parser.add_argument("--first", type=int, default=0, help="the first seed")
    parser.add_argument("--autopilot", choices=AUTOPILOTS, default="ardupilot")
    options = parser.parse_args()
    autopilots = AUTOPILOTS[options.autopilot]
    ends, untrue, unheard, longest_s = Counter(), 0, 0, 0.0
    for seed in range(options.first, options.first + options.count):
        scenario = scenario_of(seed)
        judged = transfer(replace(scenario, autopilot=autopilots[seed % len(autopilots)]))
        ends["link broke" if judged.outcome is None else str(judged.outcome.kind)] += 1
        longest_s = max(longest_s, judged.took_s)
        unheard += judged.unheard
        if judged.lies:
            untrue += 1
            print(f"  {seed}: {'; '.join(judged.lies)}", flush=True)
    today = datetime.now(UTC).date().isoformat()
    print(
        f"{today}, Python {platform.python_version()}, pymavlink {version('pymavlink')}: {options.count} runs, {untrue} untrue"
    )
    print(", ".join(f"{kind} {number}" for kind, number in ends.most_common()))
    print(
        f"longest {longest_s:.0f} s; {unheard} verified although a rival's write, of which every message was lost, came before the last item"
    )
    return 1 if untrue else 0


if __name__ == "__main__":
    sys.exit(main())
