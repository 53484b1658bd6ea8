# ruff: noqa: ANN001, ANN201
"""This project's planner, method="pbpp-taut" over the paper's blocks."""

import pbpp


def build(case):
    planner = pbpp.Planner([case["inclusion"]], case["exclusions"])
    query(planner, *(case["queries"][0][i : i + 2] for i in (0, 2)))  # the blocks are made by the first query
    return planner


def query(planner, start, goal):
    try:
        return planner.plan(start, goal, method="pbpp-taut").points
    except pbpp.NoPathError:
        return None
