"""Ground without obstacles, against shapely's own overlay of everything."""

import numpy as np
import pytest
import shapely
from random_fields import KINDS, random_field

from pbpp.free_space import grow_exclusions, parse_scene
from pbpp.geometry import polygons_only
from pbpp.subtract import subtracted

GROUND = shapely.box(-20, -20, 220, 220)


def assert_same(ground, obstacles):
    expected = shapely.difference(ground, shapely.union_all(obstacles))
    found = subtracted(ground, obstacles)
    assert found.is_valid
    assert shapely.symmetric_difference(expected, found).area <= 1e-9 * (1.0 + expected.length)
    assert len(polygons_only(found)) == len(polygons_only(expected))
    return found


@pytest.mark.parametrize("kind", KINDS)
def test_random_fields(kind):
    for seed in range(9_100_000, 9_100_100):
        field = random_field(seed, kind)
        scene = parse_scene(field.inclusions, field.exclusions, union=field.union)
        if scene.included is not None:
            assert_same(scene.included, list(grow_exclusions(scene, field.clearance_m)))


def houses(rng, rows=8, columns=8):
    """Return houses whose common walls run between the same points, some left out."""
    corners = np.stack(np.meshgrid(np.arange(columns + 1), np.arange(rows + 1)), axis=-1) * 20.0
    corners += rng.uniform(-4.0, 4.0, corners.shape)
    return [
        shapely.Polygon([corners[i, j], corners[i, j + 1], corners[i + 1, j + 1], corners[i + 1, j]])
        for i in range(rows)
        for j in range(columns)
        if rng.random() < 0.6
    ]


@pytest.mark.parametrize("seed", range(10))
def test_houses_with_common_walls_are_united_without_an_overlay(seed, monkeypatch):
    obstacles = houses(np.random.default_rng(seed))
    expected = assert_same(GROUND, obstacles)

    def not_needed(geometries):
        assert not len(geometries)
        return shapely.MultiPolygon()

    monkeypatch.setattr(shapely, "disjoint_subset_union_all", not_needed)
    assert subtracted(GROUND, obstacles).equals(expected)


@pytest.mark.parametrize("seed", range(10))
def test_houses_that_overlap_are_not_taken_for_such(seed):
    rng = np.random.default_rng(seed)
    obstacles = houses(rng)
    # The same house twice, three times, and one over its neighbours, between their corners.
    obstacles += [obstacles[0], obstacles[3], obstacles[3]]
    obstacles.append(shapely.union_all(obstacles[8:10]).convex_hull)
    assert_same(GROUND, obstacles)


def test_sheds_in_courts_and_rings_within_rings():
    rings = [
        shapely.box(i, i, 100 - i, 100 - i) - shapely.box(i + 2, i + 2, 98 - i, 98 - i)
        for i in range(0, 48, 4)
    ]
    sheds = [shapely.box(49, 49, 50, 50), shapely.box(2.5, 2.5, 3.5, 3.5), shapely.box(150, 150, 160, 160)]
    found = assert_same(GROUND, [*rings, *sheds, shapely.box(215, 0, 230, 10)])
    assert len(polygons_only(found)) == 13


def test_a_shed_in_a_court_of_touching_houses():
    corners = [(10 * i, 10 * j) for i in range(4) for j in range(4) if i in {0, 3} or j in {0, 3}]
    court = [shapely.box(x, y, x + 10, y + 10) for x, y in corners]
    found = assert_same(GROUND, [*court, shapely.box(18, 18, 22, 22), shapely.box(100, 0, 110, 10)])
    assert len(polygons_only(found)) == 2


def test_nothing_to_take_away_and_nothing_left():
    assert subtracted(GROUND, [shapely.MultiPolygon()]).equals(GROUND)
    assert polygons_only(subtracted(GROUND, [shapely.box(-30, -30, 300, 300)])) == []
    assert polygons_only(subtracted(shapely.MultiPolygon(), [shapely.box(0, 0, 1, 1)])) == []


@pytest.mark.parametrize("twice", range(8))
def test_a_corner_said_twice_is_no_wall(twice):
    left, right = [[5, 5], [10, 5], [10, 10], [5, 10]], [[10, 5], [15, 5], [15, 10], [10, 10]]
    expected = subtracted(GROUND, [shapely.Polygon(left), shapely.Polygon(right)])
    ring, at = (left, right)[twice // 4], twice % 4
    ring.insert(at, ring[at])
    assert assert_same(GROUND, [shapely.Polygon(left), shapely.Polygon(right)]).equals(expected)
