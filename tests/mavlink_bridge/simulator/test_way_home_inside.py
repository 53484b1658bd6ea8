"""Missions with their ways home inside, driven: a few seeds of `benchmarks/home_inside.py`."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

PATH = list(sys.path)
sys.path.append(str(Path(__file__).parents[3] / "benchmarks"))
from drive_fields import make_field  # noqa: E402
from home_inside import drives_of, planned_on  # noqa: E402

sys.path[:] = PATH  # modules of the benchmarks have names of rooms of the tests


@pytest.mark.parametrize("seed", [0, pytest.param(5, marks=pytest.mark.campaign)])
def test_chosen_it_leads_home_and_not_chosen_it_is_never_entered(seed):
    field = make_field(seed)
    planned = planned_on(field)
    drives = drives_of(field, planned)
    assert len(drives) > 1
    assert drives[0].chosen == "none"
    assert [drive.trouble for drive in drives] == [""] * len(drives)
