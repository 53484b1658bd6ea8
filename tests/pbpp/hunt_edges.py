"""Hunt for lengths that are not the shortest: ends on and beside edges and vertices, at coordinates up to 1e7 m.

``python tests/pbpp/hunt_edges.py --count 20000 --first 0``: each seed is a field of `random_fields`, scaled and moved, with some pairs of ends; each pair is
planned forwards and backwards and compared with `exact_reference`, which shares nothing with the planner but free space. Prints what fails and a summary;
exits 1 on a failure.
"""

import argparse
import sys
from collections import Counter
from importlib.util import find_spec
from itertools import product
from pathlib import Path

import numpy as np
import shapely

sys.path.insert(0, str(Path(__file__).parent))

from exact_reference import ExactReference
from field_check import verdict_of
from random_fields import RandomField, random_field

import pbpp
from pbpp.any_angle import shortest_path
from pbpp.compiled import load_engine
from pbpp.partition.slabs import Slabs

RELATIVE = 1e-9
PAIRS = 4
NARROW_M = 2e-8
NEAR_M = 1e-7
"""So near to free space an end counts as on its boundary."""


def field_of(seed):
    """Return a field somewhere on a map of 1e7 m, and the random numbers for its ends."""
    rng = np.random.default_rng([seed, 16])
    turned = rng.random() < 0.4
    # Rectangles on a grid touch: turned they would leave gaps of 1e-15 m.
    small = random_field(seed, str(rng.choice(["slanted", "circles"])) if turned else None)
    scale = float(rng.choice([1.0, 1.0, 20.0, 77.7]))
    turn_rad = float(rng.uniform(0.0, 2.0 * np.pi)) if turned else 0.0
    turn = np.array([[np.cos(turn_rad), np.sin(turn_rad)], [-np.sin(turn_rad), np.cos(turn_rad)]])
    reach = float(rng.choice([0.0, 1e3, 5e6, 1e7]))
    shift = rng.uniform(-reach, reach, 2)
    if rng.random() < 0.5:
        shift = np.round(shift)

    def moved(ring):
        return np.asarray(ring, dtype=float) * scale @ turn + shift

    clearance_m = small.clearance_m * scale if rng.random() < 0.3 else 0.0
    inclusions = [moved(ring) for ring in small.inclusions]
    exclusions = [moved(ring) for ring in small.exclusions]
    return RandomField(inclusions, exclusions, clearance_m, small.union, None, None), rng


def ends_of(rng, rings):
    """Return an end on a vertex or an edge, or moved from there by 1e-9 to 1e-6 m."""
    ring = rings[int(rng.integers(len(rings)))]
    at = int(rng.integers(len(ring) - 1))
    share = float(rng.choice([0.0, 0.5, rng.random(), 10.0 ** rng.uniform(-9.0, -3.0)]))
    end = ring[at] + share * (ring[at + 1] - ring[at])
    if rng.random() < 0.7:
        angle_rad = rng.uniform(0.0, 2.0 * np.pi)
        end = end + 10.0 ** rng.uniform(-9.5, -6.0) * np.array([np.cos(angle_rad), np.sin(angle_rad)])
    return tuple(end.tolist())


def check(seed, counts, *, compiled=False):
    """Assert that a field's lengths are right; count the verdicts."""
    field, rng = field_of(seed)
    try:
        planner = field.planner()
    except pbpp.InvalidGeometryError:
        counts["no field"] += 1
        return
    inner = planner._space.mitred
    free, origin_m = inner.free.geometry, inner.scene.origin_m
    if not inner.free.polygons:
        counts["nothing free"] += 1
        return
    rings = [shapely.get_coordinates(ring) for part in free.geoms for ring in shapely.get_rings(part)]
    reference = ExactReference(free)
    twin = Slabs(inner.free.polygons, load_engine()) if compiled else None
    for _ in range(PAIRS):
        ends = [tuple((np.array(ends_of(rng, rings)) + origin_m).tolist()) for _ in range(2)]
        if rng.random() < 0.3:
            inside = shapely.get_coordinates(free.representative_point())[0] + origin_m
            ends[0] = tuple(inside.tolist())
        counts[_check_pair(planner, inner, reference, ends, twin)] += 1


def _check_pair(planner, inner, reference, ends, twin):
    start, goal = ends
    local = [inner.scene.to_local(end) for end in ends]
    away_m = [inner.free.geometry.distance(shapely.Point(end)) for end in local]
    there, path = verdict_of(planner, start, goal)
    back, returned = verdict_of(planner, goal, start)
    if planner._space.__dict__.pop(
        "rounded", None
    ):  # asked before anyone is told that there is no way: another free space
        return "rounded"
    assert (there in {"start", "goal"}) == (max(away_m) > NEAR_M) or abs(max(away_m) - NEAR_M) < 1e-9, (
        there,
        ends,
        away_m,
    )
    if there in {"start", "goal"}:
        assert back in {"start", "goal"}, (there, back, ends)
        return "blocked"
    assert there == back, (there, back, ends)
    length_m = path.length_m if there == "path" else np.inf
    expected_m = _nearest(length_m, reference, local)
    if reference.narrowest_m < NARROW_M and abs(length_m - expected_m) > 1e-6:
        # Gaps and walls within the planner's tolerance may be closed or passed: a path is no shorter than with all of them passed.
        wide = shapely.buffer(inner.free.geometry, NARROW_M, join_style="mitre")
        assert ExactReference(wide).length(*local) - 1e-6 <= length_m, (length_m, expected_m, ends)
        back_m = returned.length_m if there == "path" else np.inf
        assert abs(length_m - back_m) < 1e-7 if there == "path" else back == "none", (length_m, back_m, ends)
        return f"narrow {there}"
    if there == "none":
        assert expected_m == np.inf, (there, expected_m, ends)
        return there
    # In a corner of a few degrees the reference lets an end leave to either side, the planner on its own, around the corner.
    slack_m = RELATIVE * expected_m + 4e-9 + 2.0 * sum(away_m) + 2.0 * sum(map(reference.beside_m, local))
    assert abs(path.length_m - expected_m) <= slack_m, (path.length_m, expected_m, ends)
    assert abs(path.length_m - returned.length_m) <= slack_m, (path.length_m, returned.length_m, ends)
    assert path.lower_bound_m == path.length_m
    if twin is not None:
        common = inner.require(start, pbpp.StartBlockedError) & inner.require(goal, pbpp.GoalBlockedError)
        placed = [inner.onto(end, common) for end in local]
        assert shortest_path(twin, *placed) == shortest_path(inner.slabs, *placed), ends
    return there


def _nearest(length_m, reference, ends):
    """Return the reference's length; where an end in an obstacle is as near to free space on several sides, the one that is nearest to what was found."""
    lengths_m = [reference.length(*pair) for pair in product(*map(reference.places, ends))]
    return length_m if length_m in lengths_m else min(lengths_m, key=lambda one_m: abs(one_m - length_m))


def hunt(about, check):
    """Check as many fields as the command line says; return how many failed."""
    parser = argparse.ArgumentParser(description=about.splitlines()[0])
    parser.add_argument("--count", type=int, default=1000)
    parser.add_argument("--first", type=int, default=0)
    asked = parser.parse_args()
    counts, failures = Counter(), 0
    compiled = find_spec("numba") is not None
    for seed in range(asked.first, asked.first + asked.count):
        try:
            check(seed, counts, compiled=compiled)
        except Exception as error:  # noqa: BLE001 - whatever goes wrong is a failure, and the hunt goes on
            failures += 1
            print(f"seed {seed}: {type(error).__name__}: {str(error)[:250]}", flush=True)
    print(
        f"{asked.count} fields from seed {asked.first}, {failures} failures; pairs: {dict(sorted(counts.items()))}"
    )
    return failures


if __name__ == "__main__":
    sys.exit(1 if hunt(__doc__, check) else 0)
