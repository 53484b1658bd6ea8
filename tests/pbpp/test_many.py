"""Many queries at once: what `plan` says of each."""

from importlib.util import find_spec

import numpy as np
import pytest
import shapely
from hunt_edges import ends_of, field_of

import pbpp

PLAIN_AND_COMPILED = [
    False,
    pytest.param(
        True, marks=pytest.mark.skipif(find_spec("numba") is None, reason="the extra fast is not installed")
    ),
]


def length_of(planner, start, goal):
    try:
        return planner.plan(start, goal).length_m
    except (pbpp.NoPathError, pbpp.StartBlockedError, pbpp.GoalBlockedError):
        return np.inf


@pytest.fixture
def walled(square):
    """Return a field that a wall parts, with a block on the one side."""
    return [square], [[(0, 60), (100, 60), (100, 61), (0, 61)], [(30, 20), (60, 20), (60, 40), (30, 40)]]


# In the open, on an edge, on a vertex, behind the wall, in an obstacle, outside.
POINTS = [(10.0, 30.0), (90.0, 31.0), (45.0, 20.0), (30.0, 20.0), (50.0, 90.0), (40.0, 30.0), (200.0, 200.0)]


@pytest.mark.parametrize("compiled", PLAIN_AND_COMPILED)
@pytest.mark.parametrize("clearance_m", [0.0, 1.0])
def test_lengths_are_those_of_plan(walled, compiled, clearance_m):
    planner = pbpp.Planner(*walled, clearance_m=clearance_m, compiled=compiled)
    lengths_m = planner.lengths(POINTS, POINTS[::-1])
    expected_m = [[length_of(planner, start, goal) for goal in POINTS[::-1]] for start in POINTS]
    assert lengths_m.tolist() == expected_m
    between_m = planner.lengths(POINTS)
    assert between_m.tolist() == between_m.T.tolist()
    above = np.triu_indices(len(POINTS), 1)
    assert between_m[above].tolist() == lengths_m[:, ::-1][above].tolist()
    assert not between_m.diagonal().any()
    assert planner.lengths([], POINTS).shape == (0, len(POINTS))
    assert planner.lengths([]).shape == (0, 0)


@pytest.mark.parametrize("compiled", PLAIN_AND_COMPILED)
def test_many_plans_are_those_of_plan(walled, compiled):
    planner = pbpp.Planner(*walled, compiled=compiled)
    ends = [(start, goal) for start in POINTS for goal in POINTS]
    errors = paths = 0
    for (start, goal), found in zip(ends, planner.plan_many(ends), strict=True):
        if isinstance(found, pbpp.PlanningError):
            with pytest.raises(type(found)) as caught:
                planner.plan(start, goal)
            assert str(caught.value) == str(found)
            errors += 1
        else:
            path = planner.plan(start, goal)
            assert found.points.tobytes() == path.points.tobytes()
            assert (found.length_m, found.lower_bound_m, found.expanded) == (
                path.length_m,
                path.lower_bound_m,
                path.expanded,
            )
            paths += 1
    assert errors > 10
    assert paths > 10
    assert planner.plan_many([]) == []


@pytest.mark.skipif(find_spec("numba") is None, reason="the extra fast is not installed")
def test_ends_on_edges_and_corners_are_found_at_once_as_one_by_one():
    paths = 0
    for seed in range(40):
        field, rng = field_of(seed)
        try:
            planner = pbpp.Planner(
                field.inclusions,
                field.exclusions,
                clearance_m=field.clearance_m,
                union=field.union,
                compiled=True,
            )
        except pbpp.InvalidGeometryError:
            continue
        space = planner.free_space
        rings = [shapely.get_coordinates(ring) for part in space.geoms for ring in shapely.get_rings(part)]
        if not rings:
            continue
        points = [ends_of(rng, rings) for _ in range(5)]
        points.append(tuple(shapely.get_coordinates(space.representative_point())[0].tolist()))
        expected_m = [[length_of(planner, start, goal) for goal in points] for start in points]
        assert planner.lengths(points, points).tolist() == expected_m
        pairs = [(start, goal) for start in points for goal in points]
        for pair, found in zip(pairs, planner.plan_many(pairs), strict=True):
            if not isinstance(found, pbpp.PlanningError):
                path = planner.plan(*pair)
                assert found.points.tobytes() == path.points.tobytes()
                assert (found.length_m, found.expanded) == (path.length_m, path.expanded)
                paths += 1
    assert paths > 500


@pytest.mark.parametrize("compiled", PLAIN_AND_COMPILED)
def test_an_end_where_many_blocks_meet(square, compiled):
    # Four wedges touch in one point: eight blocks and more lie around it.
    angles = np.arange(8) * np.pi / 4.0 + 0.1
    rim = 50.0 + 30.0 * np.column_stack((np.cos(angles), np.sin(angles)))
    wedges = [[(50.0, 50.0), tuple(rim[one]), tuple(rim[one + 1])] for one in range(0, 8, 2)]
    planner = pbpp.Planner([square], wedges, compiled=compiled)
    points = [(50.0, 50.0), (5.0, 5.0), (95.0, 50.0), (50.0, 95.0)]
    assert len(planner._space.mitred.searched.locate((50.0, 50.0))) > 4
    expected_m = [[length_of(planner, start, goal) for goal in points] for start in points]
    assert np.isfinite(expected_m).all()
    assert planner.lengths(points, points).tolist() == expected_m


@pytest.mark.parametrize("compiled", PLAIN_AND_COMPILED)
def test_on_the_open_plane_all_points_are_within(compiled):
    planner = pbpp.Planner([], [[(0, 0), (10, 0), (10, 10), (0, 10)]], compiled=compiled)
    far = [(-5000.0, 5.0), (5000.0, 5.0)]
    expected_m = 2.0 * np.hypot(5000.0, 5.0) + 10.0 - 2.0 * (np.hypot(5000.0, 5.0) - np.hypot(5000.0, 5.0))
    length_m = planner.lengths(far)[0, 1]
    assert length_m == planner.plan(*far).length_m == planner.plan_many([far])[0].length_m
    assert length_m < expected_m + 1.0


@pytest.mark.parametrize("compiled", PLAIN_AND_COMPILED)
def test_more_than_a_piece_for_each_thread(load_case, compiled, monkeypatch):
    case = load_case("rand100")
    planner = pbpp.Planner([case["inclusion"]], case["exclusions"], compiled=compiled)
    starts = np.array([query[:2] for query in case["queries"]])
    goals = np.array([query[2:] for query in case["queries"]])
    lengths_m = planner.lengths(starts, goals)
    for one, start in enumerate(starts[:5]):
        assert lengths_m[one].tolist() == [length_of(planner, start, goal) for goal in goals]
    monkeypatch.setattr("os.cpu_count", lambda: 1)
    assert planner.lengths(starts, goals).tolist() == lengths_m.tolist()


@pytest.mark.parametrize("compiled", PLAIN_AND_COMPILED)
def test_it_can_be_stopped(load_case, compiled, monkeypatch):
    if compiled:
        monkeypatch.setattr("pbpp.compiled.search._CHUNK", 16)
    case = load_case("rand100")
    planner = pbpp.Planner([case["inclusion"]], case["exclusions"], compiled=compiled)
    starts = [query[:2] for query in case["queries"]]
    with pytest.raises(pbpp.SearchStoppedError, match="stopped"):
        planner.lengths(starts, should_stop=lambda: True)
    asked = []
    assert (
        planner.lengths(starts, should_stop=lambda: asked.append(1)).tolist()
        == planner.lengths(starts).tolist()
    )
    assert len(asked) > 10


def test_points_that_are_none_are_refused(walled):
    planner = pbpp.Planner(*walled)
    for bad in ([(1.0, np.nan)], [(1.0, 2.0, 3.0)], [("a", "b")]):
        with pytest.raises(pbpp.InvalidGeometryError, match="starts are not pairs"):
            planner.lengths(bad)
    with pytest.raises(pbpp.InvalidGeometryError, match="ends are not"):
        planner.plan_many([((1.0, np.nan), (2.0, 3.0))])
