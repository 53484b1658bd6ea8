"""What the planner costs, as ratios to things measured in the same run: ``python benchmarks/planner/ratios.py`` prints JSON.

Build and query go by the triangulation of the same free space by shapely, the import by that of shapely. Times are the least of some runs.
"""

from __future__ import annotations

import json
import os
import statistics
import subprocess
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import shapely

import pbpp

if TYPE_CHECKING:
    from collections.abc import Callable

DATA = Path(__file__).parents[2] / "tests" / "pbpp" / "data"


def least(function: Callable[[], object], runs: int) -> float:
    """Return the least time of some runs in seconds."""
    times = []
    for _ in range(runs):
        began = time.process_time()
        function()
        times.append(time.process_time() - began)
    return min(times)


def case_times(case: dict, clearance_m: float = 0.0) -> dict:
    """Return the build time, the median query time and the time of the triangulation in milliseconds."""

    def build() -> pbpp.Planner:
        return pbpp.Planner([case["inclusion"]], case["exclusions"], clearance_m=clearance_m)

    planner = build()
    triangles_s = least(lambda: shapely.constrained_delaunay_triangles(planner.free_space), 7)
    build_s = least(build, 7)
    query_s = []
    for query in case["queries"]:
        try:
            planner.plan(query[:2], query[2:])
        except pbpp.PlanningError:
            continue
        query_s.append(least(lambda query=query: planner.plan(query[:2], query[2:]), 4))
    compiled = pbpp.Planner([case["inclusion"]], case["exclusions"], clearance_m=clearance_m, compiled=True)
    compiled_s = []
    for query in case["queries"]:
        try:
            compiled.plan(query[:2], query[2:])
        except pbpp.PlanningError:
            continue
        compiled_s.append(least(lambda query=query: compiled.plan(query[:2], query[2:]), 9))
    return {
        "vertices": int(shapely.get_num_coordinates(planner.free_space)),
        "triangles_ms": 1e3 * triangles_s,
        "build_ms": 1e3 * build_s,
        "query_ms": 1e3 * statistics.median(query_s),
        "build_ratio": build_s / triangles_s,
        "query_ratio": statistics.median(query_s) / triangles_s,
        "compiled_query_ms": 1e3 * statistics.median(compiled_s),
        "compiled_query_ratio": statistics.median(compiled_s) / triangles_s,
    }


def larger(case: dict, factor: float = 3.0) -> dict:
    """Return a map of the same density and about three times the obstacles: four copies side by side, cut to a square."""
    size = case["bounds"][2] * np.sqrt(factor)
    shifts = [np.array([east, north]) * case["bounds"][2] for east in (0, 1) for north in (0, 1)]
    copies = [np.array(ring) + shift for shift in shifts for ring in case["exclusions"]]
    inside = [ring for ring in copies if ring.max() < size]
    blocked = shapely.union_all([shapely.Polygon(ring) for ring in inside])
    free = shapely.difference(shapely.box(0, 0, size, size), blocked)
    queries = []
    for query in case["queries"]:
        ends = np.array(query).reshape(2, 2) * np.sqrt(factor)
        lines = shapely.shortest_line(free, shapely.points(ends))
        queries.append(shapely.get_coordinates(lines)[::2].ravel().tolist())
    square = [[0, 0], [size, 0], [size, size], [0, size]]
    return {"inclusion": square, "exclusions": inside, "queries": queries}


def import_ms(module: str) -> float:
    """Return the least time of some fresh imports in milliseconds."""
    code = f"import time; t = time.process_time(); import {module}; print(time.process_time() - t)"
    # As it is installed: with compiled files, which the first run writes.
    env = {key: value for key, value in os.environ.items() if key != "PYTHONDONTWRITEBYTECODE"}
    times = [
        float(
            subprocess.run(
                [sys.executable, "-c", code], capture_output=True, check=True, text=True, env=env
            ).stdout
        )
        for _ in range(15)
    ]
    return 1e3 * min(times)


def operator_ms() -> float:
    """Return the time from polygons to path on a fence of 200 vertices in milliseconds."""
    rng = np.random.default_rng(1)
    boxes = [pbpp.circle_ring(rng.uniform(10, 190, 2), rng.uniform(2, 8), segments=8) for _ in range(24)]
    square = [(0, 0), (200, 0), (200, 200), (0, 200)]
    return 1e3 * least(lambda: pbpp.plan_path([square], boxes, (1, 1), (199, 199), clearance_m=0.5), 9)


def reuse_ratio(case: dict) -> float:
    """Return the time of adding one obstacle over that of building from scratch."""
    planner = pbpp.Planner([case["inclusion"]], case["exclusions"][:-1], clearance_m=1.0)
    scratch = least(lambda: pbpp.Planner([case["inclusion"]], case["exclusions"], clearance_m=1.0), 5)
    return least(lambda: planner.with_exclusion(case["exclusions"][-1]), 5) / scratch


def compiled_start_s() -> float:
    """Return the CPU time of the first compiled query of a new process in seconds, numba's cache being full."""
    code = (
        "import time, pbpp\n"
        "planner = pbpp.Planner([[(0, 0), (1, 0), (1, 1)]], [], compiled=True)\n"
        "t = time.process_time(); planner.plan((0.5, 0.1), (0.9, 0.5)); print(time.process_time() - t)"
    )
    runs = [
        subprocess.run([sys.executable, "-c", code], capture_output=True, check=True, text=True).stdout
        for _ in range(5)
    ]
    return min(map(float, runs))


def blocks_s(case: dict) -> float:
    """Return the time from polygons to the paper's path in seconds."""
    query = case["queries"][0]
    return least(
        lambda: pbpp.plan_path([case["inclusion"]], case["exclusions"], query[:2], query[2:], method="pbpp"),
        3,
    )


def main() -> None:
    """Print all ratios as JSON."""
    cases = {name: json.loads((DATA / f"{name}.json").read_text()) for name in ("rand100", "rand1000")}
    first, more = case_times(cases["rand1000"]), case_times(larger(cases["rand1000"]))
    shapely_ms, own_ms = import_ms("shapely"), import_ms("pbpp")
    operator = operator_ms()
    result = {
        "rand1000": first,
        "rand1000 at 1 m": case_times(cases["rand1000"], 1.0),
        "three times rand1000": more,
        "growth of build": more["build_ms"] / first["build_ms"],
        "growth of query": more["query_ms"] / first["query_ms"],
        "import of shapely, ms": shapely_ms,
        "import of pbpp, ms": own_ms,
        "import ratio": own_ms / shapely_ms,
        "operator's fence (196 vertices, 0.5 m) from polygons to path, ms": operator,
        "the same over the import of shapely": operator / shapely_ms,
        "adding one obstacle over building anew": reuse_ratio(cases["rand1000"]),
        "first compiled query of a process, s": compiled_start_s(),
        "paper's path on rand100 from polygons, s": blocks_s(cases["rand100"]),
    }
    print(json.dumps(result, indent=1))


if __name__ == "__main__":
    main()
