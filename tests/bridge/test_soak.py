"""A little of the soak (see `soak`), in every run of the tests."""

from __future__ import annotations

import pytest
from bridge.soak import soak


@pytest.mark.parametrize("seed", range(3))
def test_a_few_minutes_keep_every_promise(seed):
    run = soak(seed, hours=0.08)
    assert run.violations == []
    assert run.counts["target"] > 2
