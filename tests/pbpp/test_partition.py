import numpy as np
import pytest
import shapely
from random_fields import random_field
from shapely.geometry import LineString, Polygon

import pbpp
from pbpp.errors import InvalidGeometryError
from pbpp.field import Field
from pbpp.free_space import FreeSpace, build_free_space, parse_scene
from pbpp.partition import blocks as blocks_module
from pbpp.partition.blocks import Blocks
from pbpp.partition.slabs import Slabs


def free_of(case):
    return build_free_space(parse_scene([case["inclusion"]], case["exclusions"], union=False), 0.0)


def random_free(seed):
    field = random_field(seed)
    scene = parse_scene(field.inclusions, field.exclusions, union=field.union)
    return build_free_space(scene, field.clearance_m)


def check_partition(partition, free):
    """Assert that the blocks are convex and fill free space, and that the portals are exactly their common edges."""
    outlines = [Polygon(partition.outline(block)) for block in range(len(partition))]
    assert all(one.is_valid for one in outlines)
    assert max(one.convex_hull.area - one.area for one in outlines) < 1e-7
    assert sum(one.area for one in outlines) == pytest.approx(free.geometry.area, rel=1e-9)
    fat = free.geometry.buffer(1e-7)
    assert all(fat.covers(one) for one in outlines)
    assert all(
        one.distance(shapely.Point(center)) < 1e-9
        for one, center in zip(outlines, partition.centers, strict=True)
    )
    joined = {tuple(sorted(pair)) for pair in partition.portals.blocks.tolist()}
    assert len(joined) == len(partition.portals)
    for pair, ends in zip(partition.portals.blocks.tolist(), partition.portals.ends_m, strict=True):
        for block in pair:
            assert outlines[block].distance(LineString(ends)) < 1e-7
            assert all(outlines[block].distance(shapely.Point(end)) < 1e-7 for end in ends)
    tree = shapely.STRtree(outlines)
    for one, two in tree.query(outlines, predicate="intersects").T.tolist():
        if one < two and (one, two) not in joined:
            assert outlines[one].intersection(outlines[two]).length < 1e-7


@pytest.mark.parametrize("seed", range(40))
def test_slabs_fill_free_space(seed):
    free = random_free(seed)
    if free.polygons:
        check_partition(Slabs(free.polygons), free)


@pytest.mark.parametrize("seed", range(40))
def test_blocks_fill_free_space(seed):
    free = random_free(seed)
    if free.polygons:
        check_partition(Blocks(free.polygons), free)


@pytest.mark.parametrize(
    ("name", "slabs", "blocks"), [("paper_3", 12, 43), ("rand10", 80, 1_181), ("rand100", 688, 21_340)]
)
def test_the_numbers_of_blocks_are_those_counted_elsewhere(name, slabs, blocks, load_case):
    free = free_of(load_case(name))
    partition = Blocks(free.polygons)
    assert len(partition.slabs) == slabs
    assert len(partition) == blocks


def test_the_sets_of_the_paper(square):
    free = build_free_space(
        parse_scene([square], [[(30, 40), (60, 40), (60, 70), (30, 70)]], union=False), 0.0
    )
    blocks = Blocks(free.polygons)
    assert len(blocks.obstacle_vertices) == 8
    assert sorted(blocks.vertical_lines[:, 0, 0].tolist()) == [30, 30, 60, 60]
    assert sorted(blocks.horizontal_lines[:, 0, 1].tolist()) == [40, 40, 70, 70]
    assert len(blocks.intersections) == 0  # every crossing is a corner of the obstacle
    assert len(blocks) == 8
    assert blocks.corners(0) == ((0, 0), (0, 40), (30, 0), (30, 40))
    assert blocks.diagonals == []
    assert blocks.locate((30, 40)) == blocks.locate((30.0, 40.0))
    assert len(blocks.locate((30, 20))) == 2
    assert blocks.locate((45, 55)) == []
    assert blocks.name == "blocks"
    assert blocks.slabs.name == "slabs"


def test_diagonal_neighbours_meet_where_lines_cross_away_from_obstacles(square):
    exclusions = [[(20, 20), (30, 20), (30, 30), (20, 30)], [(60, 60), (80, 60), (80, 70), (60, 70)]]
    free = build_free_space(parse_scene([square], exclusions, union=False), 0.0)
    blocks = Blocks(free.polygons)
    crossings = {tuple(point) for point in blocks.intersections.tolist()}
    # Every line but those that an obstacle stops crosses every other one.
    assert (20.0, 60.0) in crossings
    assert (60.0, 20.0) in crossings
    assert not crossings & {tuple(point) for ring in exclusions for point in ring}
    assert len(blocks.diagonals) == 2 * len(crossings)
    for one, two, corner in blocks.diagonals:
        shared = Polygon(blocks.outline(one)).intersection(Polygon(blocks.outline(two)))
        assert shared.equals(shapely.Point(corner))


def test_too_many_blocks_are_refused(square, monkeypatch):
    monkeypatch.setattr(blocks_module, "MAX_BLOCKS", 5)
    free = build_free_space(
        parse_scene([square], [[(30, 40), (60, 40), (60, 70), (30, 70)]], union=False), 0.0
    )
    with pytest.raises(pbpp.TooManyBlocksError, match="at least 6 blocks, more than the limit of 5"):
        Blocks(free.polygons)


def test_no_free_space_has_no_blocks():
    slabs = Slabs(())
    assert len(slabs) == 0
    assert len(slabs.portals) == 0
    assert slabs.locate((0, 0)) == []


def test_one_block_without_any_line(square):
    free = build_free_space(parse_scene([square], [], union=False), 0.0)
    blocks = Blocks(free.polygons)
    assert len(blocks) == 1
    assert len(blocks.portals) == 0
    assert blocks.intersections.shape == (0, 2)


@pytest.mark.parametrize(
    "polygon",
    [
        Polygon(
            [(0, 0), (10, 1), (11, 10), (1, 9)], [[(20, 20), (23, 24.5), (19, 28)]]
        ),  # the hole lies outside
        Polygon([(0, 0), (10, 10), (10, 0), (0, 10)]),  # a bow tie
        Polygon([(0, 0), (10, 0), (10, 10), (0, 10)], [[(2, 1), (13, 4.5), (3, 8)]]),  # the hole sticks out
    ],
)
def test_rings_that_do_not_fit_together_are_refused(polygon, square):
    scene = parse_scene([square], [], union=False)
    field = Field(scene, 0.0)
    object.__setattr__(field, "free", FreeSpace((polygon,), 0.0, scene.exclusions, polygon))
    with pytest.raises(InvalidGeometryError, match=r"the rings of free space|the blocks do not fill"):
        _ = field.slabs


def test_a_gap_narrower_than_rounding_is_closed(square):
    exclusions = [
        [(-5, 40), (50, 40), (50, 60), (-5, 60)],
        [(50 + 5e-10, 40), (105, 40), (105, 60), (50 + 5e-10, 60)],
    ]
    planner = pbpp.Planner([square], exclusions)
    for method in ("optimal", "pbpp", "pbpp-taut"):
        with pytest.raises(pbpp.NoPathError, match="no path joins start and goal"):
            planner.plan((50, 10), (50, 90), method=method)


@pytest.mark.parametrize("seed", range(5))
def test_the_sweep_does_not_depend_on_how_the_map_is_turned(seed):
    free = random_free(1000 + seed)
    for spin in ([[0, 1], [-1, 0]], [[-1, 0], [0, -1]], [[0.6, 0.8], [-0.8, 0.6]]):
        turned = [
            shapely.transform(one, lambda points, spin=spin: points @ np.array(spin)) for one in free.polygons
        ]
        assert Slabs(turned).area_m2 == pytest.approx(free.geometry.area, rel=1e-9)


def test_locating_many_points_forgets_none_of_their_blocks(load_case):
    slabs = Slabs(free_of(load_case("rand10")).polygons)
    points = [(float(east), 500.5) for east in range(0, 1000, 10)]
    once = [slabs.locate(point) for point in points]
    assert [slabs.locate(point) for point in points] == once
    assert any(once)
