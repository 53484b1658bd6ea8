"""A scene in the terminal: shades for forbidden ground, braille dots for the route, plain text."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import shapely

if TYPE_CHECKING:
    from numpy.typing import NDArray
    from shapely.geometry.base import BaseGeometry

    from missions.picture.scene import PictureScene

_MOST_ROWS = 40  # so that a sketch fits a terminal's screen
_FEWEST_COLUMNS = 40  # narrower terminals wrap
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


_BLOCKS = _Signs("▓", "░", "⠤⠒", "·", "▪", "✗", "├─┤")
_PLAIN = _Signs("#", ".", "*", "o", "!", "X", "|-|")


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
    signs = _BLOCKS if _understands(encoding) else _PLAIN
    grid = _Grid.of(scene, max(columns, _FEWEST_COLUMNS))
    cells = np.full((grid.rows, grid.columns), " ")
    forbidden = shapely.union_all([scene.outside, scene.exclusions])
    cells[grid.covered(forbidden)] = signs.outside if scene.has_inclusion else signs.exclusion
    cells[grid.covered(scene.exclusions)] = signs.exclusion
    if len(scene.route) > 1:
        _draw(cells, grid, scene.route, "" if signs is _BLOCKS else signs.route)
    for track in scene.tracks:
        _draw(cells, grid, track.points, signs.track)
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
    picture = ["".join(row).rstrip() for row in cells]
    return "\n".join([*picture, *_legend(scene, grid, signs, max(columns, _FEWEST_COLUMNS)), ""])


class _Grid(NamedTuple):
    """The terminal's cells over the picture."""

    west_m: float
    north_m: float
    cell_m: float
    columns: int
    rows: int

    @classmethod
    def of(cls, scene: PictureScene, columns: int) -> _Grid:
        west, south, east, north = scene.bounds_m
        cell_m = max((east - west) / columns, (north - south) / (_CELL_SHAPE * _MOST_ROWS))
        wide, high = math.ceil((east - west) / cell_m), math.ceil((north - south) / (_CELL_SHAPE * cell_m))
        return cls(west, north, cell_m, min(wide, columns), min(high, _MOST_ROWS))

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


def _legend(scene: PictureScene, grid: _Grid, signs: _Signs, columns: int) -> list[str]:
    """Return the scale, the north and the meaning of the signs, wrapped to the width."""
    length_m = scene.scale_m()
    left, line, right = tuple(signs.bar)
    bar = f"{left}{line * max(0, round(length_m / grid.cell_m) - 2)}{right} {length_m} m, north up"
    more = "..." if signs is _PLAIN else "…"
    several = len(scene.targets) > 1
    words = [
        bar,
        *(["S start"] if scene.start is not None else []),
        *([f"1, 2 {more} targets" if several else "T target"] if len(scene.targets) else []),
        *(["? target as asked"] if not np.isnan(scene.asked).all() else []),
        *([f"{signs.route} {scene.route_name}"] if len(scene.route) else []),
        *([f"{signs.unsafe} unsafe leg"] if scene.unsafe_legs else []),
        *([f"{signs.mark} {scene.marks_name}"] if scene.marks else []),
        *(
            [f"{signs.track} {', '.join(dict.fromkeys(track.name for track in scene.tracks))}"]
            if scene.tracks
            else []
        ),
        *([f"{signs.exclusion} exclusion"] if not scene.exclusions.is_empty else []),
        *([f"{signs.outside} outside the fence"] if scene.has_inclusion else []),
    ]
    lines = [words[0]]
    for word in words[1:]:
        if len(lines[-1]) + len(word) + 2 <= columns:
            lines[-1] += f"  {word}"
        else:
            lines.append(word)
    return lines


def _understands(encoding: str) -> bool:
    try:
        "▓░⣿─…▪✗".encode(encoding)
    except (UnicodeEncodeError, LookupError):
        return False
    return True
