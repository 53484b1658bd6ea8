"""A scene in the terminal: shades for forbidden ground, braille dots for the route, plain text."""

from __future__ import annotations

import math
from itertools import pairwise, zip_longest
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import shapely

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray
    from shapely.geometry.base import BaseGeometry

    from missions.geo import LatLon
    from missions.picture.scene import PictureScene

_MOST_ROWS = 40  # so that a sketch fits a terminal's screen
_FEWEST_COLUMNS = 40  # narrower terminals wrap
_LEGEND_LINES, _LEGEND_COLUMNS = 3, 26  # what a legend takes below at 80 columns, or beside
_FEWEST_LINES = 8
_CELL_SHAPE = 2.0
"""A terminal's cell is about twice as high as wide."""

_COVERED_SHARE = 0.4  # of a cell
_THIN_SHARE = 0.05  # of a cell, where the rest of an area shows nowhere
_BRAILLE = 0x2800  # U+2800, the empty pattern; its eight low bits are the dots
_DOT_BITS = np.array([[0x01, 0x08], [0x02, 0x10], [0x04, 0x20], [0x40, 0x80]])


class _Signs(NamedTuple):
    exclusion: str
    outside: str
    route: str
    track: str
    unsafe: str
    mark: str
    bar: str
    rover: str


_BLOCKS = _Signs("▓", "░", "⠤⠒", "·", "▪", "✗", "├─┤", "↑↗→↘↓↙←↖◆")
_PLAIN = _Signs("#", ".", "*", "o", "!", "X", "|-|", "^>v<@")


def sketch(scene: PictureScene, *, columns: int = 80, encoding: str = "utf-8") -> str:
    """Return the sketch of a scene.

    Parameters
    ----------
    scene : Scene
        What is shown.
    columns : int
        The width, at least 40.
    encoding : str
        What the terminal understands.

    Returns
    -------
    str
        Lines of at most that width, the last one ended.
    """
    return Sketch(scene, columns=columns, encoding=encoding).text()


class Sketch:
    """A scene in the terminal, into which a vehicle and its track are drawn as it moves; the ground is drawn once.

    Parameters
    ----------
    scene : Scene
        What is shown.
    columns : int
        The width, at least 40.
    lines : int, optional
        The height at most, legend included; at least 8. Default: 40 and the legend.
    encoding : str
        What the terminal understands.
    """

    def __init__(
        self,
        scene: PictureScene,
        *,
        columns: int = 80,
        lines: int | None = None,
        encoding: str = "utf-8",
    ) -> None:
        self._scene = scene
        self._columns = max(columns, _FEWEST_COLUMNS)
        self._lines = None if lines is None else max(lines, _FEWEST_LINES)
        self._signs = _BLOCKS if _understands(encoding) else _PLAIN
        self._grid, self._has_legend_beside = self._laid_out()
        grid = self._grid
        self._ground = cells = np.full((grid.rows, grid.columns), " ")
        forbidden = shapely.union_all([scene.outside, scene.exclusions])
        outside = self._signs.outside if scene.has_inclusion else self._signs.exclusion
        cells[grid.covered(forbidden)] = outside
        cells[grid.covered(scene.exclusions)] = self._signs.exclusion
        if len(scene.route) > 1:
            _draw(cells, grid, scene.route, "" if self._signs is _BLOCKS else self._signs.route)

    def _laid_out(self) -> tuple[_Grid, bool]:
        """Return the cells, and whether the legend stands beside them, where the height is scarce and there is room."""
        if self._lines is None:
            return _Grid.of(self._scene, self._columns, _MOST_ROWS), False
        whole = _Grid.of(self._scene, self._columns, min(_MOST_ROWS, self._lines))
        if whole.columns + _LEGEND_COLUMNS <= self._columns:
            return whole, True
        return _Grid.of(self._scene, self._columns, min(_MOST_ROWS, self._lines - _LEGEND_LINES)), False

    def text(
        self,
        track: Sequence[LatLon] = (),
        vehicle: LatLon | None = None,
        heading_deg: float | None = None,
    ) -> str:
        """Return it with where the vehicle drove, and where it is and heads.

        Parameters
        ----------
        track : sequence of LatLon
            Where it drove, beside the scene's own tracks.
        vehicle : LatLon, optional
            Where it is.
        heading_deg : float, optional
            Where its front points, clockwise from north.

        Returns
        -------
        str
            Lines of at most the asked width, the last one ended.
        """
        scene, grid, signs = self._scene, self._grid, self._signs
        cells, frame = self._ground.copy(), scene.ground.frame
        tracks = [one.points for one in scene.tracks]
        drives = [one.name for one in scene.tracks]
        if len(track):
            tracks.append(frame.to_local_array(track))
            drives.append("driven")
        for points in tracks:
            _draw(cells, grid, points, signs.track)
        for leg in scene.unsafe_legs:
            _draw(cells, grid, scene.route[leg : leg + 2], signs.unsafe)
        for mark in scene.marks:
            cells[grid.cell(mark.point)] = signs.mark
        for asked in scene.asked[~np.isnan(scene.asked).any(axis=1)]:
            cells[grid.cell(asked)] = "?"
        start = None if scene.start is None else grid.cell(scene.start)
        for number, target in enumerate(scene.targets, start=1):
            row, column = grid.cell(target)
            if (row, column) == start:  # which is seen too, beside it
                column += 1 if column + 1 < grid.columns else -1
            cells[row, column] = "T" if len(scene.targets) == 1 else str(number)[-1]
        if start is not None:
            cells[start] = "S"
        rover = ""
        if vehicle is not None:
            rover = _arrow(signs, heading_deg)
            cells[grid.cell(frame.to_local_array([vehicle])[0])] = rover
        picture = ["".join(row).rstrip() for row in cells]
        words = _legend_words(scene, grid, signs, rover=rover, drives=drives)
        if self._has_legend_beside:
            beside = zip_longest(picture, words[: len(picture)], fillvalue="")
            lines = [f"{row:<{grid.columns}}  {word}".rstrip() for row, word in beside]
        else:
            lines = [*picture, *_wrapped(words, self._columns)][: self._lines]
        return "\n".join([*lines, ""])


def _arrow(signs: _Signs, heading_deg: float | None) -> str:
    """Return the sign of a vehicle, which points where it heads; the last of all where that is not known."""
    if heading_deg is None:
        return signs.rover[-1]
    ways = len(signs.rover) - 1
    return signs.rover[round(heading_deg / 360 * ways) % ways]


class _Grid(NamedTuple):
    """The terminal's cells over the picture."""

    west_m: float
    north_m: float
    cell_m: float
    columns: int
    rows: int

    @classmethod
    def of(cls, scene: PictureScene, columns: int, rows: int) -> _Grid:
        west, south, east, north = scene.bounds_m
        cell_m = max((east - west) / columns, (north - south) / (_CELL_SHAPE * rows))
        wide, high = math.ceil((east - west) / cell_m), math.ceil((north - south) / (_CELL_SHAPE * cell_m))
        return cls(west, north, cell_m, min(wide, columns), min(high, rows))

    def cell(self, point: NDArray[np.float64]) -> tuple[int, int]:
        """Return the row and column of a point."""
        row, column = self._dots(point[None])[0] // (4, 2)
        return int(row), int(column)

    def dots(self, line: NDArray[np.float64]) -> NDArray[np.int64]:
        """Return the braille dots along a line, (n, 2), rows and columns of dots from the upper left."""
        steps = [
            np.linspace(a, b, max(2, math.ceil(4 * math.dist(a, b) / self.cell_m))) for a, b in pairwise(line)
        ]
        return self._dots(np.concatenate([line[:1], *steps]))

    def covered(self, area: BaseGeometry) -> NDArray[np.bool_]:
        """Return which cells an area covers to a good part; what is too thin for that shows wherever it is."""
        east_m = self.west_m + self.cell_m * np.arange(self.columns)
        north_m = self.north_m - _CELL_SHAPE * self.cell_m * np.arange(self.rows)
        boxes = shapely.box(
            east_m[None, :],
            north_m[:, None] - _CELL_SHAPE * self.cell_m,
            east_m[None, :] + self.cell_m,
            north_m[:, None],
        )
        cell_m2 = _CELL_SHAPE * self.cell_m**2
        shown: NDArray[np.bool_] = shapely.area(shapely.intersection(boxes, area)) > _COVERED_SHARE * cell_m2
        for part in shapely.get_parts(area):
            if part.buffer(-self.cell_m / 2).is_empty:
                shown |= shapely.area(shapely.intersection(boxes, part)) > _THIN_SHARE * cell_m2
        return shown

    def _dots(self, points: NDArray[np.float64]) -> NDArray[np.int64]:
        dot_m = self.cell_m / 2
        rows = np.floor((self.north_m - points[:, 1]) / dot_m).clip(0, 4 * self.rows - 1)
        columns = np.floor((points[:, 0] - self.west_m) / dot_m).clip(0, 2 * self.columns - 1)
        return np.column_stack((rows, columns)).astype(np.int64)


def _draw(cells: NDArray[np.str_], grid: _Grid, line: NDArray[np.float64], sign: str) -> None:
    """Draw a line with a sign, or with braille dots."""
    dots = grid.dots(line)
    places = tuple((dots // (4, 2)).T)
    if sign:
        cells[places] = sign
        return
    bits = np.zeros(cells.shape, dtype=np.int64)
    np.bitwise_or.at(bits, places, _DOT_BITS[tuple((dots % (4, 2)).T)])
    for row, column in zip(*bits.nonzero(), strict=True):
        cells[row, column] = chr(_BRAILLE + int(bits[row, column]))


def _legend_words(
    scene: PictureScene, grid: _Grid, signs: _Signs, *, rover: str, drives: list[str]
) -> list[str]:
    """Return the scale, the north and the meaning of the signs."""
    length_m = scene.scale_m()
    left, line, right = tuple(signs.bar)
    bar = f"{left}{line * max(0, round(length_m / grid.cell_m) - 2)}{right} {length_m} m, north up"
    more = "..." if signs is _PLAIN else "…"
    several = len(scene.targets) > 1
    return [
        bar,
        *([f"{rover} rover"] if rover else []),
        *(["S start"] if scene.start is not None else []),
        *([f"1, 2 {more} targets" if several else "T target"] if len(scene.targets) else []),
        *(["? target as asked"] if not np.isnan(scene.asked).all() else []),
        *([f"{signs.route} {scene.route_name}"] if len(scene.route) else []),
        *([f"{signs.unsafe} unsafe leg"] if scene.unsafe_legs else []),
        *([f"{signs.mark} {scene.marks_name}"] if scene.marks else []),
        *([f"{signs.track} {', '.join(dict.fromkeys(drives))}"] if drives else []),
        *([f"{signs.exclusion} exclusion"] if not scene.exclusions.is_empty else []),
        *([f"{signs.outside} outside the fence"] if scene.has_inclusion else []),
    ]


def _wrapped(words: list[str], columns: int) -> list[str]:
    """Return words in lines of at most a width; the scale stands first."""
    lines = [words[0]]
    for word in words[1:]:
        if len(lines[-1]) + len(word) + 2 <= columns:
            lines[-1] += f"  {word}"
        else:
            lines.append(word)
    return lines


def _understands(encoding: str) -> bool:
    try:
        "▓░⣿─…▪✗↗◆".encode(encoding)
    except (UnicodeEncodeError, LookupError):
        return False
    return True
