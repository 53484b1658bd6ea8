"""A scene on its page: title, scale and north above the map, the map with its axes, the legend below."""

from __future__ import annotations

import math
import textwrap
from typing import TYPE_CHECKING

import numpy as np

from missions.picture import font
from missions.picture.drawing import DrawnPage, Look, Outlines, Spot, Words
from missions.picture.labels import names_of
from missions.picture.layers import SAMPLE_PT, layers_of
from missions.picture.sheet import Sheet
from missions.words import harmless

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from missions.picture.drawing import Part
    from missions.picture.layers import Layer
    from missions.picture.scene import PictureScene

_WIDTH_PT = 576.0  # 8 inches, of a page's text
_EDGE_PT = 3.0
_RIGHT_PT = 10.0  # beside the map: half of the last number may lie there
_TALLEST = 1.5  # height to width; what is narrower gets room beside it
_LOWEST_PT = 60.0  # so that the axis's name has room beside the map
_TITLE_PT = 11.0
_TITLE_COLUMNS = 82  # of its font across the page
_TITLE_LINE_PT = 14.4
_ABOVE_PT = 34.0  # between title and map, for scale and north
_NUMBER_PT = 10.0  # axes' numbers and names
_TICK_PT = 3.5
_NAME_GAP_PT = 6.0  # between an axis's numbers and its name
_STEPS = (1.0, 2.0, 2.5, 5.0, 10.0)
_MOST_STEPS = 9  # chosen: more numbers along an axis do not help
_BELOW_PT = 44.0  # between map and legend, for numbers and the axis's name
_LEGEND_PT = 9.0
_LEGEND_LINE_PT = 13.5
_LEGEND_GAP_PT = (7.0, 18.0)  # after a sample, and between columns
_LEGEND_COLUMNS = 4
_BLACK = "#000000"


def scene_drawing(scene: PictureScene) -> DrawnPage:
    """Return the page that shows a scene."""
    title = [part for line in scene.title for part in textwrap.wrap(harmless(line), _TITLE_COLUMNS)]
    west, south, east, north = scene.bounds_m
    top = _EDGE_PT + _TITLE_LINE_PT * len(title) + _ABOVE_PT
    left = _EDGE_PT + _NUMBER_PT + _beside_pt(south, north)
    room_pt = _WIDTH_PT - left - _RIGHT_PT
    shape = (north - south) / (east - west)
    pt_per_m = room_pt * min(1.0, _TALLEST / shape) / (east - west)
    left += (room_pt - pt_per_m * (east - west)) / 2
    aside = max(0.0, _LOWEST_PT - pt_per_m * (north - south)) / 2
    frame = (left, top, left + pt_per_m * (east - west), top + pt_per_m * (north - south))
    sheet = Sheet(west, north, left, top, pt_per_m)
    layers = list(layers_of(scene, sheet))
    key = [layer for layer in layers if layer.label]
    legend_pt = frame[3] + aside + _BELOW_PT
    legend, height_pt = _legend(key, legend_pt)
    return DrawnPage(
        width_pt=_WIDTH_PT,
        height_pt=height_pt,
        title="; ".join(title) or "Map",
        description=_description(scene, key),
        frame=frame,
        inside=(*(part for layer in layers for part in layer.parts), *names_of(scene, sheet)),
        around=(*_titles(title), *_scale(scene, frame), *_axes(scene, sheet, frame), *legend),
    )


def _description(scene: PictureScene, key: Sequence[Layer]) -> str:
    """Return in words what the picture shows, for those who do not see it."""
    zones = ", ".join(harmless(zone.name) for zone, _ in scene.named_zones)
    named = f" Zones with names: {zones}." if zones else ""
    west, south, east, north = scene.bounds_m
    size = f"A map of {east - west:.0f} m by {north - south:.0f} m, north up, with a scale bar of {scene.scale_m()} m."
    return f"{size} It shows: {'; '.join(layer.label for layer in key)}.{named}"


def _titles(lines: Sequence[str]) -> Iterator[Part]:
    for number, line in enumerate(lines):
        baseline_pt = _EDGE_PT + _TITLE_LINE_PT * number + _TITLE_PT
        yield Words("title", line, (_WIDTH_PT / 2, baseline_pt), _TITLE_PT)


def _scale(scene: PictureScene, frame: tuple[float, float, float, float]) -> Iterator[Part]:
    """Return a scale bar and a north arrow above the map's upper corners, clear of the route."""
    left, top, right, _ = frame
    west, _, east, _ = scene.bounds_m
    length_m = scene.scale_m()
    begin = left + 0.01 * (right - left)
    end = begin + length_m / (east - west) * (right - left)
    y = top - 10.0
    yield _stroke("scale-bar", [(begin, y), (end, y)], Look(line=_BLACK, width_pt=3.0))
    yield Words("scale", f"{length_m} m", (end + 5.0, y + font.CAPITALS * 4.5), 9.0, is_centred=False)
    x = left + 0.98 * (right - left)
    yield Words("north", "N", (x, top - 3.0), 9.0)
    yield _stroke("north-arrow", [(x, top - 12.0), (x, top - 25.0)], Look(line=_BLACK, width_pt=1.5))
    head = np.array([(x - 2.5, top - 24.0), (x, top - 30.0), (x + 2.5, top - 24.0)])
    yield Outlines("north-arrow", (head,), Look(fill=_BLACK), is_closed=True)


def _axes(scene: PictureScene, sheet: Sheet, frame: tuple[float, float, float, float]) -> Iterator[Part]:
    """Return the map's frame with numbers and names: east below, north on the left."""
    left, top, right, bottom = frame
    west, south, east, north = scene.bounds_m
    look = Look(line=_BLACK, width_pt=0.8)
    corners = np.array([(left, top), (right, top), (right, bottom), (left, bottom)])
    yield Outlines("frame", (corners,), look, is_closed=True)
    widest_pt = max(
        font.width_pt(label, _NUMBER_PT)
        for label in ("−000", *(label for _, label in _ticks(west, east, _MOST_STEPS)))
    )
    for value, label in _ticks(west, east, int((right - left) / (1.2 * widest_pt))):
        ((x, _),) = sheet.points([np.array((value, south))])
        yield _stroke("tick", [(x, bottom), (x, bottom + _TICK_PT)], look)
        yield Words("east", label, (x, bottom + 2 * _TICK_PT + font.ASCENT * _NUMBER_PT), _NUMBER_PT)
    for value, label in _ticks(south, north, int((bottom - top) / (2 * _NUMBER_PT))):
        ((_, y),) = sheet.points([np.array((west, value))])
        yield _stroke("tick", [(left, y), (left - _TICK_PT, y)], look)
        begin = left - 2 * _TICK_PT - font.width_pt(label, _NUMBER_PT)
        yield Words(
            "north-number", label, (begin, y + font.CAPITALS * _NUMBER_PT / 2), _NUMBER_PT, is_centred=False
        )
    yield Words("axis", "east (m)", ((left + right) / 2, bottom + 30.0), _NUMBER_PT)
    beside = left - _beside_pt(south, north)
    yield Words("axis", "north (m)", (beside, (top + bottom) / 2), _NUMBER_PT, is_upward=True)


def _beside_pt(south: float, north: float) -> float:
    """Return how much room the numbers take up on the left of the map, up to the axis's name."""
    widths_pt = (font.width_pt(label, _NUMBER_PT) for _, label in _ticks(south, north, _MOST_STEPS))
    return max(widths_pt, default=0.0) + 2 * _TICK_PT + _NAME_GAP_PT


def _ticks(low: float, high: float, most: int) -> list[tuple[float, str]]:
    """Return round numbers from one to another with their labels, in at most so many steps."""
    least = (high - low) / max(1, min(most, _MOST_STEPS))
    power = 10.0 ** math.floor(math.log10(least))
    step = next(factor * power for factor in _STEPS if factor * power >= least * (1 - 1e-9))
    decimals = max(
        0, next(digits for digits in range(9) if math.isclose(step * 10**digits, round(step * 10**digits)))
    )
    counts = range(math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9) + 1)
    return [(count * step, f"{count * step:.{decimals}f}".replace("-", "−")) for count in counts]


def _legend(key: Sequence[Layer], top: float) -> tuple[list[Part], float]:
    """Return the legend, in as many columns as have room, and where it ends."""
    for count in range(min(_LEGEND_COLUMNS, max(1, len(key))), 0, -1):
        columns = [list(part) for part in np.array_split(np.arange(len(key)), count)]
        texts_pt = [
            max((font.width_pt(key[at].label, _LEGEND_PT) for at in column), default=0.0)
            for column in columns
        ]
        after_pt, between_pt = _LEGEND_GAP_PT
        width_pt = sum(texts_pt) + count * (SAMPLE_PT + after_pt) + (count - 1) * between_pt
        if width_pt <= _WIDTH_PT - 2 * _EDGE_PT:
            break
    parts: list[Part] = []
    left = max(_EDGE_PT, (_WIDTH_PT - width_pt) / 2)
    for column, text_pt in zip(columns, texts_pt, strict=True):
        for row, at in enumerate(column):
            y = top + _LEGEND_LINE_PT * (row + 0.5)
            parts += [_moved(part, left + SAMPLE_PT / 2, y) for part in key[at].sample]
            baseline = (left + SAMPLE_PT + after_pt, y + font.CAPITALS * _LEGEND_PT / 2)
            parts.append(Words("legend", key[at].label, baseline, _LEGEND_PT, is_centred=False))
        left += SAMPLE_PT + after_pt + text_pt + between_pt
    return parts, top + _LEGEND_LINE_PT * max(map(len, columns)) + _EDGE_PT


def _moved(part: Part, x: float, y: float) -> Part:
    """Return a sample at its place in the legend."""
    if isinstance(part, Outlines):
        return Outlines(
            "sample", tuple(line + np.array((x, y)) for line in part.lines), part.look, part.is_closed
        )
    if isinstance(part, Spot):
        return Spot("sample", (x, y), part.radius_pt, part.look)
    return part


def _stroke(name: str, points: Sequence[tuple[float, float]], look: Look) -> Outlines:
    return Outlines(name, (np.array(points),), look)
