"""A dask scheduler and workers on loopback, started as the how-to starts them."""

from __future__ import annotations

import os
import subprocess
import sys
from contextlib import contextmanager
from pathlib import Path

from distributed import Client

_TESTS = Path(__file__).parents[1]
PAGE = _TESTS.parents[1] / "docs" / "how-to" / "cluster.md"


class Cluster:
    """A scheduler's address, and its worker processes."""

    def __init__(self, address: str, folder: Path) -> None:
        self.address = address
        self.workers: list[subprocess.Popen] = []
        self._folder = folder

    def add_worker(self, *, path: Path | None = None) -> subprocess.Popen:
        """Start a worker; ``path`` is looked into for modules before all else."""
        command = [*_line("dask worker", self.address), "--no-nanny", "--local-directory", str(self._folder)]
        self.workers.append(subprocess.Popen(command, env=_environment(path), stderr=subprocess.DEVNULL))
        return self.workers[-1]

    def wait_for(self, count: int) -> None:
        """Wait until so many workers are known."""
        with Client(self.address, set_as_default=False) as client:
            client.wait_for_workers(count, timeout=60)


@contextmanager
def dask_cluster(folder: Path, count: int):
    """Yield a scheduler with so many workers; end them all."""
    command = _line("dask scheduler", "")
    with subprocess.Popen(command, env=_environment(None), stderr=subprocess.PIPE, text=True) as scheduler:
        assert scheduler.stderr is not None
        address = next(line.split()[-1] for line in scheduler.stderr if "Scheduler at:" in line)
        cluster = Cluster(address, folder)
        try:
            for _ in range(count):
                cluster.add_worker()
            cluster.wait_for(count)
            yield cluster
        finally:
            for process in (*cluster.workers, scheduler):
                process.kill()
                process.wait()


def _line(begin: str, address: str) -> list[str]:
    """Return a line of the how-to as this machine runs it: its own address, any free port, one worker a process."""
    line = next(line for line in PAGE.read_text(encoding="utf-8").splitlines() if line.startswith(begin))
    line = line.replace("tcp://192.168.1.10:8786", address).replace("192.168.1.10", "127.0.0.1")
    line = line.replace("--port 8786", "--port 0").replace(" --nworkers auto", "")
    return [sys.executable, "-m", *line.split(), "--no-dashboard"]


def _environment(path: Path | None) -> dict[str, str]:
    paths = [*([str(path)] if path else []), str(_TESTS)]
    return {**os.environ, "PYTHONPATH": os.pathsep.join(paths), "PYTHONWARNINGS": "default"}


def other_version(folder: Path, number: str) -> Path:
    """Return a folder by which a worker takes itself for another version of pbpp-rover."""
    info = folder / f"pbpp_rover-{number}.dist-info"
    info.mkdir(parents=True)
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: pbpp-rover\nVersion: {number}\n")
    return folder
