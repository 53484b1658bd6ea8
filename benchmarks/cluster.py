"""How ``pbpp replay`` of many logs grows with processes and with dask workers on this machine: CPU and wall time, the results compared.

Run as ``python benchmarks/cluster.py [--logs N]``; needs the extra ``cluster``. Each run is a process of its own; its CPU time is that of the command and its children, of the
scheduler and of the workers together, from the command's begin to its end (the cluster stands before).
"""

from __future__ import annotations

import argparse
import datetime as dt
import hashlib
import os
import platform
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import psutil
from distributed import Client

ROOT = Path(__file__).parents[1]


def main() -> None:
    """Measure, and print a table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--logs", type=int, default=200)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        logs = copies(Path(folder), options.logs)
        print(
            f"{dt.datetime.now(tz=dt.UTC).date()}, {platform.machine()}, {os.cpu_count()} processors, load {os.getloadavg()[0]:.1f}, {len(logs)} logs"
        )
        print(f"{'':24} {'wall s':>8} {'CPU s':>8}  logs/s  result")
        for jobs in (1, 2):
            report(
                f"{jobs} process{'es' if jobs > 1 else ''}",
                *measured(logs, ["--jobs", str(jobs)], []),
                len(logs),
            )
        for count in (1, 2, 4):
            cluster = Cluster(count)
            report(
                f"{count} dask worker{'s' if count > 1 else ''}",
                *measured(logs, ["--cluster", cluster.address], cluster.processes),
                len(logs),
            )
            cluster.end()


def copies(folder: Path, count: int) -> list[str]:
    """Return so many logs: the recorded ones, again and again under other names."""
    known = sorted((ROOT / "sitl_logs").glob("*.tlog"))
    paths = [folder / f"{number:05}-{known[number % len(known)].name}" for number in range(count)]
    for number, path in enumerate(paths):
        shutil.copy(known[number % len(known)], path)
    return list(map(str, paths))


class Cluster:
    """A scheduler and workers of one thread each."""

    def __init__(self, count: int) -> None:
        dask = [sys.executable, "-m", "dask"]
        scheduler = subprocess.Popen(
            [*dask, "scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard"],
            stderr=subprocess.PIPE,
            text=True,
        )
        self.address = next(line.split()[-1] for line in scheduler.stderr or () if "Scheduler at:" in line)
        worker = [*dask, "worker", self.address, "--nthreads", "1", "--no-dashboard", "--no-nanny"]
        self._own = [scheduler, *(subprocess.Popen(worker, stderr=subprocess.DEVNULL) for _ in range(count))]
        self.processes = [psutil.Process(process.pid) for process in self._own]
        with Client(self.address, set_as_default=False) as client:
            client.wait_for_workers(count, timeout=60)

    def end(self) -> None:
        """End them."""
        for process in self._own:
            process.kill()
            process.wait()


def measured(logs: list[str], how: list[str], others: list[psutil.Process]) -> tuple[float, float, str]:
    """Return wall time, CPU time, and a checksum of the result."""
    before_s = cpu_s(others)
    begun_s = time.perf_counter()
    command = [sys.executable, "-m", "mavlink_bridge.cli", "replay", *logs, "--json", *how]
    process = subprocess.Popen(command, stdout=subprocess.PIPE)
    assert process.stdout is not None
    told = process.stdout.read()
    _, _, usage = os.wait4(process.pid, 0)
    wall_s = time.perf_counter() - begun_s
    return (
        wall_s,
        usage.ru_utime + usage.ru_stime + cpu_s(others) - before_s,
        hashlib.sha256(told).hexdigest()[:8],
    )


def cpu_s(processes: list[psutil.Process]) -> float:
    """Return the CPU time that processes have used."""
    return sum(sum(process.cpu_times()[:2]) for process in processes)


def report(name: str, wall_s: float, used_s: float, result: str, count: int) -> None:
    """Print a line."""
    print(f"{name:24} {wall_s:8.1f} {used_s:8.1f}  {count / wall_s:6.1f}  {result}", flush=True)


if __name__ == "__main__":
    main()
