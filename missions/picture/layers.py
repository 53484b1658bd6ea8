"""What a scene looks like, layer upon layer, each with its sample in the legend."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
import shapely
from shapely import LineString, MultiLineString

from missions.picture import font, style
from missions.picture.drawing import Look, Outlines, Spot, Words
from missions.picture.scene import arrow_place
from missions.picture.sheet import EVEN_PT, area_outlines, hatched, line_outlines
from missions.words import harmless

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from numpy.typing import NDArray
    from shapely.geometry.base import BaseGeometry

    from missions.picture.drawing import Part
    from missions.picture.scene import PictureScene
    from missions.picture.sheet import Sheet

SAMPLE_PT = 18.0
"""How wide a sample in the legend is."""

_SAMPLE_AREA = shapely.box(-SAMPLE_PT / 2, -3.2, SAMPLE_PT / 2, 3.2)
_SAMPLE_LINE = LineString(((-SAMPLE_PT / 2, 0), (SAMPLE_PT / 2, 0)))
_SAMPLE_RADIUS_PT = 4.5  # of a sign in the legend, at most
_HALO = Look(line="#FFFFFF", width_pt=5.0)
_ARROW = np.array([(-0.5, -0.5), (0.0, 0.6), (0.5, -0.5), (0.0, -0.2)]) * (1, -1) * 8.5
"""Upward, in points."""

_SHORT_PT = 19.0  # a leg that is shorter has no arrow
_MOST_ARROWS = 100  # chosen: more cannot be told apart
_CROSS_PT = 4.0  # from the middle of a mark to each side
_BAR_PT = 3.5  # to each side of the line at the ends of the narrowest place
_SIGN_PT = 7.0
_UNDER_PT = 7.0  # a start that is nearer to a target lies under it


@dataclass(frozen=True, eq=False, slots=True)
class Layer:
    """Parts of one meaning: what the legend calls them, with a sample around (0, 0); no label, no place in the legend."""

    parts: tuple[Part, ...]
    label: str = ""
    sample: tuple[Part, ...] = ()


def layers_of(scene: PictureScene, sheet: Sheet) -> Iterator[Layer]:
    """Return what a scene shows, from the lowest layer to the highest."""
    yield from _ground(scene, sheet)
    yield from _route(scene, sheet)
    yield from _tracks(scene, sheet)
    yield from _asked(scene, sheet)
    yield from _ends(scene, sheet)


def _ground(scene: PictureScene, sheet: Sheet) -> Iterator[Layer]:
    if scene.has_inclusion:
        look = Look(fill=style.OUTSIDE)
        yield from _area("outside", sheet.on_page(scene.outside), look, "outside the fence")
    look = Look(style.MARGIN, style.MARGIN_EDGE, 0.6, (2.4, 1.8))
    label = f"clearance, {scene.clearance_m:.4g} m"
    yield from _area("clearance", sheet.on_page(scene.kept_off), look, label)
    if scene.blocks:
        rings = tuple(sheet.points(block) for block in scene.blocks)
        look = Look(line=style.BLOCK, width_pt=0.4)
        sample = area_outlines("block", _SAMPLE_AREA, look)
        yield Layer((Outlines("block", rings, look, is_closed=True),), "block", (sample,))
    look = Look(style.EXCLUSION_FILL, style.EXCLUSION, 1.2)
    yield from _area("exclusion", sheet.on_page(scene.exclusions), look, "exclusion", is_hatched=True)
    if scene.has_inclusion:
        edges = sheet.on_page(scene.inner_edges)
        yield Layer((line_outlines("inner-edge", edges, _dashed(style.INCLUSION, 1.2, ":")),))
        look = Look(line=style.INCLUSION, width_pt=2.2)
        yield from _area("inclusion", sheet.on_page(scene.ground.keep_in), look, "inclusion")


def _route(scene: PictureScene, sheet: Sheet) -> Iterator[Layer]:
    look = Look(style.BAND, style.ROUTE, 0.5, opacity=0.45)
    yield from _area("corridor", sheet.on_page(scene.band), look, "predicted corridor")
    route = sheet.points(scene.route)
    if not len(route):
        return
    width_pt = (
        1.0 if scene.band.is_empty else 1.8
    )  # a mission that was recorded stands behind what was driven
    yield _line("route", [route], Look(line=style.ROUTE, width_pt=width_pt), scene.route_name)
    if scene.unsafe_legs:
        unsafe = [route[leg : leg + 2] for leg in scene.unsafe_legs]
        yield _line("unsafe", unsafe, Look(line=style.UNSAFE, width_pt=2.8), "unsafe leg", halo=_HALO)
    yield Layer(tuple(_arrows(route, scene.unsafe_legs, sheet.points([mark.point for mark in scene.marks]))))
    if scene.narrowest is not None:
        a, b = sheet.points(scene.narrowest.ends)
        look = Look(line="#000000", width_pt=1.0)
        sample = _barred(np.array((-SAMPLE_PT / 2, 0)), np.array((SAMPLE_PT / 2, 0)), look)
        yield Layer((_barred(a, b, look),), "narrowest place", (sample,))
    look = Look("#FFFFFF", style.ROUTE)
    points = sheet.points([point for _, point, _ in scene.waypoints])
    discs = [Spot("waypoint", _pair(point), 2.25, look) for point in points]
    yield Layer(tuple(discs), "waypoint" if discs else "", (Spot("waypoint", (0, 0), 2.25, look),))


def _arrows(
    route: NDArray[np.float64], unsafe: Sequence[int], marks: NDArray[np.float64]
) -> Iterator[Outlines]:
    """Show which way legs are driven."""
    long = [leg for leg, ends in enumerate(pairwise(route)) if math.dist(*ends) >= _SHORT_PT]
    for leg in long[:: 1 + len(long) // _MOST_ARROWS]:
        begin, end = route[leg : leg + 2]
        ahead = (end - begin) / math.dist(begin, end)
        turned = _ARROW @ np.array(((-ahead[1], ahead[0]), -ahead))
        at = arrow_place(begin, end, list(marks), _SHORT_PT / 2)
        look = Look(style.UNSAFE if leg in unsafe else style.ROUTE, "#FFFFFF", 0.5)
        yield Outlines("direction", (at + turned,), look, is_closed=True)


def _barred(a: NDArray[np.float64], b: NDArray[np.float64], look: Look) -> Outlines:
    """Return a line between two points with a bar across each of its ends."""
    ahead = (b - a) / max(math.dist(a, b), 1e-9)
    across = np.array((-ahead[1], ahead[0])) * _BAR_PT
    return Outlines(
        "narrowest",
        tuple(np.array(ends) for ends in ((a, b), (a - across, a + across), (b - across, b + across))),
        look,
    )


def _tracks(scene: PictureScene, sheet: Sheet) -> Iterator[Layer]:
    looks = style.track_looks(track.name for track in scene.tracks)
    order = list(looks)
    drawn: set[str] = set()
    for track in scene.tracks:
        color, dashes = looks[track.name]
        # One drive over another: the first is seen on both sides of the next.
        width_pt = 1.4 + 0.6 * min(3, len(order) - 1 - order.index(track.name))
        label = "" if track.name in drawn else harmless(track.name)
        yield _line("track", [sheet.points(track.points)], _dashed(color, width_pt, dashes), label)
        drawn.add(track.name)
    if scene.marks:
        points = sheet.points([mark.point for mark in scene.marks])
        crosses = [cross for point in points for cross in _cross(point)]
        look = Look(line=style.UNSAFE, width_pt=2.2)
        sample = _lines("mark", _cross(np.zeros(2)), look, _HALO)
        yield Layer(_lines("mark", crosses, look, _HALO), scene.marks_name, sample)


def _asked(scene: PictureScene, sheet: Sheet) -> Iterator[Layer]:
    """Return targets as they were asked for, where the route leads elsewhere, each with a line to where it leads."""
    moved = ~np.isnan(scene.asked).any(axis=1)
    if not moved.any():
        return
    pairs = list(zip(sheet.points(scene.asked[moved]), sheet.points(scene.targets[moved]), strict=True))
    look = Look("#FFFFFF", "#000000")
    lines = _lines("asked", [np.array(pair) for pair in pairs], _dashed("#000000", 1.2, ":"))
    signs = [
        part
        for asked, _ in pairs
        for part in (Spot("asked", _pair(asked), 6.5, look), _sign("asked", "?", asked))
    ]
    yield Layer((*lines, *signs), "target as asked", (Spot("asked", (0, 0), _SAMPLE_RADIUS_PT, look),))


def _ends(scene: PictureScene, sheet: Sheet) -> Iterator[Layer]:
    """Return start and targets, each with its sign; a start that lies under a target is the larger one."""
    targets = sheet.points(scene.targets)
    if scene.start is not None:
        (start,) = sheet.points(scene.start)
        is_under = any(math.dist(target, start) < _UNDER_PT for target in targets)
        look = Look(style.ROUTE, "#000000")
        sign = () if is_under else (_sign("start", "S", start, "#FFFFFF"),)
        sample = _square(np.zeros(2), _SAMPLE_RADIUS_PT, look)
        yield Layer((_square(start, 10.5 if is_under else 6.0, look), *sign), "start", (sample,))
    look = Look(style.TARGET, "#000000")
    parts = [
        part
        for number, target in enumerate(targets)
        for part in (
            Spot("target", _pair(target), 7.0, look),
            _sign("target", scene.target_sign(number), target),
        )
    ]
    if parts:
        yield Layer(tuple(parts), "target", (Spot("target", (0, 0), _SAMPLE_RADIUS_PT, look),))


def _area(
    name: str, area: BaseGeometry, look: Look, label: str, *, is_hatched: bool = False
) -> Iterator[Layer]:
    if area.is_empty:
        return

    def parts(shown: BaseGeometry) -> tuple[Part, ...]:
        hatching = line_outlines(name, hatched(shown), Look(line=look.line)) if is_hatched else None
        return (area_outlines(name, shown, look), *([hatching] if hatching else []))

    yield Layer(parts(area), label, parts(_SAMPLE_AREA))


def _line(
    name: str, lines: Sequence[NDArray[np.float64]], look: Look, label: str, halo: Look | None = None
) -> Layer:
    sample = _lines(name, [np.asarray(_SAMPLE_LINE.coords)], look, halo)
    return Layer(_lines(name, lines, look, halo), label, sample)


def _lines(
    name: str, lines: Sequence[NDArray[np.float64]], look: Look, halo: Look | None = None
) -> tuple[Outlines, ...]:
    """Return lines of which each is seen as far as it has a length, on a halo where they must stand out."""
    whole = MultiLineString([line for line in lines if len(line) > 1]).simplify(EVEN_PT)
    return tuple(line_outlines(name, whole, one) for one in (halo, look) if one is not None)


def _dashed(color: str, width_pt: float, dashes: str) -> Look:
    return Look(
        line=color, width_pt=width_pt, dashes_pt=tuple(part * width_pt for part in style.DASHES[dashes])
    )


def _cross(middle: NDArray[np.float64]) -> list[NDArray[np.float64]]:
    return [middle + np.array(((-1, -turn), (1, turn))) * _CROSS_PT for turn in (1, -1)]


def _square(middle: NDArray[np.float64], half_pt: float, look: Look) -> Outlines:
    corners = np.array(((-1, -1), (1, -1), (1, 1), (-1, 1))) * half_pt
    return Outlines("start", (middle + corners,), look, is_closed=True)


def _sign(name: str, text: str, middle: NDArray[np.float64], color: str = "#000000") -> Words:
    x, y = _pair(middle)
    return Words(name, text, (x, y + font.CAPITALS * _SIGN_PT / 2), _SIGN_PT, is_bold=True, color=color)


def _pair(point: NDArray[np.float64]) -> tuple[float, float]:
    x, y = point.tolist()
    return x, y
