"""More kinds of field for the drive benchmark, each meant to be hard in its own way."""

from __future__ import annotations

import math
import random
from collections.abc import Callable

import shapely
from drive_fields import CENTRE, Field, place_of, polygon_zone
from shapely import LineString, Point, Polygon, affinity

from missions.fence import CircleZone, Fence, ZoneKind
from missions.ground.frame import frame_around

CLEARANCES_M = (1.0, 1.5, 2.0)
KINDS = ("near fence", "short", "behind", "corridor", "zigzag", "maze", "many circles", "narrow gate")
Place = tuple[float, float]
Layout = tuple[Polygon, list[Polygon], Place, Place]
"""Outline, obstacles, start, target; metres."""


def make_more(seed: int) -> Field:
    """Return the field of a seed."""
    rng = random.Random(1_000_000 + seed)
    kind = KINDS[seed % len(KINDS)]
    clearance_m = rng.choice(CLEARANCES_M)
    outline, obstacles, start, target = _LAYOUTS[kind](rng, clearance_m)
    turn_deg = rng.uniform(0, 360)
    turned = [
        affinity.rotate(one, turn_deg, origin=(0, 0))
        for one in (outline, *obstacles, Point(start), Point(target))
    ]
    frame = frame_around([CENTRE])
    zones = [polygon_zone(frame, ZoneKind.INCLUSION, turned[0])]
    for one in turned[1:-2]:
        radius_m = math.sqrt(one.area / math.pi)
        if kind == "many circles":
            zones.append(
                CircleZone(ZoneKind.EXCLUSION, place_of(frame, one.centroid.x, one.centroid.y), radius_m)
            )
        else:
            zones.append(polygon_zone(frame, ZoneKind.EXCLUSION, one))
    ends = [place_of(frame, one.x, one.y) for one in turned[-2:]]
    return Field(seed, kind, Fence(tuple(zones)), ends[0], rng.uniform(0, 360), ends[1], clearance_m)


def _open(size_m: float) -> Polygon:
    return shapely.box(-size_m / 2, -size_m / 2, size_m / 2, size_m / 2)


def _near_fence(rng: random.Random, clearance_m: float) -> Layout:
    """Start half a metre to 2 m farther from a long wall than is promised, facing any way."""
    wall = shapely.box(-40, -1, 40, 0)
    away_m = clearance_m + rng.uniform(0.6, 2.0)
    return (
        _open(140),
        [wall],
        (rng.uniform(-20, 20), away_m),
        (rng.uniform(-50, 50), rng.choice((-1, 1)) * 45.0),
    )


def _short(rng: random.Random, _: float) -> Layout:
    """A target 3 to 10 m away, in the open or round the end of a wall."""
    way_rad, away_m = rng.uniform(0, math.tau), rng.uniform(3, 10)
    start = (0.0, 0.0)
    target = (away_m * math.sin(way_rad), away_m * math.cos(way_rad))
    return _open(80), [shapely.box(-30, 12, 30, 13), shapely.box(15, -30, 16, 10)], start, target


def _behind(rng: random.Random, clearance_m: float) -> Layout:
    """Start in a lane, the target behind the vehicle or before it."""
    half_m = clearance_m + rng.uniform(3.0, 6.0)
    sides = [shapely.box(-60, half_m, 60, half_m + 2), shapely.box(-60, -half_m - 2, 60, -half_m)]
    return _open(140), sides, (rng.uniform(-10, 10), 0.0), (rng.choice((-1, 1)) * 50.0, rng.uniform(-1, 1))


def _corridor(rng: random.Random, clearance_m: float) -> Layout:
    """A long corridor with gentle bends."""
    half_m = clearance_m + rng.uniform(0.8, 2.0)
    course_rad, line = 0.0, [(-100.0, 0.0)]
    for _ in range(rng.randint(4, 7)):
        course_rad += rng.uniform(-0.5, 0.5)
        leg_m = rng.uniform(15, 45)
        east_m, north_m = line[-1]
        line.append((east_m + leg_m * math.cos(course_rad), north_m + leg_m * math.sin(course_rad)))
    along = LineString(line)
    ends = along.interpolate(half_m + 2), along.interpolate(along.length - half_m - 2)
    return along.buffer(half_m, quad_segs=4), [], (ends[0].x, ends[0].y), (ends[1].x, ends[1].y)


def _zigzag(rng: random.Random, clearance_m: float) -> Layout:
    """A lane between two zigzag walls."""
    half_m = clearance_m + rng.uniform(2.0, 4.0)
    step_m, swing_m = rng.uniform(15, 30), rng.uniform(4, 12)
    line = LineString(
        [(-60 + i * step_m, swing_m * (1 if i % 2 else -1)) for i in range(int(120 / step_m) + 1)]
    )
    sides = [
        LineString([(x, y + side * (half_m + 1)) for x, y in line.coords]).buffer(
            0.5, cap_style="flat", join_style="mitre"
        )
        for side in (-1, 1)
    ]
    ends = line.coords[0], line.coords[-1]
    return _open(200), sides, (ends[0][0] - 6, ends[0][1]), (ends[1][0] + 6, ends[1][1])


def _maze(rng: random.Random, clearance_m: float) -> Layout:
    """Cells with walls between them, some left out: a way through each."""
    cells = rng.randint(3, 4)
    cell_m = 2 * clearance_m + rng.uniform(5.0, 9.0)
    size_m = cells * cell_m
    seen, walls, stack = {(0, 0)}, set(), [(0, 0)]
    for x in range(cells):
        for y in range(cells):
            walls |= {((x, y), (x + 1, y)), ((x, y), (x, y + 1))}
    while stack:
        x, y = stack[-1]
        free = [(x + a, y + b) for a, b in ((1, 0), (-1, 0), (0, 1), (0, -1))]
        free = [(a, b) for a, b in free if 0 <= a < cells and 0 <= b < cells and (a, b) not in seen]
        if not free:
            stack.pop()
            continue
        after = rng.choice(free)
        walls.discard(((x, y), after))
        walls.discard((after, (x, y)))
        seen.add(after)
        stack.append(after)
    shift = -size_m / 2
    found = []
    for (x, y), (a, _b) in sorted(walls):
        east, north = (x + 1) * cell_m + shift, (y + 1) * cell_m + shift
        if a > x and a < cells:
            found.append(shapely.box(east - 0.2, north - cell_m, east + 0.2, north))
        elif a == x and y + 1 < cells:
            found.append(shapely.box(east - cell_m, north - 0.2, east, north + 0.2))
    middle = shift + cell_m / 2
    return _open(size_m), found, (middle, middle), (-middle, -middle)


def _many_circles(rng: random.Random, _: float) -> Layout:
    """A wood of small circles."""
    trees = []
    for _try in range(rng.randint(40, 80)):
        x, y = rng.uniform(-45, 45), rng.uniform(-45, 45)
        if min(math.dist((x, y), (-42, -42)), math.dist((x, y), (42, 42))) > 10:
            trees.append(Point(x, y).buffer(rng.uniform(0.3, 1.5)))
    return _open(110), trees, (-42.0, -42.0), (42.0, 42.0)


def _narrow_gate(rng: random.Random, clearance_m: float) -> Layout:
    """Two walls with gates hardly wider than need be, one after another."""
    walls = []
    for x in (-rng.uniform(8, 20), rng.uniform(8, 20)):
        gate, half_m = rng.uniform(-25, 25), clearance_m + rng.uniform(0.5, 1.0)
        walls += [
            shapely.box(x - 0.5, -80, x + 0.5, gate - half_m),
            shapely.box(x - 0.5, gate + half_m, x + 0.5, 80),
        ]
    return _open(120), walls, (-45.0, rng.uniform(-30, 30)), (45.0, rng.uniform(-30, 30))


_LAYOUTS: dict[str, Callable[[random.Random, float], Layout]] = dict(
    zip(
        KINDS,
        (_near_fence, _short, _behind, _corridor, _zigzag, _maze, _many_circles, _narrow_gate),
        strict=True,
    )
)
