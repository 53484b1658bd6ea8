"""A map made here: raster tiles of a made-up field in one PMTiles file (version 3), for tests and pictures."""

from __future__ import annotations

import io
import json
import math
import struct
from typing import TYPE_CHECKING

from PIL import Image, ImageDraw

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator
    from pathlib import Path

SIZE_PX = 256
NO_COMPRESSION, PNG = 1, 2
HEADER = struct.Struct("<7sB11QBBBBBBiiiiBii")
GRASS, TRACK, TREES, ROOF = (176, 192, 140), (214, 202, 172), (96, 128, 84), (170, 110, 96)


def write_map(
    path: Path, middle: tuple[float, float], *, zooms: Iterable[int] = range(14, 20), around_m: float = 260.0
) -> None:
    """Write tiles around a place.

    Parameters
    ----------
    path : Path
        The PMTiles file.
    middle : tuple of float
        Longitude and latitude, degrees.
    zooms : iterable of int
    around_m : float
        How far the tiles reach at the least.
    """
    levels = sorted(zooms)
    tiles = sorted(
        (_tile_id(z, x, y), _tile(z, x, y, middle)) for z in levels for x, y in _tiles(z, middle, around_m)
    )
    entries, data = [], b""
    for number, picture in tiles:
        entries.append((number, len(data), len(picture)))
        data += picture
    directory = _directory(entries)
    metadata = json.dumps({"name": "a made-up field", "attribution": "made by tests"}).encode()
    begin = HEADER.size
    lon_deg, lat_deg = middle
    reach_deg = around_m / 80_000
    box = [
        round(value * 1e7)
        for value in (lon_deg - reach_deg, lat_deg - reach_deg, lon_deg + reach_deg, lat_deg + reach_deg)
    ]
    header = HEADER.pack(
        b"PMTiles", 3, begin, len(directory), begin + len(directory), len(metadata), 0, 0, begin + len(directory) + len(metadata), len(data),
        len(tiles), len(tiles), len(tiles), 1, NO_COMPRESSION, NO_COMPRESSION, PNG, levels[0], levels[-1], *box, levels[-1],
        round(lon_deg * 1e7), round(lat_deg * 1e7),
    )  # fmt: skip
    path.write_bytes(header + directory + metadata + data)


def _directory(entries: list[tuple[int, int, int]]) -> bytes:
    """Return a directory: counts, then tile ids as differences, run lengths, lengths, offsets."""
    numbers, before = [len(entries)], 0
    for number, _, _ in entries:
        numbers.append(number - before)
        before = number
    numbers += [1] * len(entries)
    numbers += [length for _, _, length in entries]
    numbers += [offset + 1 if i == 0 else 0 for i, (_, offset, _) in enumerate(entries)]
    return b"".join(map(_varint, numbers))


def _varint(number: int) -> bytes:
    out = bytearray()
    while number > 0x7F:
        out.append(number & 0x7F | 0x80)
        number >>= 7
    return bytes([*out, number])


def _tile_id(zoom: int, x: int, y: int) -> int:
    """Return a tile's number along the Hilbert curves of all zooms."""
    number, half = (4**zoom - 1) // 3, 2**zoom // 2
    while half:
        right, down = int(bool(x & half)), int(bool(y & half))
        number += half * half * ((3 * right) ^ down)
        if not down:
            if right:
                x, y = half - 1 - x, half - 1 - y
            x, y = y, x
        half //= 2
    return number


def _mercator(lon_deg: float, lat_deg: float) -> tuple[float, float]:
    """Return a place as shares of the whole map, from its north-western corner."""
    lat_rad = math.radians(lat_deg)
    return (lon_deg + 180) / 360, (1 - math.asinh(math.tan(lat_rad)) / math.pi) / 2


def _share_per_m(lat_deg: float) -> float:
    return 1 / (40_075_016.7 * math.cos(math.radians(lat_deg)))


def _tiles(zoom: int, middle: tuple[float, float], around_m: float) -> Iterator[tuple[int, int]]:
    x, y = _mercator(*middle)
    reach = around_m * _share_per_m(middle[1])
    for column in range(int((x - reach) * 2**zoom), int((x + reach) * 2**zoom) + 1):
        for row in range(int((y - reach) * 2**zoom), int((y + reach) * 2**zoom) + 1):
            yield column, row


def _tile(zoom: int, column: int, row: int, middle: tuple[float, float]) -> bytes:
    """Draw one tile: grass in strips, a track, trees and a roof, at places in metres from the middle."""
    at_x, at_y = _mercator(*middle)
    scale = _share_per_m(middle[1]) * 2**zoom * SIZE_PX
    left, top = (at_x * 2**zoom - column) * SIZE_PX, (at_y * 2**zoom - row) * SIZE_PX

    def px(east_m: float, north_m: float) -> tuple[float, float]:
        return left + east_m * scale, top - north_m * scale

    image = Image.new("RGB", (SIZE_PX, SIZE_PX), GRASS)
    pen = ImageDraw.Draw(image)
    for strip in range(-60, 60):
        shade = tuple(value - 7 * (strip % 2) for value in GRASS)
        pen.polygon(
            [px(strip * 9, -600), px(strip * 9 + 9, -600), px(strip * 9 + 49, 600), px(strip * 9 + 40, 600)],
            fill=shade,
        )
    pen.line(
        [px(-600, -150), px(-90, -110), px(20, -135), px(600, -90)],
        fill=TRACK,
        width=max(1, round(6 * scale)),
    )
    for i in range(60):
        east_m, north_m, radius_m = -420 + 15 * i, 125 + 14 * math.sin(i), 6 + 3 * math.cos(3 * i)
        (x0, y0), (x1, y1) = (
            px(east_m - radius_m, north_m + radius_m),
            px(east_m + radius_m, north_m - radius_m),
        )
        pen.ellipse([x0, y0, x1, y1], fill=TREES)
    pen.polygon([px(120, -60), px(150, -52), px(146, -34), px(116, -42)], fill=ROOF)
    out = io.BytesIO()
    image.quantize(32).save(out, "PNG", optimize=True)
    return out.getvalue()
