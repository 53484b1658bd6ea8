"""Compare the planner with its peers: ``python benchmarks/planner/run.py [--maps DIR]``.

(BENCH_SLOW=1 also runs what takes minutes, whose figures are kept with their date else; ``--ratios`` only measures the ratios anew, ``--only PEER ...`` runs a few
planners anew; ``--maps`` adds the maps of a folder, JSON files like the cases in tests/pbpp/data, whose lengths are compared with ours).

Each peer runs in a pinned virtual environment of its own under benchmarks/planner/.venvs, or in a folder of npm's there, made here when it is missing; where
node or npm is missing its peers are left out, with a word. Each pair of planner and case runs in a process of its own, one after the other. Paths are
checked by shapely. Writes benchmarks/results/planner.*.
"""

from __future__ import annotations

import argparse
import datetime as dt
import json
import os
import platform
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from importlib.metadata import version
from pathlib import Path

import numpy as np
import shapely

import pbpp

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
NODE = ("node", "npm")
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


def folder_of(peer: str) -> Path:
    """Return the folder of a peer that runs in node, filling it when it is not as wanted."""
    home = HERE / ".venvs" / peer
    stamp = home / "packages.json"
    wanted = json.loads((HERE / "peers" / "packages.json").read_text())[peer]
    if not stamp.exists() or json.loads(stamp.read_text()) != wanted:
        shutil.rmtree(home, ignore_errors=True)
        home.mkdir(parents=True)
        (home / "package.json").write_text("{}")
        subprocess.run(
            ["npm", "install", "--silent", "--no-audit", "--no-fund", *wanted], check=True, cwd=home
        )
        stamp.write_text(json.dumps(wanted))
    for script in (HERE / "peers" / "node").glob("*.mjs"):
        shutil.copy(script, home)  # node looks for packages beside and above the script
    return home


def with_triangles(case_file: Path, target: Path) -> float:
    """Write a case with the triangles of its free space, as planners over a mesh want it; return what making them took in seconds."""
    case = json.loads(case_file.read_text())
    began = time.process_time()
    blocked = shapely.union_all([shapely.Polygon(ring) for ring in case["exclusions"]])
    free = shapely.difference(shapely.Polygon(case["inclusion"]), blocked)
    made = shapely.get_parts(shapely.constrained_delaunay_triangles(free))
    triangles = shapely.get_coordinates(shapely.orient_polygons(made)).reshape(-1, 4, 2)[:, :3]
    taken_s = time.process_time() - began
    bounds = shapely.Polygon(case["inclusion"]).bounds
    target.write_text(json.dumps({"bounds": bounds, **case, "triangles": triangles.tolist()}))
    return taken_s


def measure(peer: str, name: str, case_file: Path, exact_m: list[float]) -> dict:
    """Return what one planner did on one case; `exact_m` are the lengths of the shortest paths."""
    slow = os.environ.get("BENCH_SLOW") == "1"
    if (peer, name) == SLOW and not slow:
        return kept_slow()
    most = str(FEW_QUERIES.get(peer, 20))
    if peer not in json.loads((HERE / "peers" / "packages.json").read_text()):
        drive = str(HERE / "peers" / "drive.py")
        run = best_of_some(peer, name, [python_of(peer), "-W", "ignore", drive, peer, str(case_file), most])
    elif not all(map(shutil.which, NODE)):
        run = {"failed": f"left out: needs {' and '.join(NODE)}"}
    else:
        with tempfile.TemporaryDirectory() as folder:
            meshed = Path(folder) / "case.json"
            triangles_s = with_triangles(case_file, meshed)
            run = best_of_some(
                peer, name, ["node", str(folder_of(peer) / "drive.mjs"), peer, str(meshed), most]
            )
        if "failed" not in run:
            run["build_s"] += triangles_s
    if "failed" in run:
        return run
    row = judge(run, json.loads(case_file.read_text()), exact_m)
    return {**row, "date": dt.datetime.now(dt.UTC).date().isoformat()} if (peer, name) == SLOW else row


def best_of_some(peer: str, name: str, command: list[str]) -> dict:
    """Return the best of some runs of a planner on a case, or why it failed."""
    limit_s = SLOW_S if (peer, name) == SLOW else LIMIT_S
    best: dict | None = None
    for _ in range(RUNS):
        status, out, err = within(command, limit_s)
        if status is None:
            return {"failed": f"more than {limit_s} s"}
        if status:
            lines = [line for line in err.splitlines() if "Error" in line] or err.split("\n") or ["crash"]
            return {"failed": lines[-1].strip()[:90]}
        run = json.loads(out.strip().splitlines()[-1])
        best = run if best is None or total_s(run) < total_s(best) else best
        if total_s(run) > QUICK_S or peer in FEW_QUERIES:
            break
    return best


def total_s(run: dict) -> float:
    """Return the time of building and of all queries in seconds."""
    return run["build_s"] + sum(run["query_s"])


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


def exact_lengths_m(name: str, case_file: Path) -> list[float]:
    """Return the lengths of a case's shortest paths: those kept with the tests, else ours."""
    kept = json.loads((DATA / "exact.json").read_text())
    if name in kept and case_file.parent == DATA:
        return kept[name]
    case = json.loads(case_file.read_text())
    planner = pbpp.Planner([case["inclusion"]], case["exclusions"])
    return [planner.plan(query[:2], query[2:]).length_m for query in case["queries"]]


def judge(run: dict, case: dict, exact_m: list[float]) -> dict:
    """Add length ratios and the number of paths that cross an obstacle."""
    inside = shapely.buffer(
        shapely.union_all([shapely.Polygon(ring) for ring in case["exclusions"]]), -INSIDE_M
    )
    ratios, invalid = [], 0
    for path, length in zip(run["paths"], exact_m, strict=False):
        if path is not None:
            line = shapely.LineString(path)
            ratios.append(line.length / length)
            invalid += bool(shapely.intersection(line, inside).length > INSIDE_M)
    return {
        "build_ms": 1e3 * run["build_s"],
        "query_ms": 1e3 * statistics.median(run["query_s"]),
        "total_s": total_s(run),
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
        "by more than 1e-6 m. pbpp_compiled has loaded its compiled search before it builds. nav2d and recast_navigation run in node over triangles made by",
        "shapely, whose time is in their build; Recast puts them into cells of 0.25 m (200 m maps) or 0.5 m, without an agent's radius. On maps of `--maps` the",
        "lengths are compared with ours.",
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

    names = CASES[-3:]
    figure, axes = plt.subplots(1, 3, figsize=(12, 4), sharey=True)
    for ax, name in zip(axes, names, strict=True):
        for number, (peer, row) in enumerate(results["cases"][name].items()):
            if "failed" not in row and row["ratio_mean"] is not None:
                ax.plot(
                    row["build_ms"] + row["query_ms"],
                    100 * (row["ratio_mean"] - 1),
                    "ov^sDP*X<>hd8"[number],
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
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--ratios", action="store_true", help="measure the ratios anew and nothing else")
    parser.add_argument(
        "--maps", type=Path, help="a folder of more maps; each of their queries must have a path"
    )
    parser.add_argument(
        "--only", nargs="+", help="run these planners anew; the rows of all others stay as they are"
    )
    asked = parser.parse_args()
    pins = {
        **json.loads((HERE / "peers" / "requirements.json").read_text()),
        **json.loads((HERE / "peers" / "packages.json").read_text()),
    }
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
    if asked.ratios or asked.only:
        kept = json.loads((RESULTS / "planner.json").read_text())
        results = {**kept, "versions": results["versions"]}
    files = {name: DATA / f"{name}.json" for name in CASES}
    files |= {path.stem: path for path in sorted(asked.maps.glob("*.json"))} if asked.maps else {}
    for name, case_file in () if asked.ratios else files.items():
        rows = results["cases"].setdefault(name, {})
        exact_m = exact_lengths_m(name, case_file)
        for peer in asked.only or (*OWN, *pins):
            row = measure(peer, name, case_file, exact_m)
            if asked.only:
                row["date"] = dt.datetime.now(dt.UTC).date().isoformat()
            rows[peer] = row
            print(name, peer, row, flush=True)
    if asked.only:
        ratios = kept["ratios"]
    else:
        command = [sys.executable, str(HERE / "ratios.py")]
        ratios = json.loads(subprocess.run(command, capture_output=True, check=True, text=True).stdout)
    results["load"] = [results["load"][0], os.getloadavg()[2]]
    RESULTS.mkdir(exist_ok=True)
    (RESULTS / "planner.json").write_text(json.dumps({**results, "ratios": ratios}, indent=1) + "\n")
    (RESULTS / "planner.md").write_text(table(results, ratios))
    plot(results, RESULTS / "planner.svg")


if __name__ == "__main__":
    main()
