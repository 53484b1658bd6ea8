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
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
import shapely

import pbpp

DATA = Path(__file__).parents[2] / "tests" / "pbpp" / "data"


def least(function: Callable[[], object], runs: int) -> float:
    """Return the least time of some runs in seconds."""
    times = []
    for _ in range(runs):
        began = time.process_time()
        function()
        times.append(time.process_time() - began)
    return min(times)


def case_times(case: dict, clearance_m: float = 0.0, runs: int = 7) -> dict:
    """Return the times of building, of queries and of the triangulation in milliseconds, plain and compiled, and their ratios."""
    fence = [case["inclusion"]], case["exclusions"]

    def build(*, compiled: bool) -> pbpp.Planner:
        return pbpp.Planner(*fence, clearance_m=clearance_m, compiled=compiled)

    plain, compiled = build(compiled=False), build(compiled=True)
    triangles_s = least(lambda: shapely.constrained_delaunay_triangles(plain.free_space), runs)
    times = {
        "build": least(lambda: build(compiled=False), runs),
        "query": median_query_s(plain, case, 4),
        "compiled_build": least(lambda: build(compiled=True), runs),
        "compiled_query": median_query_s(compiled, case, 30),
    }
    # Queries one after the other, none twice: each finds the caches as the one before has left them.
    ends = np.array(reachable(compiled, case)).reshape(-1, 2, 2)
    starts, goals = ends[:, 0], ends[:, 1]
    pairs = [(start, goal) for start in starts.tolist() for goal in goals.tolist()]
    times["compiled_alone"] = least(lambda: [compiled.plan(*pair) for pair in pairs], 3) / len(pairs)
    times["compiled_in_matrix"] = least(lambda: compiled.lengths(starts, goals), 3) / len(pairs)
    result = {
        "vertices": int(shapely.get_num_coordinates(plain.free_space)),
        "triangles_ms": 1e3 * triangles_s,
    }
    for name, time_s in times.items():
        result |= {f"{name}_ms": 1e3 * time_s, f"{name}_ratio": time_s / triangles_s}
    return result


def reachable(planner: pbpp.Planner, case: dict) -> list[list[float]]:
    """Return the queries of a case that have a path."""
    return [
        query for query in case["queries"] if np.isfinite(planner.lengths([query[:2]], [query[2:]])[0, 0])
    ]


def median_query_s(planner: pbpp.Planner, case: dict, runs: int) -> float:
    """Return the median over the queries of the least time of some runs in seconds."""
    return statistics.median(
        least(lambda query=query: planner.plan(query[:2], query[2:]), runs)
        for query in reachable(planner, case)
    )


def town(blocks: int) -> dict:
    """Return blocks of houses with common walls between the same points, as OpenStreetMap has them, some with courts."""
    rng = np.random.default_rng(1)
    turn = np.array([[np.cos(0.3), np.sin(0.3)], [-np.sin(0.3), np.cos(0.3)]])
    houses = []
    for corner in np.indices((blocks, blocks)).reshape(2, -1).T * 100.0:
        places = np.stack(np.meshgrid(np.arange(7.0), np.arange(7.0), indexing="ij"), axis=-1) * 14.0
        places = (places + corner + rng.uniform(-2.0, 2.0, places.shape)) @ turn
        houses += [
            places[[i, i + 1, i + 1, i], [j, j, j + 1, j + 1]]
            for i in range(6)
            for j in range(6)
            if (i in {0, 5} or j in {0, 5}) and rng.random() < 0.92
        ]
    size = 100.0 * blocks
    square = np.array([[-50.0, -50.0], [size, -50.0], [size, size], [-50.0, size]]) @ turn
    ends = (rng.integers(0, blocks, (20, 2, 2)) * 100.0 - 7.0) @ turn
    return {"inclusion": square, "exclusions": houses, "queries": ends.reshape(-1, 4).tolist()}


def larger(case: dict, factor: float = 3.0) -> dict:
    """Return a map of the same density and so many times the obstacles: copies side by side, cut to a square."""
    size = case["bounds"][2] * np.sqrt(factor)
    copies = range(int(np.ceil(np.sqrt(factor))))
    shifts = [np.array([east, north]) * case["bounds"][2] for east in copies for north in copies]
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


def change_ratios(case: dict, clearance_m: float, *, compiled: bool) -> dict:
    """Return the times of adding and of removing one obstacle over that of building from scratch: the median of some obstacles."""

    def build() -> pbpp.Planner:
        return pbpp.Planner(
            [case["inclusion"]], case["exclusions"], clearance_m=clearance_m, compiled=compiled
        )

    planner, scratch_s = build(), least(build, 5)
    times_s: dict[str, list[float]] = {"adding": [], "removing": []}
    for index in range(50, len(case["exclusions"]), 100):
        fewer = planner.without_exclusion(index)
        add, remove = (
            partial(fewer.with_exclusion, case["exclusions"][index]),
            partial(planner.without_exclusion, index),
        )
        for kind, change in (("adding", add), ("removing", remove)):
            change()  # the first change of a planner looks for all of its holes
            times_s[kind].append(least(change, 5))
    return {kind: statistics.median(found_s) / scratch_s for kind, found_s in times_s.items()}


def compiled_start_s() -> float:
    """Return the CPU time of the first compiled planner and its query in a new process in seconds, numba's cache being full."""
    code = (
        "import time, pbpp; t = time.process_time()\n"
        "planner = pbpp.Planner([[(0, 0), (1, 0), (1, 1)]], [], compiled=True)\n"
        "planner.plan((0.5, 0.1), (0.9, 0.5)); print(time.process_time() - t)"
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
        "nine times rand1000": case_times(larger(cases["rand1000"], 9.0), runs=3),
        "town of touching houses": case_times(town(7)),
        "large town": case_times(town(22), runs=3),
        "growth of build": more["build_ms"] / first["build_ms"],
        "growth of query": more["query_ms"] / first["query_ms"],
        "import of shapely, ms": shapely_ms,
        "import of pbpp, ms": own_ms,
        "import ratio": own_ms / shapely_ms,
        "operator's fence (196 vertices, 0.5 m) from polygons to path, ms": operator,
        "the same over the import of shapely": operator / shapely_ms,
        "one obstacle over building anew": change_ratios(cases["rand1000"], 0.0, compiled=False),
        "the same at 1 m": change_ratios(cases["rand1000"], 1.0, compiled=False),
        "the same, compiled": change_ratios(cases["rand1000"], 0.0, compiled=True),
        "the same, compiled, at 1 m": change_ratios(cases["rand1000"], 1.0, compiled=True),
        "first compiled query of a process, s": compiled_start_s(),
        "paper's path on rand100 from polygons, s": blocks_s(cases["rand100"]),
    }
    print(json.dumps(result, indent=1))


if __name__ == "__main__":
    main()
