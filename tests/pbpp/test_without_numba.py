"""Without the extra ``fast``."""

import pytest

import pbpp


def test_compiled_planning_is_refused_with_advice(square, monkeypatch):
    monkeypatch.setattr("pbpp.compiled.find_spec", lambda _: None)
    planner = pbpp.Planner([square], [])
    assert planner.plan((1, 1), (2, 2)).length_m > 1.0
    assert planner.lengths([(1, 1), (2, 2)])[0, 1] > 1.0
    with pytest.raises(ImportError, match=r"pip install \"pbpp-rover\[fast\]\""):
        pbpp.Planner([square], [], compiled=True)
