"""Compare the planner with its peers: ``python benchmarks/planner/run.py``.

(BENCH_SLOW=1 also runs what takes minutes, whose figures are kept with their date else; ``--ratios`` only measures the ratios anew).

Each peer runs in a pinned virtual environment of its own under benchmarks/planner/.venvs, made here when it is missing; each pair of
planner and case runs in a process of its own, one after the other. Paths are checked by shapely. Writes benchmarks/results/planner.*.
"""

from __future__ import annotations

import datetime as dt
import json
import os
import platform
import statistics
import subprocess
import sys
from importlib.metadata import version
from pathlib import Path

import numpy as np
import shapely

HERE = Path(__file__).parent
DATA = HERE.parents[1] / "tests" / "pbpp" / "data"
RESULTS = HERE.parent / "results"
CASES = ("table1_1", "table1_2", "table1_3", "rand10", "rand100", "rand1000")
OWN = ("pbpp", "pbpp_compiled", "pbpp_blocks", "pbpp_taut_blocks")
LIMIT_S = 60
SLOW = ("extremitypathfinder", "rand1000")
SLOW_S = 3000
RUNS = 3
QUICK_S = 5
FEW_QUERIES = {"ompl": 4, "pathplanning": 8}
INSIDE_M = 1e-6


def python_of(peer: str) -> str:
    """Return the interpreter of a peer's environment, making the environment when it is missing."""
    if peer in OWN:
        return sys.executable
    home = HERE / ".venvs" / peer
    stamp = home / "requirements.json"
    wanted = json.loads((HERE / "peers" / "requirements.json").read_text())[peer]
    if not stamp.exists() or json.loads(stamp.read_text()) != wanted:
        base = os.environ.get("PEER_PYTHON", "python3.11")
        subprocess.run([base, "-m", "venv", "--clear", str(home)], check=True)
        subprocess.run(
            [str(home / "bin" / "pip"), "-q", "install", "--disable-pip-version-check", *wanted], check=True
        )
        stamp.write_text(json.dumps(wanted))
    return str(home / "bin" / "python")


def measure(peer: str, name: str) -> dict:
    """Return what one planner did on one case."""
    slow = os.environ.get("BENCH_SLOW") == "1"
    if (peer, name) == SLOW and not slow:
        return kept_slow()
    case_file = DATA / f"{name}.json"
    command = [
        python_of(peer),
        "-W",
        "ignore",
        str(HERE / "peers" / "drive.py"),
        peer,
        str(case_file),
        str(FEW_QUERIES.get(peer, 20)),
    ]
    limit_s = SLOW_S if (peer, name) == SLOW else LIMIT_S
    best: dict | None = None
    for _ in range(RUNS):
        status, out, err = within(command, limit_s)
        if status is None:
            return {"failed": f"more than {limit_s} s"}
        if status:
            return {"failed": (err.strip().splitlines() or ["crash"])[-1][:90]}
        row = judge(json.loads(out.strip().splitlines()[-1]), name)
        best = row if best is None or row["total_s"] < best["total_s"] else best
        if row["total_s"] > QUICK_S or peer in FEW_QUERIES:
            break
    if (peer, name) == SLOW:
        best["date"] = dt.datetime.now(dt.UTC).date().isoformat()
    return best


def within(command: list[str], limit_s: float) -> tuple[int | None, str, str]:
    """Run a command; return its status, None if it took more than so many seconds of the CPU, with what it printed."""
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    while True:
        try:
            out, err = process.communicate(timeout=1.0)
        except subprocess.TimeoutExpired:
            # A resource limit would coarsen the clock that the process measures itself with.
            user, system = Path(f"/proc/{process.pid}/stat").read_text().rpartition(")")[2].split()[11:13]
            if (int(user) + int(system)) / os.sysconf("SC_CLK_TCK") > limit_s:
                process.kill()
                process.communicate()
                return None, "", ""
        else:
            return process.returncode, out, err


def kept_slow() -> dict:
    """Return what the slow run gave when it was run last."""
    row = json.loads((RESULTS / "planner.json").read_text())["cases"][SLOW[1]][SLOW[0]]
    return row if "date" in row else {"failed": "needs minutes: BENCH_SLOW=1"}


def judge(run: dict, name: str) -> dict:
    """Add length ratios and the number of paths that cross an obstacle."""
    case = json.loads((DATA / f"{name}.json").read_text())
    exact = json.loads((DATA / "exact.json").read_text())[name]
    inside = shapely.buffer(
        shapely.union_all([shapely.Polygon(ring) for ring in case["exclusions"]]), -INSIDE_M
    )
    ratios, invalid = [], 0
    for path, length in zip(run["paths"], exact, strict=False):
        if path is not None:
            line = shapely.LineString(path)
            ratios.append(line.length / length)
            invalid += bool(shapely.intersection(line, inside).length > INSIDE_M)
    return {
        "build_ms": 1e3 * run["build_s"],
        "query_ms": 1e3 * statistics.median(run["query_s"]),
        "total_s": run["build_s"] + sum(run["query_s"]),
        "queries": len(run["query_s"]),
        "failures": run["paths"].count(None),
        "invalid": invalid,
        "ratio_mean": float(np.mean(ratios)) if ratios else None,
        "ratio_max": float(np.max(ratios)) if ratios else None,
        "memory_mb": run["memory_mb"],
    }


def table(results: dict, ratios: dict) -> str:
    """Return the results as Markdown."""
    lines = [
        "# Planners compared",
        "",
        (
            f"{results['date']}, {results['machine']}; load average over 15 minutes {results['load'][0]:.1f} at the start, "
            f"{results['load'][1]:.1f} at the end. Made by `benchmarks/planner/run.py`."
        ),
        "",
    ]
    lines += [
        "Versions: "
        + "; ".join(f"{peer}: {', '.join(pins)}" for peer, pins in results["versions"].items())
        + ".",
        "",
    ]
    lines += [
        "One process for each planner and case, build then queries one after the other, the best of three where it takes under 5 s; times are",
        "CPU times. Grids have cells of 1 m (200 m maps) or 2 m; OMPL is BIT* with one second a query. An invalid path runs through an obstacle",
        "by more than 1e-6 m. pbpp_compiled has loaded its compiled search before it builds.",
        "",
    ]
    for name, rows in results["cases"].items():
        lines += [
            f"## {name}",
            "",
            "| planner | build ms | query median ms | queries | failed | invalid | length ratio mean / max | peak MB over imports |",
            "|---|--:|--:|--:|--:|--:|--:|--:|",
        ]
        for peer, row in rows.items():
            if "failed" in row:
                lines.append(f"| {peer} | {row['failed']} | | | | | | |")
            else:
                ratio = (
                    "-" if row["ratio_mean"] is None else f"{row['ratio_mean']:.4f} / {row['ratio_max']:.4f}"
                )
                lines.append(
                    f"| {peer}{' (' + row['date'] + ')' if 'date' in row else ''} | {row['build_ms']:.1f} | {row['query_ms']:.2f} | {row['queries']} | {row['failures']} | {row['invalid']} | {ratio} | {row['memory_mb']:.0f} |"
                )
        lines.append("")
    lines += [
        "## Ratios",
        "",
        "By `benchmarks/planner/ratios.py` in the same run; build and query over `shapely.constrained_delaunay_triangles` of the same free space.",
        "",
    ]
    for key, value in ratios.items():
        text = (
            ", ".join(f"{k} {v:.4g}" for k, v in value.items()) if isinstance(value, dict) else f"{value:.3g}"
        )
        lines.append(f"- {key}: {text}")
    for name, own, peer in speedups(results):
        lines.append(
            f"- build and 20 queries on {name}: {peer / own:.0f} times as fast as extremitypathfinder"
        )
    return "\n".join(lines) + "\n"


def speedups(results: dict) -> list[tuple[str, float, float]]:
    """Return where extremitypathfinder ran too: case, our seconds, its seconds."""
    found = []
    for name, rows in results["cases"].items():
        own, peer = rows["pbpp"], rows["extremitypathfinder"]
        if name.startswith("rand") and "failed" not in peer:
            found.append((name, own["total_s"], peer["total_s"]))
    return found


def plot(results: dict, target: Path) -> None:
    """Draw length ratio against time for build and one query."""
    import matplotlib as mpl  # noqa: PLC0415 - only for the picture

    mpl.use("Agg")
    from matplotlib import pyplot as plt  # noqa: PLC0415

    names = ("rand10", "rand100", "rand1000")
    figure, axes = plt.subplots(1, 3, figsize=(12, 4), sharey=True)
    for ax, name in zip(axes, names, strict=True):
        for number, (peer, row) in enumerate(results["cases"][name].items()):
            if "failed" not in row and row["ratio_mean"] is not None:
                ax.plot(
                    row["build_ms"] + row["query_ms"],
                    100 * (row["ratio_mean"] - 1),
                    "ov^sDP*X<>h"[number],
                    label=peer,
                    markersize=8,
                )
        ax.set_xscale("log")
        ax.set_yscale("symlog", linthresh=0.1)
        ax.set_title(name)
        ax.set_xlabel("build and one query, ms")
        ax.grid(alpha=0.3)
    axes[0].set_ylabel("longer than the shortest, %")
    axes[-1].legend(fontsize=7)
    figure.tight_layout()
    figure.savefig(target)


def main() -> None:
    """Run everything and write the results."""
    pins = json.loads((HERE / "peers" / "requirements.json").read_text())
    results = {
        "date": dt.datetime.now(dt.UTC).date().isoformat(),
        "machine": f"{platform.machine()}, {os.cpu_count()} cores, Python {platform.python_version()}",
        "versions": {
            "pbpp": [
                f"numpy=={np.__version__}",
                f"shapely=={shapely.__version__}",
                f"numba=={version('numba')}",
                f"GEOS=={shapely.geos_version_string}",
            ],
            **pins,
        },
        "load": [os.getloadavg()[2]],
        "cases": {},
    }
    if "--ratios" in sys.argv:
        results = json.loads((RESULTS / "planner.json").read_text())
    for name in () if "--ratios" in sys.argv else CASES:
        results["cases"][name] = {}
        for peer in (*OWN, *pins):
            row = measure(peer, name)
            results["cases"][name][peer] = row
            print(name, peer, row, flush=True)
    ratios = json.loads(
        subprocess.run(
            [sys.executable, str(HERE / "ratios.py")], capture_output=True, check=True, text=True
        ).stdout
    )
    results["load"] = [results["load"][0], os.getloadavg()[2]]
    RESULTS.mkdir(exist_ok=True)
    (RESULTS / "planner.json").write_text(json.dumps({**results, "ratios": ratios}, indent=1) + "\n")
    (RESULTS / "planner.md").write_text(table(results, ratios))
    plot(results, RESULTS / "planner.svg")


if __name__ == "__main__":
    main()
