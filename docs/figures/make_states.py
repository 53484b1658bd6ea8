"""Draw the state diagrams of the protocol machines from the tables they run by.

Run ``python docs/figures/make_states.py``; it writes ``docs/figures/states-NAME.svg`` for every table. A row is a state (dark: an end), a
column is an arrow from one state to another, and over it stand the events that take it. A ring is an event that changes nothing.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import matplotlib as mpl
from matplotlib.figure import Figure
from matplotlib.patches import FancyBboxPatch

from mavlink_bridge.protocol.transitions import TABLES

if TYPE_CHECKING:
    from collections.abc import Mapping
    from enum import StrEnum

    from matplotlib.axes import Axes

FOLDER = Path(__file__).parent
INCHES = 0.36
BOX_WIDTH = 4.6
HEAD_ROOM = 6.0
DARK, LIGHT, LINE, GUIDE = "#37474f", "#e3f2fd", "#546e7a", "#cfd8dc"


def main() -> None:
    """Draw all tables."""
    mpl.rcParams.update({"svg.hashsalt": "states", "svg.fonttype": "none", "font.family": "sans-serif"})
    for name, table in TABLES.items():
        draw(table).savefig(FOLDER / f"states-{name.replace('_', '-')}.svg", metadata={"Date": None})


def draw(table: Mapping[StrEnum, Mapping[StrEnum, StrEnum]]) -> Figure:
    """Give the diagram of one table."""
    rows = {state: -number for number, state in enumerate(table)}
    arrows: dict[tuple[StrEnum, StrEnum], list[str]] = {}
    for state, following in table.items():
        for event, to in following.items():
            arrows.setdefault((state, to), []).append(_words(event))
    width, height = BOX_WIDTH + len(arrows) + 4.5, len(rows) + HEAD_ROOM
    figure = Figure(figsize=(width * INCHES, height * INCHES))
    axes = figure.add_axes((0, 0, 1, 1))
    axes.set_axis_off()
    axes.set_xlim(-0.5, width - 0.5)
    axes.set_ylim(-len(rows) + 0.2, HEAD_ROOM + 0.2)
    for state, row in rows.items():
        axes.plot((BOX_WIDTH, BOX_WIDTH + len(arrows)), (row, row), color=GUIDE, linewidth=0.6, zorder=1)
        _box(axes, row, _words(state), is_end=not table[state])
    for lane, ((state, to), events) in enumerate(arrows.items()):
        _arrow(axes, BOX_WIDTH + 0.6 + lane, rows[state], rows[to], events)
    return figure


def _words(member: StrEnum) -> str:
    return member.name.lower().replace("_", " ")


def _box(axes: Axes, row: float, text: str, *, is_end: bool) -> None:
    axes.add_patch(
        FancyBboxPatch(
            (0.0, row - 0.3),
            BOX_WIDTH - 0.3,
            0.6,
            boxstyle="round,pad=0.05",
            facecolor=DARK if is_end else LIGHT,
            edgecolor=DARK,
            linewidth=0.8,
            zorder=3,
        )
    )
    axes.text(
        BOX_WIDTH / 2 - 0.15,
        row,
        text,
        ha="center",
        va="center",
        fontsize=8.5,
        color="white" if is_end else "black",
        zorder=4,
    )


def _arrow(axes: Axes, lane: float, begin: float, end: float, events: list[str]) -> None:
    """Draw one lane: a dot where the arrow begins, its head where it ends, its events over the diagram."""
    axes.text(lane - 0.1, 0.75, ", ".join(events), rotation=50, ha="left", va="bottom", fontsize=7.5)
    axes.plot((lane, lane), (max(begin, end), 0.65), color=GUIDE, linewidth=0.6, zorder=1)
    if begin == end:
        axes.plot(lane, begin, "o", markersize=6, markerfacecolor="white", markeredgecolor=LINE, zorder=3)
        return
    axes.plot(lane, begin, "o", markersize=4, color=LINE, zorder=3)
    axes.annotate(
        "",
        (lane, end),
        (lane, begin),
        arrowprops={"arrowstyle": "-|>", "color": LINE, "linewidth": 1.2, "shrinkA": 0, "shrinkB": 0},
        zorder=2,
    )


if __name__ == "__main__":
    main()
