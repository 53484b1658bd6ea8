"""Draw what build and query cost over the number of vertices: ``python benchmarks/planner/growth.py [--maps DIR]``.

The maps are rand100, rand1000 and copies of the latter side by side, up to 100,000 vertices; with ``--maps`` also those of a folder, JSON files like the
cases in tests/pbpp/data. Beside ours stands shapely's constrained triangulation of the same free space, with which a search over triangles would begin.
Writes benchmarks/results/growth.*.
"""

from __future__ import annotations

import argparse
import datetime as dt
import json
import os
from pathlib import Path

import matplotlib as mpl
from ratios import DATA, case_times, larger

mpl.use("Agg")

from matplotlib import pyplot as plt

RESULTS = Path(__file__).parents[1] / "results"
FACTORS = (1.0, 3.0, 6.0, 14.4)
LINES = {
    "triangles_ms": "shapely's triangulation",
    "build_ms": "build",
    "compiled_build_ms": "build, compiled",
    "query_ms": "query",
    "compiled_query_ms": "query, compiled",
}


def main() -> None:
    """Measure, write and draw."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--maps", type=Path)
    maps = parser.parse_args().maps
    cases = {name: json.loads((DATA / f"{name}.json").read_text()) for name in ("rand100", "rand1000")}
    cases |= {f"{factor:g} x rand1000": larger(cases["rand1000"], factor) for factor in FACTORS[1:]}
    if maps is not None:
        cases |= {path.stem: json.loads(path.read_text()) for path in sorted(maps.glob("*.json"))}
    rows = {name: case_times(case, runs=3) for name, case in cases.items()}
    results = {
        "date": dt.datetime.now(dt.UTC).date().isoformat(),
        "load": os.getloadavg()[2],
        "cases": rows,
    }
    (RESULTS / "growth.json").write_text(json.dumps(results, indent=1) + "\n")
    figure, ax = plt.subplots(figsize=(7, 4.5))
    for key, label in LINES.items():
        ordered = sorted(rows.values(), key=lambda row: row["vertices"])
        ax.plot([row["vertices"] for row in ordered], [row[key] for row in ordered], "o-", label=label)
    ax.set(xscale="log", yscale="log", xlabel="vertices of free space", ylabel="CPU time, ms")
    ax.grid(alpha=0.3)
    ax.legend()
    figure.tight_layout()
    figure.savefig(RESULTS / "growth.svg")


if __name__ == "__main__":
    main()
