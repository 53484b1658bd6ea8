"""The safe upload against the whole simulated rover, as bytes over its own bad link: loss, duplicates, bit errors, silence, reboot."""

from __future__ import annotations

import pytest
from protocol.twin import PEER, plain_mission

from mavlink_bridge.mavlink.codec import Codec
from mavlink_bridge.mavlink.messages import MissionType
from mavlink_bridge.mavlink.signing import Signing, SigningKey
from mavlink_bridge.protocol.verified_upload import Held, OutcomeKind, VerifiedUpload
from mavlink_bridge.simulator import SimulatedVehicle, SimulatorConfig
from mavlink_bridge.simulator.faults import Faults, FaultyLink

MISSION = MissionType.MISSION
OLD, NEW = plain_mission(12, salt=1), plain_mission(20)
STEP_S = 0.01


def run(faults, seed, signing=False, reboot_s=None):
    """Run one upload in stepped time; return the outcome and the vehicle."""
    vehicle = SimulatedVehicle(SimulatorConfig(mission=tuple(OLD[1:])))
    machine = VerifiedUpload(PEER, MISSION, NEW)
    ours, theirs = (
        Codec(*ids, _signing() if signing else None)
        for ids in ((PEER.own_system, PEER.own_component), (1, 1))
    )
    up, down = FaultyLink(faults, seed), FaultyLink(faults, seed + 1000)
    now_s = 0.0
    machine.start(now_s)
    while not machine.is_done and now_s < machine.bound_s:
        for message in machine.messages_to_send():
            up.push(ours.encode(message), now_s)
        now_s += STEP_S
        if reboot_s is not None and now_s >= reboot_s:
            vehicle.reboot(now_s)
            reboot_s = None
        for data in up.due(now_s):
            for frame in theirs.decode(data):
                vehicle.receive(frame, now_s)
        vehicle.handle_timer(now_s)
        for message in vehicle.messages_to_send():
            down.push(theirs.encode(message), now_s)
        for data in down.due(now_s):
            for frame in ours.decode(data):
                machine.receive(frame, now_s)
        if machine.pending_backup is not None:
            machine.backup_stored(now_s)
        machine.handle_timer(now_s)
    return machine.outcome, vehicle


def _signing():
    return Signing(SigningKey(bytes(32)), lambda: 1_800_000_000.0)


@pytest.mark.parametrize(
    "faults",
    [
        Faults(),
        Faults(loss=0.1, duplicate=0.1, latency_s=0.05, jitter_s=0.05),
        Faults(reorder=0.2, latency_s=0.02),
        Faults(bit_error=0.1, latency_s=0.02),
        Faults(silence=(0.2, 6.0), latency_s=0.05),
    ],
    ids=["clean", "loss and duplicates", "reordered", "bit errors", "silence"],
)
@pytest.mark.parametrize("seed", range(2))
def test_uploads_end_verified(faults, seed):
    outcome, vehicle = run(faults, seed)
    assert outcome.kind is OutcomeKind.VERIFIED
    assert [(item.lat_e7, item.lon_e7) for item in vehicle.mission[1:]] == [
        (item.lat_e7, item.lon_e7) for item in NEW[1:]
    ]


def test_a_reboot_in_the_middle():
    outcome, _ = run(Faults(loss=0.1, latency_s=0.1), 3, reboot_s=2.0)
    assert outcome.held is Held.WANTED


def test_a_signed_link():
    outcome, _ = run(Faults(loss=0.05, latency_s=0.02), 4, signing=True)
    assert outcome.held is Held.WANTED


def test_a_link_that_dies():
    outcome, _ = run(Faults(silence=(0.6, 1e9), latency_s=0.1), 0)
    assert outcome.kind in (OutcomeKind.UNKNOWN, OutcomeKind.NO_ANSWER)
