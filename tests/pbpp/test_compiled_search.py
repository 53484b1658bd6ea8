"""The compiled planner beside the plain one: the same slabs, turns and work, the same lengths to the last bit."""

import subprocess
import sys
from importlib.util import find_spec

import numpy as np
import pytest
import shapely
from hunt_edges import field_of
from random_fields import KINDS, random_field

import pbpp
from pbpp import any_angle
from pbpp.any_angle import shortest_path
from pbpp.compiled import load_engine
from pbpp.partition.slabs import Slabs
from pbpp.partition.sweep import Sweep
from pbpp.partition.vertices import Vertices

pytestmark = pytest.mark.skipif(find_spec("numba") is None, reason="the extra fast is not installed")


def slabs_of(planner):
    """Return the slabs of a planner, swept plainly and compiled."""
    polygons = planner._space.mitred.free.polygons
    return Slabs(polygons), Slabs(polygons, load_engine())


def assert_same_slabs(plain, compiled):
    lists, flat = plain.swept, compiled.swept
    for name in ("floor", "ceiling", "west", "east"):
        assert flat.blocks[name].tolist() == getattr(lists, name)
    portals = flat.portals
    columns = [portals[name].tolist() for name in ("east", "low", "high", "west_block", "east_block")]
    assert list(zip(*columns, strict=True)) == lists.portals
    for direction in (0, 1):
        assert (
            flat.last[direction].tolist() == np.cumsum([*map(len, lists.ways[direction])], dtype=int).tolist()
        )
        assert flat.ways[direction].tolist() == [way for block in lists.ways[direction] for way in block]
    for name in ("west_above", "west_below", "east_above", "east_below", "above", "below"):
        assert flat.corners[name].tolist() == getattr(lists, name)
    fans = zip(*(flat.corners[name].tolist() for name in flat.corners.dtype.names[:6]), strict=True)
    assert list(fans) == plain.vertices.fans
    assert compiled.area_m2 == plain.area_m2
    assert compiled.unjoined_m == plain.unjoined_m
    assert compiled.portals.ends_m.tolist() == plain.portals.ends_m.tolist()
    assert compiled.portals.blocks.tolist() == plain.portals.blocks.tolist()


def assert_same(both, start, goal):
    plain, compiled = (shortest_path(slabs, start, goal) for slabs in both)
    assert compiled == plain  # floats and all
    return plain


def outcome(planner, start, goal):
    try:
        path = planner.plan(start, goal)
    except pbpp.PlanningError as error:
        return str(error)
    return (
        path.points.tobytes(),
        path.drawing.crossings_m.tobytes(),
        path.length_m,
        path.lower_bound_m,
        path.expanded,
    )


@pytest.mark.parametrize("kind", KINDS)
def test_it_gives_the_same_on_random_fields(kind):
    reached = 0
    for seed in range(7_000_000, 7_000_250):
        field = random_field(seed, kind)
        try:
            both = slabs_of(field.planner())
        except pbpp.InvalidGeometryError:
            continue
        assert_same_slabs(*both)
        reached += assert_same(both, field.start, field.goal).vertices is not None
        assert_same(both, field.goal, field.start)
    assert reached > 100


@pytest.mark.parametrize(
    "first", [0, *(pytest.param(first, marks=pytest.mark.campaign) for first in range(50, 200, 50))]
)
def test_a_planner_gives_the_same_anywhere_on_earth(first):
    paths = 0
    for seed in range(first, first + 50):
        field, rng = field_of(seed)
        fence = {"clearance_m": field.clearance_m, "union": field.union}

        def planner(*, compiled, field=field, fence=fence):
            try:
                return pbpp.Planner(field.inclusions, field.exclusions, **fence, compiled=compiled)
            except pbpp.InvalidGeometryError as error:
                return str(error)

        plain, compiled = planner(compiled=False), planner(compiled=True)
        if isinstance(plain, str):
            assert compiled == plain
            continue
        bounds = plain.free_space.bounds
        if not bounds[0] < bounds[2]:
            continue
        for _ in range(4):
            ends = np.column_stack(
                (rng.uniform(bounds[0], bounds[2], 2), rng.uniform(bounds[1], bounds[3], 2))
            )
            expected = outcome(plain, *ends.tolist())
            assert outcome(compiled, *ends.tolist()) == expected
            paths += isinstance(expected, tuple)
    assert paths > 50


def test_the_sweep_fails_where_the_plain_one_does():
    # Rings that cross themselves.
    failed = 0
    rng = np.random.default_rng(3)
    for _ in range(300):
        ring = np.round(rng.uniform(0.0, 10.0, (int(rng.integers(4, 9)), 2)), int(rng.integers(0, 3)))
        polygons = [shapely.Polygon(ring)]
        try:
            vertices = Vertices(polygons)
        except ValueError:
            continue
        try:
            Sweep(vertices).run()
        except (IndexError, ValueError):
            failed += 1
            with pytest.raises(ValueError, match="do not fit together"):
                Slabs(polygons, load_engine())
        else:
            assert_same_slabs(Slabs(polygons), Slabs(polygons, load_engine()))
    assert failed > 50


@pytest.mark.parametrize("name", ["rand100", "rand1000", "rb_lattice", "rb_corner_touch", "paper_3"])
def test_it_gives_the_same_on_the_cases(load_case, name):
    case = load_case(name)
    fence = [case["inclusion"]], case["exclusions"]
    plain, compiled = pbpp.Planner(*fence), pbpp.Planner(*fence, compiled=True)
    both = slabs_of(plain)
    assert_same_slabs(*both)
    for query in case["queries"]:
        start, goal = tuple(query[:2]), tuple(query[2:])
        assert_same(both, start, goal)
        assert outcome(compiled, start, goal) == outcome(plain, start, goal)


@pytest.mark.parametrize("name", ["rand100", "rb_lattice"])
def test_a_queue_that_does_not_fit_grows_in_the_midst_of_a_search_and_stays_so(load_case, monkeypatch, name):
    from pbpp.compiled import search

    monkeypatch.setattr(search, "_CAPACITY", 64)
    monkeypatch.setattr(search, "_PATH", 2)
    case = load_case(name)
    fence = [case["inclusion"]], case["exclusions"]
    plain, compiled = pbpp.Planner(*fence), pbpp.Planner(*fence, compiled=True)
    both = slabs_of(plain)
    for query in case["queries"]:
        assert_same(both, tuple(query[:2]), tuple(query[2:]))
        assert outcome(compiled, query[:2], query[2:]) == outcome(plain, query[:2], query[2:])
    (work,) = both[1].searcher._idle
    assert len(work.nodes) > 64
    assert np.isinf(work.best).all()


def test_a_planner_searches_compiled_if_asked(square, monkeypatch):
    fence = [square], [[(30, 30), (70, 30), (70, 70), (30, 70)]]
    plain = pbpp.Planner(*fence, clearance_m=1.0)
    monkeypatch.setattr(any_angle, "_Query", None)
    compiled = pbpp.Planner(*fence, clearance_m=1.0, compiled=True)
    path = compiled.plan((10, 50), (90, 50))
    more = compiled.with_exclusion([(1, 1), (2, 1), (2, 2)]).plan((10, 50), (90, 50))
    monkeypatch.undo()
    expected = plain.plan((10, 50), (90, 50))
    assert path.points.tobytes() == expected.points.tobytes()
    assert np.isclose(more.length_m, path.length_m)


@pytest.mark.parametrize("nodes", [0, 16, 48, 112])
def test_a_search_that_is_stopped_gives_the_same(load_case, monkeypatch, nodes):
    from pbpp.compiled import search

    def stopping():
        asked = iter(range(0, nodes, 16))
        return lambda: next(asked, None) is None

    monkeypatch.setattr(search, "_CHUNK", 16)
    case = load_case("rand100")
    fence = [case["inclusion"]], case["exclusions"]
    both = slabs_of(pbpp.Planner(*fence))
    stopped = 0
    for query in case["queries"]:
        plain, compiled = (shortest_path(one, tuple(query[:2]), tuple(query[2:]), stopping()) for one in both)
        assert compiled == plain
        stopped += plain.stopped
    assert stopped > 0
    planner = pbpp.Planner(*fence, compiled=True)
    path = planner.plan(query[:2], query[2:], should_stop=lambda: True)
    assert path.lower_bound_m <= planner.plan(query[:2], query[2:]).length_m <= path.length_m


def test_it_finds_no_path_where_there_is_none(square):
    walls = [[(0, 40), (100, 40), (100, 50), (0, 50)]]
    both = slabs_of(pbpp.Planner([square], walls))
    assert assert_same(both, (10.0, 10.0), (10.0, 90.0)).vertices is None


def test_the_result_is_kept_where_the_user_may_write(tmp_path):
    # A read-only install: no place beside the module. A program without a file has no place at all.
    code = (
        "import numba.core.caching as c\n"
        "place = getattr(c, 'InTreeCacheLocator', None) or c._InTreeCacheLocator\n"
        "place.ensure_cache_path = lambda s: (_ for _ in ()).throw(OSError())\n"
        "from pbpp.compiled.jit import compiled\n"
        "print(compiled(lambda x: x + 1.0)(1.0))\n"
        "import pbpp.compiled.sweep as s; print(s._sort._cache.cache_path)"
    )
    environment = {"NUMBA_CACHE_DIR": str(tmp_path), "PATH": ""}
    ran = subprocess.run(
        [sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True
    )
    assert ran.stdout.splitlines()[0] == "2.0"
    assert ran.stdout.splitlines()[1].startswith(str(tmp_path))
