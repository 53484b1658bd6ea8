"""Names and numbers in an image, where there is room: off the lines, off the edges, off each other, one style for all."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
import shapely
from shapely import LineString, Point, Polygon, affinity

from missions.fence import OBSTACLE
from missions.picture.scene import polygons
from missions.words import harmless

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from shapely.geometry.base import BaseGeometry

    from missions.picture.scene import PictureScene

_FONT_SIZE = 8  # points
_GAP_PX = 3.0  # around a name
_MARKER_PX = 18.0  # radius kept free around start, targets and marks
_WAYPOINT_PX = 6.0  # around a waypoint
_MOST_NAMES = 100  # of one kind; chosen: more cannot be read
_BOX = {"facecolor": "white", "edgecolor": "none", "alpha": 0.85, "pad": 1.0}
_SIDES = tuple((math.sin(turn), math.cos(turn)) for turn in np.array((2, 6, 4, 0, 1, 3, 5, 7)) * math.pi / 4)
"""Directions from a place to its name: straight beside it before over a corner."""


def place_labels(axes: Any, scene: PictureScene) -> None:  # noqa: ANN401 - matplotlib is untyped
    """Put the narrowest place's width, the marks' names, the waypoints' numbers and the zones' names into an image."""
    axes.figure.draw_without_rendering()  # lays the figure out, so that metres and pixels are known of each other
    room = _Room(axes, scene)
    if scene.narrowest is not None:
        middle = Point(scene.narrowest.ends.mean(axis=0))
        room.beside(middle, f"{scene.narrowest.width_m:.1f} m", "width", (10.0, 25.0, 45.0, 80.0))
    for mark in scene.marks[:_MOST_NAMES]:
        if mark.name:
            room.beside(Point(mark.point), harmless(mark.name), "mark", (10.0, 25.0))
    waypoints = list(
        {tuple(point): (number, point) for number, point, _ in reversed(scene.waypoints)}.values()
    )
    for number, point in reversed(waypoints[:: 1 + len(waypoints) // _MOST_NAMES]):
        room.beside(Point(point), str(number), "number", (_WAYPOINT_PX, _MARKER_PX))
    fences = shapely.union_all([scene.exclusions, scene.ground.edge, scene.inner_edges])
    zones = sorted(scene.named_zones, key=lambda named: -named[1].area)
    for zone, seen in zones[:_MOST_NAMES]:
        name = (
            OBSTACLE if zone.name.startswith(OBSTACLE) else zone.name
        )  # who reported it, and when, takes too much room
        in_two_lines = name.replace(" ", "\n", 1)
        is_inside = any(room.inside(seen, words) for words in (in_two_lines, name))
        if not is_inside and zone.area.within(scene.frame):
            room.beside(seen, in_two_lines, "zone", (_GAP_PX, 15.0, 30.0), fences)


class _Room:
    """An image's room for names: what is taken, and by what.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
        Laid out.
    scene : PictureScene
        What is shown.
    """

    def __init__(self, axes: Any, scene: PictureScene) -> None:  # noqa: ANN401
        self._axes = axes
        self._m_per_px = 1 / abs(axes.transData.transform((1, 0))[0] - axes.transData.transform((0, 0))[0])
        self._frame = scene.frame
        self._lines = shapely.STRtree([*self._lines_of(scene), scene.band])
        self._names: list[Polygon] = []

    def beside(
        self,
        shape: BaseGeometry,
        words: str,
        gid: str,
        away_px: Iterable[float],
        off: BaseGeometry | None = None,
    ) -> None:
        """Put a name beside a shape, where there is room near by, and not on what it is to stay off."""
        text, size_m = self._text(words, gid)
        west, south, east, north = shape.bounds
        middle_m = np.array((west + east, south + north)) / 2
        half_m = (np.array((east - west, north - south)) + size_m) / 2
        for px in away_px:
            for side in _SIDES:
                place = Point(
                    middle_m + np.array(side) * px * self._m_per_px + np.sign(np.round(side, 6)) * half_m
                )
                box = _box(place, *size_m)
                if self._is_free(box) and not (off is not None and box.intersects(off)):
                    self._put(text, place, box)
                    return
        text.remove()

    def inside(self, area: BaseGeometry, words: str) -> bool:
        """Put a name into an area, if there is room."""
        text, size_m = self._text(words, "zone")
        near = self._lines.geometries.take(self._lines.query(area))
        free = area.buffer(-_GAP_PX * self._m_per_px).difference(shapely.union_all([*near, *self._names]))
        middle = _place(free, *size_m)
        if middle is None:
            text.remove()
            return False
        self._put(text, middle, _box(middle, *size_m))
        return True

    def _text(self, words: str, gid: str) -> tuple[Any, tuple[float, float]]:
        """Return a text without a place, and its size in metres with a gap around."""
        look = {"ha": "center", "va": "center", "fontsize": _FONT_SIZE, "bbox": _BOX, "zorder": 9.3}
        text = self._axes.text(0, 0, words, gid=gid, parse_math=False, **look)
        box = text.get_window_extent()
        width_px, height_px = box.width + 2 * _GAP_PX, box.height + 2 * _GAP_PX
        return text, (width_px * self._m_per_px, height_px * self._m_per_px)

    def _is_free(self, box: Polygon) -> bool:
        is_covered = len(self._lines.query(box, "intersects")) or any(map(box.intersects, self._names))
        return bool(self._frame.covers(box)) and not is_covered

    def _put(self, text: Any, middle: Point, box: Polygon) -> None:  # noqa: ANN401
        text.set_position((middle.x, middle.y))
        self._names.append(box)

    def _lines_of(self, scene: PictureScene) -> Iterator[BaseGeometry]:
        """Return the ground that lines and markers take up."""
        metres = self._m_per_px
        tracks = [LineString(track.points) for track in scene.tracks if len(track.points) > 1]
        narrow = [LineString(scene.narrowest.ends)] if scene.narrowest is not None else []
        yield from (line.buffer(2 * metres) for line in (*scene.legs, *tracks, *narrow))
        yield from (Point(point).buffer(_WAYPOINT_PX * 0.9 * metres) for point in scene.route)
        starts = [] if scene.start is None else [scene.start]
        marks = [mark.point for mark in scene.marks]
        for point in (*starts, *scene.targets, *scene.asked[~np.isnan(scene.asked).any(axis=1)], *marks):
            yield Point(point).buffer(0.8 * _MARKER_PX * metres)


def _place(free: BaseGeometry, width_m: float, height_m: float) -> Point | None:
    """Find a place for a box: the middle, else where the widest circle fits in once the ground is squeezed as the box is flat."""
    squeeze = height_m / width_m
    for part in sorted(polygons(free), key=lambda polygon: -polygon.area):
        squeezed = affinity.scale(part, squeeze, 1.0, origin=(0, 0))
        radius = shapely.maximum_inscribed_circle(squeezed, tolerance=height_m / 8)
        x, y = radius.coords[0]
        for place in (part.centroid, Point(x / squeeze, y)):
            if part.covers(_box(place, width_m, height_m)):
                return place
    return None


def _box(middle: Point, width_m: float, height_m: float) -> Polygon:
    return shapely.box(
        middle.x - width_m / 2, middle.y - height_m / 2, middle.x + width_m / 2, middle.y + height_m / 2
    )
