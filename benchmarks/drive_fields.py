"""Fields for the drive benchmark, each from a seed: a fence, a start with a heading, a target, a clearance."""

from __future__ import annotations

import math
import random
from dataclasses import dataclass
from typing import TYPE_CHECKING

import shapely
from shapely import LineString, Point, Polygon, affinity

from missions.fence import CircleZone, Fence, PolygonZone, ZoneKind
from missions.geo import LatLon, LocalPoint, rounded
from missions.ground.frame import LocalFrame, frame_around

if TYPE_CHECKING:
    from shapely.geometry.base import BaseGeometry

CENTRE = LatLon(40.0721, -105.2293)
CLEARANCES_M = (1.0, 1.5, 2.0, 3.0)
START_ROOM_M = 1.0
"""Start and target have so much more room than the promise."""

_TRIES = 400


@dataclass(frozen=True)
class Field:
    """One problem."""

    seed: int
    kind: str
    fence: Fence
    start: LatLon
    heading_deg: float
    target: LatLon
    clearance_m: float


def make_field(seed: int) -> Field:
    """Return the field of a seed."""
    rng = random.Random(seed)
    kind = ("yard", "circles", "gates", "hairpins")[seed % 4]
    size_m = rng.uniform(80.0, 220.0)
    clearance_m = rng.choice(CLEARANCES_M)
    outline = _outline(rng, size_m)
    obstacles, circles = {
        "yard": _yard,
        "circles": _circles,
        "gates": _gates,
        "hairpins": _hairpins,
    }[kind](rng, outline, size_m, clearance_m)
    start, target = _ends(rng, outline, [*obstacles, *_round(circles)], size_m, clearance_m)
    frame = frame_around([CENTRE])
    zones = (
        polygon_zone(frame, ZoneKind.INCLUSION, outline),
        *(polygon_zone(frame, ZoneKind.EXCLUSION, obstacle) for obstacle in obstacles),
        *(CircleZone(ZoneKind.EXCLUSION, place_of(frame, x, y), radius_m) for x, y, radius_m in circles),
    )
    return Field(
        seed,
        kind,
        Fence(zones),
        place_of(frame, *start),
        rng.uniform(0.0, 360.0),
        place_of(frame, *target),
        clearance_m,
    )


Circles = list[tuple[float, float, float]]


def _outline(rng: random.Random, size_m: float) -> Polygon:
    corners = rng.randint(4, 8)
    return Polygon(
        [
            (
                math.sin(math.tau * (i + rng.uniform(-0.2, 0.2)) / corners)
                * size_m
                / 2
                * rng.uniform(0.9, 1.2),
                math.cos(math.tau * (i + rng.uniform(-0.2, 0.2)) / corners)
                * size_m
                / 2
                * rng.uniform(0.9, 1.2),
            )
            for i in range(corners)
        ]
    )


def _yard(rng: random.Random, _outline: Polygon, size_m: float, _: float) -> tuple[list[Polygon], Circles]:
    """Return buildings, some of them with a court, turned any way."""
    found: list[Polygon] = []
    for _try in range(rng.randint(3, 9)):
        x, y = (rng.uniform(-size_m, size_m) * 0.4 for _ in range(2))
        long_m, wide_m = rng.uniform(5, size_m / 3), rng.uniform(3, size_m / 6)
        shape = shapely.box(-long_m / 2, -wide_m / 2, long_m / 2, wide_m / 2)
        if rng.random() < 0.4:
            shape = shape.difference(shapely.box(-long_m / 6, -wide_m / 6, long_m / 6, wide_m))
        shape = affinity.translate(affinity.rotate(shape, rng.uniform(0, 180)), x, y)
        if isinstance(shape, Polygon):
            found.append(shape)
    return found, []


def _circles(
    rng: random.Random, _outline: Polygon, size_m: float, __: float
) -> tuple[list[Polygon], Circles]:
    """Return trees and ponds."""
    return [], [
        (rng.uniform(-0.4, 0.4) * size_m, rng.uniform(-0.4, 0.4) * size_m, rng.uniform(1.0, size_m / 9))
        for _ in range(rng.randint(4, 14))
    ]


def _gates(
    rng: random.Random, outline: Polygon, size_m: float, clearance_m: float
) -> tuple[list[Polygon], Circles]:
    """Return walls right across the field, each with a gate that is a little wider than need be."""
    walls: list[Polygon] = []
    reach_m = size_m
    turn_deg = rng.uniform(0, 180)
    for number in range(rng.randint(1, 3)):
        y = (number - 1) * size_m * 0.25 + rng.uniform(-5, 5)
        gate_m = 2 * (clearance_m + rng.uniform(0.3, 2.5))
        gate = rng.uniform(-0.25, 0.25) * size_m
        for a, b in ((-reach_m, gate - gate_m / 2), (gate + gate_m / 2, reach_m)):
            wall = LineString([(a, y), (b, y + rng.uniform(-4, 4))]).buffer(0.6, cap_style="flat")
            wall = affinity.rotate(wall, turn_deg, origin=(0, 0)).intersection(outline.buffer(3))
            walls += [
                part for part in shapely.get_parts(wall) if isinstance(part, Polygon) and not part.is_empty
            ]
    return walls, []


def _hairpins(
    rng: random.Random, outline: Polygon, size_m: float, clearance_m: float
) -> tuple[list[Polygon], Circles]:
    """Return walls from alternate sides, to be driven round in sharp turns."""
    walls: list[Polygon] = []
    count = rng.randint(2, 4)
    turn_deg = rng.uniform(0, 180)
    for number in range(count):
        y = (number - (count - 1) / 2) * size_m * 0.7 / count
        side = 1 if number % 2 else -1
        free_m = max(rng.uniform(0.15, 0.4) * size_m, 4 * clearance_m)
        wall = LineString([(side * size_m, y), (-side * (size_m / 2 - free_m), y + rng.uniform(-3, 3))])
        area = affinity.rotate(wall.buffer(0.5, cap_style="flat"), turn_deg, origin=(0, 0))
        walls += [
            part
            for part in shapely.get_parts(area.intersection(outline.buffer(3)))
            if isinstance(part, Polygon) and not part.is_empty
        ]
    return walls, []


def _round(circles: Circles) -> list[Polygon]:
    return [Point(x, y).buffer(radius_m) for x, y, radius_m in circles]


def _ends(
    rng: random.Random, outline: Polygon, obstacles: list[Polygon], size_m: float, clearance_m: float
) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return two places far from one another with some room about them, on one piece of ground."""
    free = outline.difference(shapely.union_all(obstacles))
    roomy = free.buffer(-(clearance_m + START_ROOM_M))
    joined = shapely.get_parts(free.buffer(-clearance_m))
    best: tuple[float, tuple[float, float], tuple[float, float]] | None = None
    for _ in range(_TRIES):
        a, b = ((rng.uniform(-0.55, 0.55) * size_m, rng.uniform(-0.55, 0.55) * size_m) for _ in range(2))
        if not (roomy.covers(Point(a)) and roomy.covers(Point(b))):
            continue
        bent = _crosses(obstacles, a, b)
        connected = any(part.covers(Point(a)) and part.covers(Point(b)) for part in joined)
        merit = math.dist(a, b) * (1.0 + bent) * (1.0 if connected else 0.1)
        if best is None or merit > best[0]:
            best = (merit, a, b)
        if connected and bent and math.dist(a, b) > 0.6 * size_m:
            break
    if best is None:
        raise ValueError("a field without room")
    return best[1], best[2]


def _crosses(obstacles: list[Polygon], a: tuple[float, float], b: tuple[float, float]) -> bool:
    line = LineString([a, b])
    return any(obstacle.intersects(line) for obstacle in obstacles)


def place_of(frame: LocalFrame, east_m: float, north_m: float) -> LatLon:
    """Return a place as a mission would hold it."""
    return rounded(frame.to_lat_lon(LocalPoint(east_m, north_m)))


def polygon_zone(frame: LocalFrame, kind: ZoneKind, area: BaseGeometry) -> PolygonZone:
    """Return an area as a fence's zone."""
    ring = shapely.get_coordinates(area.exterior if isinstance(area, Polygon) else area)[:-1]
    return PolygonZone(kind, tuple(place_of(frame, float(x), float(y)) for x, y in ring))
