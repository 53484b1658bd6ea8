"""Names and numbers in a picture, where there is room: off the lines, off the edges, off each other, one style for all."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import shapely
from shapely import LineString, Point, Polygon, affinity

from missions.fence import OBSTACLE
from missions.picture import font
from missions.picture.drawing import Look, Words
from missions.picture.scene import polygons
from missions.picture.sheet import area_outlines
from missions.words import harmless

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from shapely.geometry.base import BaseGeometry

    from missions.picture.drawing import Part
    from missions.picture.scene import PictureScene
    from missions.picture.sheet import Sheet

_SIZE_PT = 8.0
_GAP_PT = 1.5  # around a name
_PAD_PT = 1.0  # of white around it
_MARKER_PT = 8.5  # kept free around start, targets and marks
_WAYPOINT_PT = 3.0  # around a waypoint
_MOST_NAMES = 100  # of one kind; chosen: more cannot be read
_BEHIND = Look(fill="#FFFFFF", opacity=0.85)
_SIDES = tuple((math.sin(turn), math.cos(turn)) for turn in np.array((2, 6, 4, 0, 1, 3, 5, 7)) * math.pi / 4)
"""Directions from a place to its name: straight beside it before over a corner."""


def names_of(scene: PictureScene, sheet: Sheet) -> tuple[Part, ...]:
    """Return the narrowest place's width, the marks' names, the waypoints' numbers and the zones' names, each where there is room."""
    room = _Room(scene, sheet)
    if scene.narrowest is not None:
        middle = sheet.on_page(Point(scene.narrowest.ends.mean(axis=0)))
        room.beside(middle, f"{scene.narrowest.width_m:.1f} m", "width", (5.0, 12.0, 22.0, 38.0))
    for mark in scene.marks[:_MOST_NAMES]:
        if mark.name:
            room.beside(sheet.on_page(Point(mark.point)), harmless(mark.name), "mark", (5.0, 12.0))
    waypoints = list(
        {tuple(point): (number, point) for number, point, _ in reversed(scene.waypoints)}.values()
    )
    for number, point in reversed(waypoints[:: 1 + len(waypoints) // _MOST_NAMES]):
        room.beside(sheet.on_page(Point(point)), str(number), "number", (_WAYPOINT_PT, _MARKER_PT))
    fences = sheet.on_page(shapely.union_all([scene.exclusions, scene.ground.edge, scene.inner_edges]))
    zones = sorted(scene.named_zones, key=lambda named: -named[1].area)
    for zone, seen_m in zones[:_MOST_NAMES]:
        name = (
            OBSTACLE if zone.name.startswith(OBSTACLE) else harmless(zone.name)
        )  # who reported it, and when, takes too much room
        in_two_lines = name.replace(" ", "\n", 1)
        seen = sheet.on_page(seen_m)
        is_inside = any(room.inside(seen, words) for words in (in_two_lines, name))
        if not is_inside and zone.area.within(scene.frame):
            room.beside(seen, in_two_lines, "zone", (_GAP_PT, 7.0, 15.0), fences)
    return tuple(room.names)


class _Room:
    """A map's room for names, on the page: what is taken, and by what.

    Parameters
    ----------
    scene : PictureScene
        What is shown.
    sheet : Sheet
        Where it lies.
    """

    def __init__(self, scene: PictureScene, sheet: Sheet) -> None:
        self._frame = sheet.on_page(scene.frame)
        self._lines = shapely.STRtree([*_lines_of(scene, sheet), sheet.on_page(scene.band)])
        self._boxes: list[Polygon] = []
        self.names: list[Part] = []

    def beside(
        self,
        shape: BaseGeometry,
        words: str,
        name: str,
        away_pt: Iterable[float],
        off: BaseGeometry | None = None,
    ) -> None:
        """Put a name beside a shape, where there is room near by, and not on what it is to stay off."""
        size = _size(words)
        left, top, right, bottom = shape.bounds
        middle = np.array((left + right, top + bottom)) / 2
        half = (np.array((right - left, bottom - top)) + size) / 2
        for away in away_pt:
            for side in np.array(_SIDES) * (1, -1):  # the page's y runs down
                place = Point(middle + side * away + np.sign(np.round(side, 6)) * half)
                box = _box(place, *size)
                if self._is_free(box) and not (off is not None and box.intersects(off)):
                    self._put(words, name, place, box)
                    return

    def inside(self, area: BaseGeometry, words: str) -> bool:
        """Put a zone's name into it, if there is room."""
        size = _size(words)
        near = self._lines.geometries.take(self._lines.query(area))
        free = area.buffer(-_GAP_PT).difference(shapely.union_all([*near, *self._boxes]))
        middle = _place(free, *size)
        if middle is not None:
            self._put(words, "zone", middle, _box(middle, *size))
        return middle is not None

    def _is_free(self, box: Polygon) -> bool:
        is_covered = len(self._lines.query(box, "intersects")) or any(map(box.intersects, self._boxes))
        return bool(self._frame.covers(box)) and not is_covered

    def _put(self, words: str, name: str, middle: Point, box: Polygon) -> None:
        self._boxes.append(box)
        self.names.append(area_outlines("behind", box.buffer(_PAD_PT - _GAP_PT, join_style="mitre"), _BEHIND))
        lines = words.split("\n")
        top_pt = middle.y - _size(words)[1] / 2 + _GAP_PT
        for number, line in enumerate(lines):
            baseline_pt = top_pt + _SIZE_PT * (font.ASCENT + number * font.LINE)
            self.names.append(Words(name, line, (middle.x, baseline_pt), _SIZE_PT))


def _size(words: str) -> tuple[float, float]:
    """Return how much room words take up, with a gap around."""
    lines = words.split("\n")
    width_pt = max(font.width_pt(line, _SIZE_PT) for line in lines)
    height_pt = _SIZE_PT * (font.ASCENT + font.DESCENT + font.LINE * (len(lines) - 1))
    return width_pt + 2 * _GAP_PT, height_pt + 2 * _GAP_PT


def _lines_of(scene: PictureScene, sheet: Sheet) -> Iterator[BaseGeometry]:
    """Return the ground that lines and markers take up."""
    tracks = [LineString(track.points) for track in scene.tracks if len(track.points) > 1]
    narrow = [LineString(scene.narrowest.ends)] if scene.narrowest is not None else []
    yield from (sheet.on_page(line).buffer(1.0) for line in (*scene.legs, *tracks, *narrow))
    yield from (Point(point).buffer(0.9 * _WAYPOINT_PT) for point in sheet.points(scene.route))
    starts = [] if scene.start is None else [scene.start]
    marks = [mark.point for mark in scene.marks]
    moved = scene.asked[~np.isnan(scene.asked).any(axis=1)]
    for point in sheet.points([*starts, *scene.targets, *moved, *marks]):
        yield Point(point).buffer(0.8 * _MARKER_PT)


def _place(free: BaseGeometry, width_pt: float, height_pt: float) -> Point | None:
    """Find a place for a box: the middle, else where the widest circle fits in once the ground is squeezed as the box is flat."""
    squeeze = height_pt / width_pt
    for part in sorted(polygons(free), key=lambda polygon: -polygon.area):
        squeezed = affinity.scale(part, squeeze, 1.0, origin=(0, 0))
        radius = shapely.maximum_inscribed_circle(squeezed, tolerance=height_pt / 8)
        x, y = radius.coords[0]
        for place in (part.centroid, Point(x / squeeze, y)):
            if part.covers(_box(place, width_pt, height_pt)):
                return place
    return None


def _box(middle: Point, width_pt: float, height_pt: float) -> Polygon:
    return shapely.box(
        middle.x - width_pt / 2, middle.y - height_pt / 2, middle.x + width_pt / 2, middle.y + height_pt / 2
    )
