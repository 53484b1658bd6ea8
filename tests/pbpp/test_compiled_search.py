"""The compiled search beside the plain one: the same turns, the same length to the last bit, the same work."""

from importlib.util import find_spec

import numpy as np
import pytest
from random_fields import KINDS, random_field

import pbpp
from pbpp import any_angle
from pbpp.any_angle import shortest_path

needs_numba = pytest.mark.skipif(find_spec("numba") is None, reason="the extra fast is not installed")


def assert_same(slabs, start, goal):
    plain, compiled = shortest_path(slabs, start, goal), shortest_path(slabs, start, goal, compiled=True)
    assert compiled == plain  # floats and all
    return plain


@needs_numba
@pytest.mark.parametrize("kind", KINDS)
def test_it_gives_the_same_on_random_fields(kind):
    reached = 0
    for seed in range(7_000_000, 7_000_250):
        field = random_field(seed, kind)
        try:
            slabs = field.planner()._space.mitred.slabs
        except pbpp.InvalidGeometryError:
            continue
        reached += assert_same(slabs, field.start, field.goal).vertices is not None
        assert_same(slabs, field.goal, field.start)
    assert reached > 100


@needs_numba
@pytest.mark.parametrize("name", ["rand100", "rand1000", "rb_lattice", "rb_corner_touch", "paper_3"])
def test_it_gives_the_same_on_the_cases(load_case, name):
    case = load_case(name)
    slabs = pbpp.Planner([case["inclusion"]], case["exclusions"])._space.mitred.slabs
    for query in case["queries"]:
        assert_same(slabs, tuple(query[:2]), tuple(query[2:]))


@needs_numba
@pytest.mark.parametrize("name", ["rand100", "rb_lattice"])
def test_a_queue_that_does_not_fit_grows_in_the_midst_of_a_search(load_case, monkeypatch, name):
    from pbpp.compiled import search

    monkeypatch.setattr(search, "_CAPACITY", 64)
    case = load_case(name)
    slabs = pbpp.Planner([case["inclusion"]], case["exclusions"])._space.mitred.slabs
    for query in case["queries"]:
        assert_same(slabs, tuple(query[:2]), tuple(query[2:]))


@needs_numba
def test_a_planner_searches_compiled_if_asked(square, monkeypatch):
    fence = [square], [[(30, 30), (70, 30), (70, 70), (30, 70)]]
    plain = pbpp.Planner(*fence, clearance_m=1.0)
    compiled = pbpp.Planner(*fence, clearance_m=1.0, compiled=True)
    monkeypatch.setattr(any_angle, "_Query", None)
    path = compiled.plan((10, 50), (90, 50))
    more = compiled.with_exclusion([(1, 1), (2, 1), (2, 2)]).plan((10, 50), (90, 50))
    monkeypatch.undo()
    expected = plain.plan((10, 50), (90, 50))
    assert path.points.tobytes() == expected.points.tobytes()
    assert np.isclose(more.length_m, path.length_m)
    # A query that may be stopped is searched plainly.
    stopped = compiled.plan((10, 50), (90, 50), should_stop=lambda: True)
    assert stopped.lower_bound_m <= path.length_m <= stopped.length_m


@needs_numba
def test_it_finds_no_path_where_there_is_none(square):
    walls = [[(0, 40), (100, 40), (100, 50), (0, 50)]]
    slabs = pbpp.Planner([square], walls)._space.mitred.slabs
    assert assert_same(slabs, (10.0, 10.0), (10.0, 90.0)).vertices is None


def test_without_numba_it_is_refused_with_advice(square, monkeypatch):
    monkeypatch.setattr("pbpp.compiled.find_spec", lambda _: None)
    assert pbpp.Planner([square], []).plan((1, 1), (2, 2)).length_m > 1.0
    with pytest.raises(ImportError, match=r"pip install \"pbpp-rover\[fast\]\""):
        pbpp.Planner([square], [], compiled=True)
