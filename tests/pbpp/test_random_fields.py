"""Random fields against a visibility graph: 840 of them, always the same ones; `benchmarks/planner/campaign.py` takes 20,000 others."""

import numpy as np
import pytest
from field_check import check_field, verdict_of
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from random_fields import KINDS, random_field

import pbpp

SEEDS = st.integers(0, 2**32 - 1)


def many(count):
    return settings(
        max_examples=count,
        deadline=None,
        derandomize=True,
        database=None,
        suppress_health_check=list(HealthCheck),
    )


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("part", [0, pytest.param(1, marks=pytest.mark.campaign)])
@given(seed=SEEDS)
@many(70)
def test_the_path_is_safe_and_shortest(kind, part, seed):
    check_field(random_field((seed + part) % 2**32, kind))  # each part draws the same seeds


@pytest.mark.parametrize("offset_m", [(5e5, 4.6e6), (-5e5, 0.25)])
@given(seed=SEEDS)
@many(100)
def test_map_coordinates_change_nothing(offset_m, seed):
    field = random_field(seed)
    shift = np.array(offset_m)
    verdict, path = verdict_of(field.planner(), field.start, field.goal)
    moved = pbpp.Planner(
        [np.array(ring) + shift for ring in field.inclusions],
        [np.array(ring) + shift for ring in field.exclusions],
        clearance_m=field.clearance_m,
        union=field.union,
    )
    there, other = verdict_of(moved, np.array(field.start) + shift, np.array(field.goal) + shift)
    assert there == verdict
    if verdict == "path":
        assert np.isclose(other.length_m, path.length_m, rtol=1e-6, atol=1e-6)


@given(seed=SEEDS)
@many(100)
def test_the_same_input_gives_the_same_path(seed):
    field = random_field(seed)
    verdict, path = verdict_of(field.planner(), field.start, field.goal)
    again, other = verdict_of(field.planner(), field.start, field.goal)
    assert again == verdict
    if verdict == "path":
        assert path.points.tobytes() == other.points.tobytes()
        assert path.expanded == other.expanded
