"""Random fences: rectilinear, slanted, concave, circles, overlapping and touching, with one or several inclusions."""

from dataclasses import dataclass

import numpy as np
import shapely

import pbpp


@dataclass(frozen=True)
class RandomField:
    inclusions: list
    exclusions: list
    clearance_m: float
    union: bool
    start: tuple
    goal: tuple

    def planner(self):
        return pbpp.Planner(self.inclusions, self.exclusions, clearance_m=self.clearance_m, union=self.union)


KINDS = ("rectilinear", "slanted", "circles", "concave", "walls", "mixed")


def rectangle(rng, size):
    east, north = rng.integers(0, size, 2)
    width, height = rng.integers(1, max(2, size // 3), 2)
    return [(east, north), (east + width, north), (east + width, north + height), (east, north + height)]


def slanted(rng, size):
    corners = rng.integers(3, 8)
    angle = np.sort(rng.uniform(0.0, 2.0 * np.pi, corners))
    radius = rng.uniform(0.3, size / 4.0, corners)
    return rng.uniform(0.0, size, 2) + np.column_stack((radius * np.cos(angle), radius * np.sin(angle)))


def circle(rng, size):
    return pbpp.circle_ring(
        rng.uniform(0.0, size, 2), rng.uniform(0.5, size / 6.0), segments=int(rng.integers(6, 17))
    )


def concave(rng, size):
    shape = np.array([(0, 0), (3, 0), (3, 1), (1, 1), (1, 2), (3, 2), (3, 3), (0, 3)], dtype=float)
    shape = shape @ np.array([[0, 1], [-1, 0]] if rng.random() < 0.5 else [[1, 0], [0, 1]])
    return shape * rng.integers(2, max(3, size // 3)) / 3.0 + rng.integers(0, size, 2)


def wall(rng, size):
    """Return a long thin bar, often from side to side: these part the field."""
    along = rng.integers(1, size)
    first, last = sorted(rng.integers(-1, size + 2, 2))
    ring = np.array(
        [(first, along), (last + 1, along), (last + 1, along + 1), (first, along + 1)], dtype=float
    )
    return ring if rng.random() < 0.5 else ring[:, ::-1]


MAKERS = {"rectilinear": rectangle, "slanted": slanted, "circles": circle, "concave": concave, "walls": wall}


def random_field(seed, kind=None):
    """Return the field of a seed; the same seed makes the same field."""
    rng = np.random.default_rng(seed)
    kind = kind or KINDS[int(rng.integers(len(KINDS)))]
    size = int(rng.choice([10, 20, 50]))
    exclusions = []
    for _ in range(int(rng.integers(1, 9))):
        maker = MAKERS[kind] if kind != "mixed" else list(MAKERS.values())[int(rng.integers(len(MAKERS)))]
        exclusions.append(np.asarray(maker(rng, size), dtype=float))
    inclusions = [[(0, 0), (size, 0), (size, size), (0, size)]]
    if rng.random() < 0.3:
        inclusions.append([(0, 0), (size, 0), (size, size * 0.6), (size * 0.4, size), (0, size)])
    if rng.random() < 0.1:
        inclusions.append(
            [(size * 0.5, -5), (size + 15, -5), (size + 15, size * 0.7), (size * 0.5, size * 0.7)]
        )
    clearance_m = float(rng.choice([0.0, 0.0, 0.3, 1.0, rng.uniform(0.0, 2.0), rng.uniform(0.0, 5.0)]))
    union = bool(rng.random() < 0.3)
    start, goal = (_end(rng, size, exclusions, clearance_m) for _ in range(2))
    return RandomField(inclusions, exclusions, clearance_m, union, start, goal)


def _end(rng, size, exclusions, clearance_m):
    """Return a point of the square, most often one that is free, often one of whole metres."""
    blocked = shapely.buffer(
        shapely.union_all([shapely.make_valid(shapely.Polygon(e)) for e in exclusions]), clearance_m
    )
    whole = rng.random() < 0.5
    for _ in range(1 if rng.random() < 0.1 else 12):
        east, north = rng.integers(0, size + 1, 2).astype(float) if whole else rng.uniform(0.0, size, 2)
        edge_m = min(east, north, size - east, size - north)
        if edge_m >= clearance_m and not shapely.contains_xy(blocked, east, north):
            break
    return float(east), float(north)
