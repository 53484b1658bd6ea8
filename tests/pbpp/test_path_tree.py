"""A tree of shortest paths says what single searches, and a visibility graph, say."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from visibility_graph import shortest_length

from pbpp import InvalidGeometryError, Planner

BOX = [(0, 0), (100, 0), (100, 80), (0, 80)]


def field(seed):
    chance = np.random.default_rng(seed)
    rings = []
    for _ in range(chance.integers(1, 10)):
        turns = np.sort(chance.uniform(0, 2 * np.pi, chance.integers(3, 8)))
        radius = chance.uniform(2, 14)
        ring = chance.uniform([5, 5], [95, 75]) + radius * np.stack([np.cos(turns), np.sin(turns)], axis=1)
        if shapely.Polygon(ring).area > 1:
            rings.append(ring)
    planner = Planner([BOX], rings, clearance_m=float(chance.choice([0.0, 0.5, 1.5])))
    corners = shapely.get_coordinates(planner.free_space)
    places = np.concatenate([chance.uniform([1, 1], [99, 79], (3, 2)), corners[:1]])
    points = np.concatenate([chance.uniform([1, 1], [99, 79], (6, 2)), corners[-1:], places[:1]])
    return planner, places, points


@pytest.mark.parametrize("seed", range(20))
def test_as_single_searches(seed):
    planner, places, points = field(seed)
    tree = planner.tree(places)
    found_m, wanted_m = tree.lengths(points), planner.lengths(points, places)
    reached = np.isfinite(found_m)  # where mitred corners leave no way, `plan` takes round ones
    assert found_m[reached] == pytest.approx(wanted_m[reached], abs=1e-6)
    assert (reached == np.isfinite(wanted_m)).mean() > 0.95
    for point, place in np.argwhere(reached).tolist():
        path = tree.path(points[point], place)
        assert path[0].tolist() == points[point].tolist()
        assert path[-1].tolist() == places[place].tolist()
        assert np.hypot(*np.diff(path, axis=0).T).sum() == pytest.approx(found_m[point, place], abs=1e-6)
    for point, place in np.argwhere(~reached).tolist():
        assert tree.path(points[point], place) is None


@pytest.mark.parametrize("seed", range(100, 108))
def test_as_a_visibility_graph(seed):
    planner, places, points = field(seed)
    found_m = planner.tree(places).lengths(points[:4])
    for row, point in zip(found_m, points[:4], strict=True):
        for length_m, place in zip(row, places, strict=True):
            if np.isfinite(length_m):
                wanted_m = shortest_length(planner.free_space, point, place)
                assert length_m == pytest.approx(wanted_m, abs=1e-5)


def test_in_the_open_plane_and_where_nothing_is():
    planner = Planner([], [[(10, -5), (12, -5), (12, 5), (10, 5)]], clearance_m=1.0)
    tree = planner.tree([(0, 0), (11, 0)])
    assert tree.lengths([(5, 0), (11, 1)]).tolist() == [[5.0, np.inf], [np.inf, np.inf]]
    assert planner.tree([(20.0, 0.0)]).lengths([(0.0, 0.0)])[0, 0] == pytest.approx(
        planner.lengths([(0, 0)], [(20, 0)])[0, 0]
    )


def test_compiled_planners_have_none():
    pytest.importorskip("numba")
    with pytest.raises(InvalidGeometryError, match="not compiled"):
        Planner([BOX], [], compiled=True).tree([(1, 1)])
