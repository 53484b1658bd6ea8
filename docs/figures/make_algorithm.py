"""Make the pictures of docs/algorithm.md with the planner itself: ``python docs/figures/make_algorithm.py``."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib import pyplot as plt
from matplotlib.collections import LineCollection, PolyCollection

import pbpp
from pbpp.three_cases import crossing_point

BENCHMARKS = Path(__file__).parents[2] / "benchmarks"
sys.path.insert(0, str(BENCHMARKS))

from table1 import grid_a_star, rrt  # noqa: E402 - the paper's peers, which are no package

mpl.use("Agg")
mpl.rcParams["svg.hashsalt"] = "pbpp"

HERE = Path(__file__).parent
SQUARE = [(0, 0), (100, 0), (100, 100), (0, 100)]
BOXES = [[(20, 25), (45, 25), (45, 50), (20, 50)], [(60, 55), (80, 55), (80, 85), (60, 85)]]
SLANTED = [[(20, 30), (45, 20), (55, 45), (30, 60)], [(65, 60), (90, 70), (70, 90)]]
START, GOAL = (10, 10), (92, 94)


def save(figure: plt.Figure, name: str) -> None:
    """Write a figure without its date, so that the same picture is the same file."""
    figure.tight_layout()
    figure.savefig(HERE / f"algorithm-{name}.svg", metadata={"Date": None})
    plt.close(figure)


def partition_picture() -> None:
    """Draw the paper's sets on its own kind of map: V_ob, VL, HL, V_intersect, blocks."""
    path = pbpp.plan_path([SQUARE], BOXES, START, GOAL, method="pbpp")
    blocks = path.drawing.field.blocks
    figure, ax = plt.subplots(figsize=(5, 5))
    path.plot(ax, show_blocks=True)
    ax.lines[0].remove()
    ax.lines[0].remove()
    for collection in list(ax.collections)[1:]:
        collection.remove()
    ax.add_collection(LineCollection(blocks.vertical_lines, color="#2471a3", linewidth=1.0, label="VL"))
    ax.add_collection(LineCollection(blocks.horizontal_lines, color="#1e8449", linewidth=1.0, label="HL"))
    ax.plot(*blocks.obstacle_vertices.T, "ko", markersize=5, label="V_ob")
    ax.plot(*blocks.intersections.T, "o", color="#af601a", markersize=4, label="V_intersect")
    ax.set_title(f"the paper's partition: {len(blocks)} blocks", fontsize=10)
    ax.legend(loc="lower right", fontsize=8)
    save(figure, "partition")


def cases_picture() -> None:
    """Draw the three cases of the hierarchical step."""
    figure, axes = plt.subplots(1, 3, figsize=(9, 3), sharey=True)
    a, b, range_m = (0.0, 0.0), (10.0, 0.0), 1.0
    for ax, goal, title in zip(
        axes,
        [(-4, 6), (14, 6), (4, 6)],
        ["1: A is nearest", "2: B is nearest", "3: Q is nearest"],
        strict=True,
    ):
        here = crossing_point((a, b), goal, range_m)
        ax.plot(*zip(a, b, strict=True), "-", color="#3b4a57", linewidth=2)
        for name, point in (("A", a), ("B", b), ("Gp", goal)):
            ax.plot(*point, "ko")
            ax.annotate(name, point, textcoords="offset points", xytext=(5, 5))
        ax.plot(*zip(here, goal, strict=True), "--", color="#c0392b")
        ax.plot(*here, "o", color="#c0392b")
        ax.set_title(title, fontsize=10)
        ax.set_aspect("equal")
        ax.set_xlim(-6, 17)
        ax.set_ylim(-2, 8)
        ax.axis("off")
    save(figure, "cases")


def sequence_picture() -> None:
    """Draw a sequence of blocks, numbered as in the paper's figure 2."""
    path = pbpp.plan_path([SQUARE], BOXES, START, GOAL, method="pbpp")
    figure, ax = plt.subplots(figsize=(5, 5))
    path.plot(ax)
    centers = path.drawing.field.blocks.centers
    for number, block in enumerate(path.sequence, start=1):
        ax.annotate(str(number), centers[block], ha="center", va="center", fontsize=9)
    ax.set_title(f"the sequence of {len(path.sequence)} blocks, and the path through them", fontsize=10)
    save(figure, "sequence")


def scenarios_picture() -> None:
    """Draw PBPP beside grid A* and RRT on the three scenarios, as in the paper's figures 7 to 9."""
    figure, axes = plt.subplots(1, 3, figsize=(13, 4.8))
    for number, ax in enumerate(axes, start=1):
        case = json.loads((BENCHMARKS / "data" / f"paper_{number}.json").read_text())
        query = case["queries"][0]
        path = pbpp.plan_path([case["inclusion"]], case["exclusions"], query[:2], query[2:], method="pbpp")
        path.plot(ax, show_blocks=False)
        other, (length, points) = ("RRT", rrt(case, 1)) if number == 3 else ("A*", grid_a_star(case))
        ax.plot(*zip(*points, strict=True), ":", color="#6c3483", linewidth=1.8, label=other)
        ax.set_title(f"scenario {number}: PBPP {path.length_m:.0f}, {other} {length:.0f}", fontsize=10)
        ax.legend(loc="lower right", fontsize=8)
    save(figure, "scenarios")


def methods_picture() -> None:
    """Draw the three methods on a map with slanted edges."""
    figure, axes = plt.subplots(1, 3, figsize=(13, 4.6))
    planner = pbpp.Planner([SQUARE], SLANTED)
    for ax, method in zip(axes, ("pbpp", "pbpp-taut", "optimal"), strict=True):
        planner.plan(START, GOAL, method=method).plot(ax)
    save(figure, "methods")


def slanted_picture() -> None:
    """Draw blocks cut by slanted edges, each coloured by its number of corners."""
    path = pbpp.plan_path([SQUARE], SLANTED, START, GOAL, method="pbpp")
    blocks = path.drawing.field.blocks
    outlines = [blocks.outline(block) for block in range(len(blocks))]
    figure, ax = plt.subplots(figsize=(5, 5))
    path.plot(ax, show_blocks=False)
    for artist in [*ax.lines, *ax.collections]:
        artist.remove()
    colours = {3: "#d98880", 4: "#eaf2f8", 5: "#f8c471", 6: "#82e0aa"}
    for corners, colour in colours.items():
        chosen = [one for one in outlines if len(one) == corners]
        if chosen:
            label = f"{corners} corners: {len(chosen)}"
            ax.add_collection(
                PolyCollection(chosen, facecolor=colour, edgecolor="#5d6d7e", linewidth=0.4, label=label)
            )
    ax.legend(loc="lower right", fontsize=8)
    ax.set_title(f"slanted edges: {len(blocks)} convex blocks", fontsize=10)
    save(figure, "slanted")


def widest_picture() -> None:
    """Draw the widest way and its narrowest place."""
    way = pbpp.widest([SQUARE], SLANTED, START, GOAL)
    path = pbpp.plan_path([SQUARE], SLANTED, START, GOAL, clearance_m=way.clearance_m)
    figure, ax = plt.subplots(figsize=(5, 5))
    path.plot(ax, show_blocks=False)
    for ring in SLANTED:
        ax.fill(*np.array(ring).T, color="#3b4a57", alpha=0.5)
    ax.plot(*way.points.T, "k-o", markersize=4, linewidth=1.2)
    ax.set_title(
        f"widest: {way.clearance_m:.2f} m, limited by the {way.limited_by} of {way.gap_m:.2f} m", fontsize=10
    )
    save(figure, "widest")


if __name__ == "__main__":
    for make in (
        partition_picture,
        cases_picture,
        slanted_picture,
        sequence_picture,
        methods_picture,
        widest_picture,
        scenarios_picture,
    ):
        make()
