"""Hunt for paths through walls, and for ways that walls take away: rings without width or hardly any, spikes, posts, and rings that touch one another.

``python tests/pbpp/hunt_walls.py --count 20000 --first 0``: each seed is a field of 20 m with some pairs of ends, planned forwards and backwards, plainly and
compiled, and compared with `exact_reference`. Prints what fails and a summary; exits 1 on a failure.

Without a clearance what is thinner than the planner's tolerance may be passed or not, as rounding has it. So where a field has that, the length must lie
between two others: with all of it open, and with walls of some thickness in its place.
"""

import sys
from pathlib import Path

import numpy as np
import shapely

sys.path.insert(0, str(Path(__file__).parent))

from exact_reference import ExactReference
from field_check import check_field, check_safe, surrounded, verdict_of
from hunt_edges import NARROW_M, hunt
from random_fields import RandomField

import pbpp

SIZE_M = 20.0
SQUARE = [(0.0, 0.0), (SIZE_M, 0.0), (SIZE_M, SIZE_M), (0.0, SIZE_M)]
PAIRS = 3
THICK_M = 1e-6
CLEAR_OF_WALLS_M = 1e-5
"""On a wall without width no one can say which side of it an end is on."""
WIDTHS_M = (0.0, 0.0, 1e-16, 1e-12, 1e-9, 8e-9, 3e-8, 1e-7, 1e-6, 1e-3)
BACKWARDS = {"path": {"path"}, "none": {"none"}, "goal": {"start"}, "start": {"start", "goal"}}
"""The start is looked at first: a blocked end is told as the other one on the way back, unless both are."""


def place(rng):
    """Return a point of the square, often one of whole metres."""
    whole = rng.random() < 0.6
    return rng.integers(0, 21, 2).astype(float) if whole else rng.uniform(0.0, SIZE_M, 2)


def line_ring(rng):
    """Return points along a line in any order, some twice, each beside it by at most a width."""
    begin, end = place(rng), place(rng)
    if rng.random() < 0.4:
        end[int(rng.integers(2))] = begin[int(rng.integers(2))]
    share = rng.choice([0.0, 1.0, 0.5, 1e-9, *rng.random(3)], int(rng.integers(3, 8)))
    along = end - begin
    length_m = float(np.hypot(*along)) or 1.0
    across = np.array([-along[1], along[0]]) / length_m
    beside_m = rng.choice([-0.5, 0.0, 0.5], len(share)) * rng.choice(WIDTHS_M)
    return begin + share[:, None] * along + beside_m[:, None] * across


def bar(rng):
    """Return a wall of one width from here to there, as a quadrangle, or only there and back on the same points."""
    begin, end = place(rng), place(rng)
    if rng.random() < 0.5:  # from side to side: it parts the square
        begin[0], end[0] = 0.0, SIZE_M
    along = end - begin
    across = np.array([-along[1], along[0]]) / (float(np.hypot(*along)) or 1.0) * rng.choice(WIDTHS_M)
    ring = np.array([begin, end, end + across, begin + across])
    return ring if rng.random() < 0.5 else ring[:, ::-1]


def bent_wall(rng):
    """Return a line with bends, there and back."""
    points = [place(rng) for _ in range(int(rng.integers(2, 5)))]
    return np.array([*points, *points[-2:0:-1], *points[: 3 - len(points)]])


def spiked(rng):
    """Return a box whose outline leaves and comes back on the same way, or nearly so."""
    west, south = rng.integers(0, 15, 2).astype(float)
    width, height = rng.integers(1, 6, 2).astype(float)
    ring = [(west, south), (west + width, south), (west + width, south + height), (west, south + height)]
    tip = place(rng)
    beside = tip + rng.choice(WIDTHS_M) * rng.uniform(-1.0, 1.0, 2)
    at = int(rng.integers(4))
    spike = [tip, beside] if rng.random() < 0.5 else [tip]
    return np.array([*ring[: at + 1], *spike, *ring[at:]])


def box(rng):
    """Return a box of whole metres: some of them touch, and have walls or corners in common."""
    west, south = rng.integers(0, 15, 2).astype(float)
    width, height = rng.integers(1, 5, 2).astype(float)
    return np.array(
        [(west, south), (west + width, south), (west + width, south + height), (west, south + height)]
    )


def roof(rng):
    """Return a triangle on three places."""
    return np.array([place(rng) for _ in range(3)])


def post(rng):
    """Return one point, several times."""
    return np.array([place(rng)] * 3)


MAKERS = (line_ring, line_ring, bar, bar, bent_wall, spiked, box, box, roof, post)


def field_of(seed):
    """Return the field of a seed, and the random numbers for its ends."""
    rng = np.random.default_rng([seed, 3])
    exclusions = []
    for _ in range(int(rng.integers(1, 7))):
        ring = MAKERS[int(rng.integers(len(MAKERS)))](rng)
        if rng.random() < 0.3:  # a corner said twice
            ring = np.insert(ring, (at := int(rng.integers(len(ring)))), ring[at], axis=0)
        exclusions.append(ring)
    if rng.random() < 0.2:
        exclusions.append(exclusions[0][::-1])
    clearance_m = float(rng.choice([0.01, 0.3, 1.0])) if rng.random() < 0.25 else 0.0
    return RandomField([SQUARE], exclusions, clearance_m, False, None, None), rng


def check(seed, counts, *, compiled=False):
    """Assert that a field's paths cross no wall and are the shortest; count the verdicts."""
    field, rng = field_of(seed)
    lines = shapely.MultiLineString([[*ring, ring[0]] for ring in field.exclusions])
    ends = [place(rng) for _ in range(2 * PAIRS)]
    ends = [tuple(end.tolist()) for end in ends if lines.distance(shapely.Point(end)) > CLEAR_OF_WALLS_M]
    pairs = list(zip(ends[::2], ends[1::2], strict=False))
    if field.clearance_m > 0.0:
        for start, goal in pairs:
            one = RandomField(field.inclusions, field.exclusions, field.clearance_m, False, start, goal)
            counts[f"clear {check_field(one, other_methods=False)}"] += 1
        return
    planner = field.planner()
    twin = pbpp.Planner(field.inclusions, field.exclusions, compiled=True) if compiled else None
    if not shapely.get_parts(planner.free_space).size:
        counts["nothing free"] += 1
        return
    for start, goal in pairs:
        one = RandomField(field.inclusions, field.exclusions, 0.0, False, start, goal)
        counts[_check_pair(planner, one, twin)] += 1


def _check_pair(planner, field, twin):
    ends = field.start, field.goal
    verdict, path = verdict_of(planner, *ends)
    back, returned = verdict_of(planner, *ends[::-1])
    assert back in BACKWARDS[verdict], (verdict, back, ends)
    if twin is not None:
        compiled, its = verdict_of(twin, *ends)
        assert compiled == verdict, (verdict, compiled, ends)
        assert verdict != "path" or its.points.tolist() == path.points.tolist(), ends
    if verdict == "path":
        check_safe(path, field)
        assert abs(path.length_m - returned.length_m) <= 1e-7, (path.length_m, returned.length_m, ends)
    elif verdict != "none":
        return verdict
    length_m = path.length_m if verdict == "path" else np.inf
    return (
        f"narrow {verdict}"
        if assert_shortest(planner.free_space, field.exclusions, ends, length_m)
        else verdict
    )


def assert_shortest(free, exclusions, ends, length_m):
    """Assert that a length, infinite for none, is the shortest; return whether free space has anything narrower than the planner's tolerance."""
    reference = ExactReference(free)
    if reference.narrowest_m > NARROW_M:
        expected_m = reference.length(*ends)
        assert length_m == expected_m or np.isclose(length_m, expected_m, rtol=1e-9), (expected_m, ends)
        return False
    with np.errstate(all="ignore"):  # GEOS divides by the length of an edge without one
        opened = shapely.buffer(free, NARROW_M, join_style="mitre")
    least_m = ExactReference(opened).length(*ends)
    thick = with_thick_walls(exclusions)
    is_free = all(thick.distance(shapely.Point(end)) == 0.0 for end in ends)
    most_m = ExactReference(thick).length(*ends) if is_free else np.inf
    assert least_m - 1e-6 <= length_m <= most_m + 10.0 * THICK_M, (least_m, length_m, most_m, ends)
    return True


def with_thick_walls(exclusions):
    """Return what is free of the square where every edge is a wall of some thickness, by shapely alone: of what is thinner rounding loses parts. On a grid no edge is tiny."""
    lines = [shapely.linestrings(np.stack((ring, np.roll(ring, -1, axis=0)), axis=1)) for ring in exclusions]
    walls = shapely.buffer(np.concatenate(lines), THICK_M, cap_style="square")
    walls = shapely.union_all([*walls, *map(surrounded, exclusions)], grid_size=THICK_M / 8.0)
    return shapely.difference(shapely.Polygon(SQUARE), walls, grid_size=THICK_M / 8.0)


if __name__ == "__main__":
    sys.exit(1 if hunt(__doc__, check) else 0)
