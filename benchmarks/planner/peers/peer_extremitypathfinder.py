# ruff: noqa: ANN001, ANN201, ANN202
"""extremitypathfinder: an optimised visibility graph."""

import numpy as np
from extremitypathfinder import PolygonEnvironment


def _turned(ring, *, counter_clockwise):
    x, y = np.array(ring, dtype=float).T
    area = np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y)
    return ring if (area > 0) == counter_clockwise else ring[::-1]


def build(case):
    environment = PolygonEnvironment()
    environment.store(
        _turned(case["inclusion"], counter_clockwise=True),
        [_turned(ring, counter_clockwise=False) for ring in case["exclusions"]],
        validate=False,
    )
    environment.prepare()
    return environment


def query(environment, start, goal):
    path, _ = environment.find_shortest_path(start, goal, verify=False)
    return path or None
