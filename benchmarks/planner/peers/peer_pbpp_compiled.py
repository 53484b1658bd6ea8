# ruff: noqa: ANN001, ANN201
"""This project's planner with its compiled search (extra ``fast``); loading or compiling it counts as import, not as build."""

import pbpp

SQUARE = [(0, 0), (1, 0), (1, 1), (0, 1)]
pbpp.Planner([SQUARE], [], compiled=True).plan((0.1, 0.1), (0.9, 0.9))


def build(case):
    return pbpp.Planner([case["inclusion"]], case["exclusions"], compiled=True)


def query(planner, start, goal):
    try:
        return planner.plan(start, goal).points
    except pbpp.NoPathError:
        return None
