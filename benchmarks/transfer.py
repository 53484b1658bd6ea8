"""How uploads end over bad links, and how long they take: in stepped time against the simulated vehicle, and over its TCP link.

Run ``python benchmarks/transfer.py`` (about five minutes on two cores); ``--write docs/transfers.md`` puts the tables into that page,
``--trials`` and ``--transfers`` set how many transfers a row and the campaign get. It exits with 1 if any outcome was untrue.
"""

from __future__ import annotations

import argparse
import multiprocessing
import platform
import statistics
import subprocess
import sys
import time
from collections import Counter
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING

sys.path.insert(0, str(Path(__file__).parent.parent / "tests" / "mavlink_bridge"))

from protocol.campaign import Judged, Scenario, scenario_of, transfer
from protocol.twin import PEER, Client, Faults, Twin, Vehicle, plain_mission

from mavlink_bridge.link import Link, now_s, open_link
from mavlink_bridge.mavlink.messages import MissionType
from mavlink_bridge.protocol.download import Download
from mavlink_bridge.protocol.upload import WINDOW, Upload
from mavlink_bridge.protocol.verified_upload import VerifiedUpload

if TYPE_CHECKING:
    from multiprocessing.pool import Pool

    from mavlink_bridge.protocol.machine import Machine

Lie = tuple[object, tuple[str, ...]]
MISSION = MissionType.MISSION
KINDS = ("verified", "restored", "unchanged", "refused", "different", "unknown", "busy", "no_answer")
LINKS = {
    "no loss": Faults(0.0, 0.0, 0.05, 0.1),
    "2 % loss": Faults(0.02, 0.0, 0.05, 0.1),
    "5 % loss": Faults(0.05, 0.0, 0.05, 0.1),
    "10 % loss": Faults(0.1, 0.0, 0.05, 0.1),
    "20 % loss": Faults(0.2, 0.0, 0.05, 0.1),
    "30 % loss": Faults(0.3, 0.0, 0.05, 0.1),
    "40 % loss": Faults(0.4, 0.0, 0.05, 0.1),
    "10 % loss, 200 to 250 ms": Faults(0.1, 0.0, 0.2, 0.25),
    "2 % loss, 1.2 s round trip": Faults(0.02, 0.0, 0.6, 0.65),
    "2 % loss, radio of 1000 bytes a second": Faults(
        0.02, 0.0, 0.05, 0.1, bytes_per_s=1000, queue_bytes=2000
    ),
    "5 % duplicates": Faults(0.0, 0.05, 0.05, 0.1),
    "10 % duplicates, reordered, 10 to 400 ms": Faults(0.0, 0.1, 0.01, 0.4, keeps_order=False),
    "10 % loss, 10 % duplicates, reordered, 10 to 400 ms": Faults(0.1, 0.1, 0.01, 0.4, keeps_order=False),
}
BEGIN, END = "<!-- measured: begin -->", "<!-- measured: end -->"


def main() -> int:
    """Measure, print, and write the tables where asked."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--trials", type=int, default=2000, help="uploads in each row of the first table")
    parser.add_argument("--transfers", type=int, default=10_000, help="transfers of the campaign")
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--write", type=Path, metavar="PAGE", help="put the tables into this page")
    options = parser.parse_args()
    begun_s = time.monotonic()
    with multiprocessing.Pool(options.processes) as pool:
        outcome_table, lies = _outcomes(pool, options.trials)
        campaign_table, campaign_lies = _campaign(pool, options.transfers)
    tables = "\n\n".join(
        [
            _conditions(options.trials, options.transfers),
            outcome_table,
            campaign_table,
            _speeds(),
            _over_tcp(),
        ]
    )
    print(tables)
    print(f"\n{time.monotonic() - begun_s:.0f} s; {len(lies) + len(campaign_lies)} untrue outcomes")
    for seed, texts in [*lies, *campaign_lies][:20]:
        print(f"  {seed}: {'; '.join(texts)}")
    if options.write:
        page = options.write.read_text(encoding="utf-8")
        head, rest = page.split(BEGIN)
        tail = rest.split(END)[1]
        options.write.write_text(f"{head}{BEGIN}\n{tables}\n{END}{tail}", encoding="utf-8")
    return 1 if lies or campaign_lies else 0


def _conditions(trials: int, transfers: int) -> str:
    today = datetime.now(UTC).date().isoformat()
    return (
        f"Measured on {today} by `benchmarks/transfer.py`, Python {platform.python_version()} on {platform.machine()}, "
        f"pymavlink {version('pymavlink')}; "
        f"{trials} uploads a row, {transfers} transfers in the campaign."
    )


def _outcomes(pool: Pool, trials: int) -> tuple[str, list[Lie]]:
    lines = [
        "### How uploads of 20 items end",
        "",
        "Frames are lost and delayed each way (50 to 100 ms, in order, if not said otherwise); the vehicle held another mission of 12 items.",
        "",
        "| link | verified | old list put back | old list never replaced | unknown | different | no answer | pushes (mean) | median s | 95 % s | longest s |",
        "|---|---|---|---|---|---|---|---|---|---|---|",
    ]
    lies = []
    for name, faults in LINKS.items():
        scenarios = [Scenario(seed, faults) for seed in range(trials)]
        judged = pool.map(transfer, scenarios, chunksize=50)
        lies += [(f"{name} {entry.scenario.seed}", entry.lies) for entry in judged if entry.lies]
        kinds = Counter(str(entry.outcome.kind) for entry in judged)
        times_s = sorted(entry.took_s for entry in judged)
        pushes = statistics.mean(entry.outcome.pushes for entry in judged)
        cells = [
            _share(kinds[kind], trials)
            for kind in ("verified", "restored", "unchanged", "unknown", "different", "no_answer")
        ]
        lines.append(
            f"| {name} | {' | '.join(cells)} | {pushes:.2f} | {statistics.median(times_s):.1f} | "
            f"{times_s[int(0.95 * trials)]:.1f} | {times_s[-1]:.1f} |"
        )
    return "\n".join(lines), lies


def _campaign(pool: Pool, transfers: int) -> tuple[str, list[Lie]]:
    judged = pool.map(_drawn, range(transfers), chunksize=50)
    hours = sum(entry.took_s for entry in judged) / 3600
    lines = [
        "### The campaign",
        "",
        (
            "Missions and fences of 1 to 40 items; loss as in the row, duplicates 0 or 10 %, order kept or not, delays up to 400 ms, a reboot in a "
            f"fifth of the transfers, a rival ground station in a quarter. {hours:.0f} hours of link time. The last column counts outcomes that "
            "said something untrue about what the vehicle held."
        ),
        "",
        f"| loss each way | transfers | {' | '.join(kind.replace('_', ' ') for kind in KINDS)} | untrue |",
        "|---|---|" + "---|" * (len(KINDS) + 1),
    ]
    for loss in sorted({entry.scenario.faults.loss for entry in judged}):
        row = [entry for entry in judged if entry.scenario.faults.loss == loss]
        kinds = Counter(str(entry.outcome.kind) for entry in row if entry.outcome)
        untrue = sum(bool(entry.lies) for entry in row)
        cells = " | ".join(str(kinds[kind]) for kind in KINDS)
        lines.append(f"| {loss:.0%} | {len(row)} | {cells} | {untrue} |")
    return "\n".join(lines), [(entry.scenario.seed, entry.lies) for entry in judged if entry.lies]


def _drawn(seed: int) -> Judged:
    return transfer(scenario_of(seed))


def _speeds() -> str:
    near, slow = Faults(), Faults(0.0, 0.0, 0.1, 0.1)
    lines = [
        "### How long transfers take",
        "",
        (
            "Stepped time, the vehicle at its measured pace. One by one is the same machine with a window of one, as request-driven ground "
            "stations work; verified is everything: old list read, new one pushed and read back."
        ),
        "",
        "| items | link | push one by one s | push s | read one by one s | read s | verified s |",
        "|---|---|---|---|---|---|---|",
    ]
    for count, name, faults in (
        (20, "near", near),
        (100, "near", near),
        (500, "near", near),
        (100, "200 ms round trip", slow),
    ):
        cells = [
            _took(Upload(PEER, MISSION, plain_mission(count), window=1), faults, 12),
            _took(Upload(PEER, MISSION, plain_mission(count)), faults, 12),
            _took(Download(PEER, MISSION, window=1), faults, count),
            _took(Download(PEER, MISSION), faults, count),
            _took(VerifiedUpload(PEER, MISSION, plain_mission(count), is_active=False), faults, 12),
        ]
        lines.append(f"| {count} | {name} | {' | '.join(f'{cell:.2f}' for cell in cells)} |")
    lossy = sorted(
        _took(
            VerifiedUpload(PEER, MISSION, plain_mission(100), is_active=False),
            Faults(0.02, 0.0, 0.1, 0.1),
            12,
            seed,
        )
        for seed in range(300)
    )
    lines += [
        "",
        (
            f"100 items over 200 ms round trip and 2 % loss each way, up and verified: median {statistics.median(lossy):.1f} s, 95 % within "
            f"{lossy[285]:.1f} s, longest of 300 {lossy[-1]:.1f} s."
        ),
    ]
    return "\n".join(lines)


def _took(machine: Machine, faults: Faults, held: int, seed: int = 0) -> float:
    vehicle = Vehicle()
    vehicle.hold(MISSION, plain_mission(held, salt=1))
    client = Client(machine, PEER)
    Twin(vehicle, [client], faults, seed).run()
    assert client.ended_s is not None
    return client.ended_s


def _over_tcp(count: int = 500, runs: int = 5) -> str:
    """Upload over the TCP link of a simulator in a process of its own, in real time; both windows in the same run."""
    command = [sys.executable, "-m", "mavlink_bridge.cli", "sim", "--listen", "tcpin:127.0.0.1:0"]
    times_s = {}
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as simulator:
        assert simulator.stdout is not None
        connection = simulator.stdout.readline().strip()
        try:
            for window in (WINDOW, 1):
                with open_link(connection) as link:
                    times_s[window] = []
                    for salt in range(runs if window > 1 else 1):
                        _real_time(link, _verified(12, salt + 50, WINDOW))
                        times_s[window].append(_real_time(link, _verified(count, salt, window)))
        finally:
            simulator.terminate()
    best, slowest = min(times_s[WINDOW]), max(times_s[WINDOW])
    ratio = times_s[1][0] / statistics.median(times_s[WINDOW])
    return (
        "### Over TCP in real time\n\n"
        f"{count} items up and verified, an old list of 12 backed up before, over the simulator's TCP link: {best:.2f} to {slowest:.2f} s in {runs} runs "
        f"(pushed one by one in the same run: {times_s[1][0]:.1f} s, {ratio:.0f} times as long)."
    )


def _verified(count: int, salt: int, window: int) -> VerifiedUpload:
    return VerifiedUpload(PEER, MISSION, plain_mission(count, salt), is_active=False, window=window)


def _real_time(link: Link, machine: VerifiedUpload) -> float:
    def store_backup() -> None:
        if machine.pending_backup is not None:
            machine.backup_stored(now_s())

    begun_s = time.monotonic()
    link.run(machine, on_step=store_backup)
    assert machine.outcome is not None
    assert machine.outcome.is_verified, machine.outcome
    return time.monotonic() - begun_s


def _share(number: int, total: int) -> str:
    return f"{100 * number / total:.2f} %" if number else "0"


if __name__ == "__main__":
    sys.exit(main())
