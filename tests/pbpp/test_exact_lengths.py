"""The planning cases with their exact lengths, found by two other exact planners or by a visibility graph."""

import hashlib
import json
from pathlib import Path

import numpy as np
import pytest

import pbpp

DATA = Path(__file__).parent / "data"
EXACT = json.loads((DATA / "exact.json").read_text())


def length_of(planner, query, **options):
    try:
        return planner.plan(query[:2], query[2:], **options).length_m
    except pbpp.NoPathError:
        return -1.0


@pytest.mark.parametrize("name", sorted(EXACT))
def test_lengths_are_exact(name, load_case):
    case = load_case(name)
    planner = pbpp.Planner([case["inclusion"]], case["exclusions"])
    lengths = [length_of(planner, query) for query in case["queries"]]
    assert np.allclose(lengths, EXACT[name], rtol=1e-7, atol=0.0)


@pytest.mark.parametrize("name", sorted(set(EXACT) - {"rand1000"}))
def test_paper_paths_are_safe_and_taut_ones_between(name, load_case):
    case = load_case(name)
    planner = pbpp.Planner([case["inclusion"]], case["exclusions"])
    for query, exact in list(zip(case["queries"], EXACT[name], strict=True))[:5]:
        paper = length_of(planner, query, method="pbpp")
        taut = length_of(planner, query, method="pbpp-taut")
        if exact < 0.0:
            assert paper == taut == -1.0
        else:
            assert exact * (1.0 - 1e-9) <= taut <= paper * (1.0 + 1e-9)


@pytest.mark.parametrize("name", ["table1_1", "table1_2", "table1_3"])
def test_taut_paths_are_within_two_percent_on_the_scenarios_of_the_paper(name, load_case):
    case = load_case(name)
    planner = pbpp.Planner([case["inclusion"]], case["exclusions"])
    assert length_of(planner, case["queries"][0], method="pbpp-taut") <= 1.02 * EXACT[name][0]


def test_a_large_map_is_refused_by_the_paper_method_with_advice(load_case):
    case = load_case("rand1000")
    planner = pbpp.Planner([case["inclusion"]], case["exclusions"])
    query = case["queries"][0]
    with pytest.raises(pbpp.TooManyBlocksError, match='method="optimal"') as caught:
        planner.plan(query[:2], query[2:], method="pbpp")
    assert caught.value.blocks > caught.value.limit
    merged = pbpp.Planner([case["inclusion"]], case["exclusions"], partition="slabs")
    path = merged.plan(query[:2], query[2:], method="pbpp-taut")
    assert EXACT["rand1000"][0] <= path.length_m < 1.5 * EXACT["rand1000"][0]


@pytest.mark.parametrize(
    ("name", "digest"), [("rand100", "4a70a6ea5e8c90e9"), ("rand1000", "6374dff749c5dd27")]
)
def test_paths_are_the_same_to_the_bit_everywhere(load_case, name, digest):
    # Digests made with Python 3.11, 3.12 and 3.13 and GEOS 3.13.1 and 3.14.1: without a clearance paths turn at corners as given.
    case = load_case(name)
    planner = pbpp.Planner([case["inclusion"]], case["exclusions"])
    corners = {tuple(map(float, corner)) for ring in case["exclusions"] for corner in ring}
    found = hashlib.sha256()
    for query in case["queries"]:
        points = planner.plan(query[:2], query[2:]).points
        assert {tuple(point) for point in points[1:-1].tolist()} <= corners
        found.update(points.astype("<f8").tobytes())
    assert found.hexdigest()[:16] == digest
