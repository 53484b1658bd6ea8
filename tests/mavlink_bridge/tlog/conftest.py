from __future__ import annotations

import pytest

from mavlink_bridge.tlog import source


@pytest.fixture(params=[2500, 4097, 10_000])
def small_windows(request, monkeypatch):
    """Read through windows so small that every log has many borders."""
    monkeypatch.setattr(source, "WINDOW_BYTES", request.param)
    return request.param
