"""Start-up as ratios: help against a typer application of two commands, a plan against the import of its libraries.

``python benchmarks/startup.py [--rounds N]``; the commands of a pair run by turns, and medians are compared. Run it on a quiet machine.
"""

from __future__ import annotations

import argparse
import os
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).parents[1]
TWO_COMMANDS = '''
import typer

app = typer.Typer()


@app.command()
def one(number: int = 1):
    """Do one thing."""


@app.command()
def two(text: str = ""):
    """Do another."""


app()
'''
START, TARGET = "40.071374,-105.229930", "40.0720926,-105.2286152"


def seconds(command: list[str], environment: dict[str, str]) -> float:
    """Return the wall time of a command, which must succeed."""
    begun_s = time.perf_counter()
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, env=environment)
    return time.perf_counter() - begun_s


def medians(commands: dict[str, list[str]], rounds: int, cache: Path) -> dict[str, float]:
    """Run the commands by turns, with byte code as an installation has it; return the median wall time of each, in seconds."""
    environment = {**os.environ, "PYTHONPYCACHEPREFIX": str(cache)}
    environment.pop("PYTHONDONTWRITEBYTECODE", None)
    times: dict[str, list[float]] = {name: [] for name in commands}
    for command in commands.values():
        seconds(command, environment)  # compiles and warms the caches
    for _ in range(rounds):
        for name, command in commands.items():
            times[name].append(seconds(command, environment))
    return {name: statistics.median(taken) for name, taken in times.items()}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=15)
    rounds = parser.parse_args().rounds
    pbpp = [sys.executable, "-c", "from mavlink_bridge.cli import main; main()"]
    with tempfile.TemporaryDirectory() as folder:
        peer = Path(folder) / "two.py"
        peer.write_text(TWO_COMMANDS)
        fence = ROOT / "tests" / "fields" / "yard-fence.waypoints"
        plan = [
            "plan",
            "--fence",
            str(fence),
            "--start",
            START,
            "--target",
            TARGET,
            "-o",
            f"{folder}/m.waypoints",
        ]
        commands = {
            "two-command typer application --help": [sys.executable, str(peer), "--help"],
            "pbpp --help": [*pbpp, "--help"],
            "import numpy, shapely, pyproj": [sys.executable, "-c", "import numpy, shapely, pyproj"],
            "pbpp plan --fence FILE": [*pbpp, *plan],
        }
        found = medians(commands, rounds, Path(folder) / "cache")
    for name, taken_s in found.items():
        print(f"{taken_s:7.3f} s  {name}")
    two, helped, imports, planned = found.values()
    print(f"help {helped / two:.2f} (wanted at most 1.2), plan {planned / imports:.2f} (wanted at most 2.5)")


if __name__ == "__main__":
    main()
