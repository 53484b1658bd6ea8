"""One exclusion more or less: the blocks, and every path, are those of a planner made from scratch."""

from collections import Counter
from importlib.util import find_spec

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from random_fields import KINDS, MAKERS

import pbpp
from pbpp.partition.sweep import Sweep

PLAIN_AND_COMPILED = [
    False,
    pytest.param(
        True, marks=pytest.mark.skipif(find_spec("numba") is None, reason="the extra fast is not installed")
    ),
]
BESIDE = ("west_above", "west_below", "east_above", "east_below")


def blocks_of(slabs):
    """Return blocks with their ways and vertices with what is around them, by coordinates in place of numbers."""
    v, blocks, swept = slabs.vertices, slabs._blocks, slabs.swept
    is_plain = isinstance(swept, Sweep)

    def point(vertex):
        return tuple(v.points[vertex].tolist()) if vertex >= 0 else vertex

    def block(number):
        if number < 0:
            return number
        edges = [int(edge[number]) for edge in (blocks.floor, blocks.ceiling)]
        ends = [(point(edge), point(v.next[edge])) for edge in edges]
        return float(blocks.west[number]), float(blocks.east[number]), *ends

    def ways(direction, number):
        if is_plain:
            found = swept.ways[direction][number]
        else:
            first, last = swept.first[direction, number], swept.last[direction, number]
            found = swept.ways[direction, first:last].tolist()
        return [(*way[:3], point(way[3]), point(way[4]), block(way[5])) for way in found]

    def around(name, vertex):
        return int(getattr(swept, name)[vertex] if is_plain else swept.corners[name][vertex])

    there = set(range(len(blocks.west))) - set(slabs._dead.tolist())
    assert len(slabs) == len(there)
    found = [(block(number), ways(0, number), ways(1, number)) for number in there]
    vertices = [
        (
            *map(point, (vertex, v.prev[vertex], v.next[vertex])),
            bool(v.corner[vertex]),
            *(block(around(name, vertex)) for name in BESIDE),
            *(point(around(name, vertex)) for name in ("above", "below")),
        )
        for vertex in v.order.tolist()
    ]
    return sorted(map(str, found)), sorted(map(str, vertices))


def verdict(planner, start, goal, method="optimal"):
    try:
        path = planner.plan(start, goal, method=method)
    except pbpp.PlanningError as error:
        return str(error)
    return path.points.tolist(), path.length_m, path.lower_bound_m, path.expanded, path.blocks


def obstacles_of(rng):
    """Return obstacles within a square of that size: most touch nothing, some one another, few its edge."""
    kind = KINDS[int(rng.integers(len(KINDS)))]
    span = int(rng.choice([15, 30, 60, 120]))
    makers = list(MAKERS.values()) if kind == "mixed" else [MAKERS[kind]]
    return [
        np.asarray(makers[int(rng.integers(len(makers)))](rng, 8), dtype=float) + rng.integers(2, span, 2)
        for _ in range(int(rng.integers(2, 20)))
    ], span + 15


@pytest.mark.parametrize("compiled", PLAIN_AND_COMPILED)
def test_it_is_as_from_scratch(compiled):
    ways = Counter()

    @settings(max_examples=15, database=None)
    @given(st.integers(0, 10**9))
    def check(seed):
        rng = np.random.default_rng(seed)
        obstacles, size = obstacles_of(rng)
        fence = {"clearance_m": float(rng.choice([0.0, 0.0, 0.3, 1.0])), "compiled": compiled}
        inclusions = [[(-3, -3), (size, -3), (size, size), (-3, size)]] if rng.random() < 0.9 else []
        count = int(rng.integers(1, len(obstacles)))
        there, others = obstacles[:count], obstacles[count:]
        planner = pbpp.Planner(inclusions, there, **fence)
        for _ in range(4):
            if others and (rng.random() < 0.6 or not there):
                there = [*there, others.pop()]
                planner = planner.with_exclusion(there[-1])
            else:
                index = int(rng.integers(len(there)))
                others.append(there[index])
                there = there[:index] + there[index + 1 :]
                planner = planner.without_exclusion(index)
            scratch = pbpp.Planner(inclusions, there, **fence)
            field, expected = planner._space.mitred, scratch._space.mitred
            if (field.scene.origin_m != expected.scene.origin_m).any():  # without inclusions it may move
                return
            ways["changed" if field._is_changed else "anew"] += 1
            assert blocks_of(field.searched) == blocks_of(expected.searched)
            vertices = field.searched.vertices
            corner = vertices.points[vertices.order[int(rng.integers(len(vertices)))]]
            ends = [tuple(end) for end in [corner.tolist(), *rng.uniform(-3.0, size, (3, 2)).tolist()]]
            for start in ends:
                for goal in ends:
                    assert verdict(planner, start, goal) == verdict(scratch, start, goal)

    check()
    assert ways["changed"] > ways["anew"]


def test_a_changed_planner_knows_its_blocks_too(square):
    boxes = [
        [(10, 10), (20, 10), (20, 30), (10, 30)],
        [(50, 50), (60, 52), (58, 70)],
        [(15, 20), (70, 22), (15, 25)],
    ]
    planner = pbpp.Planner([square], boxes[:2]).with_exclusion(boxes[2])
    scratch = pbpp.Planner([square], boxes)
    assert planner._space.mitred._is_changed
    for method in ("pbpp", "pbpp-taut"):
        assert verdict(planner, (1, 1), (90, 60), method) == verdict(scratch, (1, 1), (90, 60), method)
    assert planner.free_space.equals(scratch.free_space)
    assert len(planner._space.mitred.blocks) == len(scratch._space.mitred.blocks)


def test_an_obstacle_that_moves_leaves_no_more_behind_than_a_share(square):
    posts = [
        pbpp.circle_ring((x, y), 2.0, segments=8) for x in range(10, 100, 20) for y in range(10, 100, 20)
    ]
    planner = pbpp.Planner([square], posts)
    for step in range(40):
        planner = planner.with_exclusion(pbpp.circle_ring((20.0 + step, 20.0), 3.0, segments=12))
        vertices = planner._space.mitred.searched.vertices
        assert len(vertices) >= 0.7 * len(vertices.x)
        planner = planner.without_exclusion(len(posts))
    scratch = pbpp.Planner([square], posts)
    assert verdict(planner, (1, 1), (99, 98)) == verdict(scratch, (1, 1), (99, 98))


@pytest.mark.parametrize(
    "ring",
    [
        pytest.param([(-5, 40), (5, 40), (5, 60)], id="at_the_edge"),
        pytest.param([(20, 40), (22, 40), (22, 60), (20, 60)], id="in_an_island"),
        pytest.param([(30, 20), (70, 20), (70, 30), (30, 30)], id="closes_a_court"),
        pytest.param([(200, 200), (210, 200), (210, 210)], id="outside"),
    ],
)
def test_where_more_than_holes_change_it_is_made_anew(square, ring):
    court = [(30, 30), (35, 30), (35, 60), (65, 60), (65, 30), (70, 30), (70, 65), (30, 65)]
    walls = [[(10, 30), (27, 30), (27, 33), (10, 33)], [(10, 33), (13, 33), (13, 70), (10, 70)]]
    walls += [[(13, 67), (27, 67), (27, 70), (13, 70)], [(24, 33), (27, 33), (27, 67), (24, 67)]]
    planner = pbpp.Planner([square], [court, *walls])
    assert planner._space.mitred.holes is not None
    changed = planner.with_exclusion(ring)
    scratch = pbpp.Planner([square], [court, *walls, ring])
    assert not changed._space.mitred._is_changed
    for start, goal in (((50, 40), (90, 90)), ((15, 50), (23, 50)), ((1, 1), (99, 99))):
        assert verdict(changed, start, goal) == verdict(scratch, start, goal)
