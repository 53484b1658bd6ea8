"""A transition table as a picture: SVG, the same bytes everywhere.

A row is a state (dark: an end). A column is a cue with the state it leads to: dots where it may come, an arrow's head where it leads, a ring where
nothing changes. Cues that may come in many states stand on the right.
"""

from __future__ import annotations

from dataclasses import dataclass
from html import escape
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Mapping

    Table = Mapping[str, Mapping[str, str]]

_MANY = 5
_ROW, _LANE, _BOX, _HEAD, _EDGE = 26, 21, 112, 128, 10
_GAP, _RING = 24, 6
_DARK, _LIGHT, _LINE, _GUIDE, _SHADE = "#37474f", "#e3f2fd", "#455a64", "#cfd8dc", "#f5f7f8"


@dataclass(frozen=True)
class Lane:
    """A cue, the states in which it may come, and the one it leads to."""

    cue: str
    begins: tuple[str, ...]
    end: str


def lanes(table: Table) -> tuple[list[Lane], list[Lane]]:
    """Return the lanes of cues that may come in few states, and of those that may come in many."""
    begins: dict[tuple[str, str], list[str]] = {}
    for state, row in table.items():
        for cue, after in row.items():
            begins.setdefault((cue, after), []).append(state)
    every = [Lane(str(cue), tuple(states), after) for (cue, after), states in begins.items()]
    return [lane for lane in every if len(lane.begins) < _MANY], [
        lane for lane in every if len(lane.begins) >= _MANY
    ]


def draw(table: Table, title: str) -> str:
    """Return the SVG of a table, states from top to bottom in its order."""
    few, many = lanes(table)
    row_y = {state: _EDGE + _HEAD + _ROW * (number + 0.5) for number, state in enumerate(table)}
    left = _EDGE + _BOX + _LANE
    many_left = left + _LANE * len(few) + (_GAP if many else 0)
    lanes_right = many_left + _LANE * len(many)
    width, height = lanes_right + 76, 2 * _EDGE + _HEAD + _ROW * len(table)
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="{width}" height="{height}" role="img">',
        '<g font-family="sans-serif" font-size="12">',
        f"<title>{escape(title)}</title>",
        f'<rect width="{width}" height="{height}" fill="white"/>',
    ]
    if many:
        edge = many_left - _GAP / 2
        parts.append(
            f'<path d="M{edge:g} {_EDGE + _HEAD}H{lanes_right}v{_ROW * len(table)}H{edge:g}z" fill="{_SHADE}"/>'
        )
    for state, y in row_y.items():
        parts += _state(str(state), y, lanes_right, is_end=not table[state])
    for begin_x, group in ((left, few), (many_left, many)):
        for number, lane in enumerate(group):
            parts += _lane(lane, begin_x + _LANE * (number + 0.5), row_y)
    return "\n".join([*parts, "</g>", "</svg>", ""])


def _state(name: str, y: float, right: float, *, is_end: bool) -> list[str]:
    fill, text = (_DARK, "white") if is_end else (_LIGHT, "black")
    return [
        f'<path d="M{_EDGE + _BOX} {y:g}H{right:g}" stroke="{_GUIDE}"/>',
        f'<rect x="{_EDGE}" y="{y - 10:g}" width="{_BOX}" height="20" rx="4" fill="{fill}" stroke="{_DARK}"/>',
        f'<text x="{_EDGE + _BOX / 2:g}" y="{y + 4:g}" text-anchor="middle" fill="{text}">{escape(name.replace("_", " "))}</text>',
    ]


def _lane(lane: Lane, x: float, row_y: Mapping[str, float]) -> list[str]:
    end_y = row_y[lane.end]
    dots_y = [row_y[state] for state in lane.begins if state != lane.end]
    stays = lane.end in lane.begins
    top_y = min([end_y, *dots_y])
    head_y = _EDGE + _HEAD
    parts = [
        f'<path d="M{x:g} {head_y}V{top_y:g}" stroke="{_GUIDE}"/>',
        f'<text transform="translate({x:g} {head_y - 4}) rotate(-52)">{escape(lane.cue.replace("_", " "))}</text>',
    ]
    for side in (-1, 1):
        far = [y for y in dots_y if (y - end_y) * side > 0]
        if far:
            tip = end_y + side * (_RING if stays else 1)
            begin = max(far) if side > 0 else min(far)
            parts += [
                f'<path d="M{x:g} {begin:g}V{tip + 6 * side:g}" stroke="{_LINE}" stroke-width="1.5"/>',
                f'<path d="M{x:g} {tip:g}l-4 {8 * side}h8z" fill="{_LINE}"/>',
            ]
    parts += [f'<circle cx="{x:g}" cy="{y:g}" r="3.2" fill="{_LINE}"/>' for y in dots_y]
    if stays:
        parts.append(
            f'<circle cx="{x:g}" cy="{end_y:g}" r="{_RING - 1}" fill="white" stroke="{_LINE}" stroke-width="1.5"/>'
        )
    return parts
