# ruff: noqa: ANN001, ANN201
"""This project's planner, method="optimal"."""

import pbpp


def build(case):
    return pbpp.Planner([case["inclusion"]], case["exclusions"])


def query(planner, start, goal):
    try:
        return planner.plan(start, goal).points
    except pbpp.NoPathError:
        return None
