"""A plan, and how long it took."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

from missions.planning.plan import plan

if TYPE_CHECKING:
    from collections.abc import Callable

    from missions.planned import Plan
    from missions.request import Request
    from missions.situation import Situation


def timed_plan(
    situation: Situation, request: Request, *, should_stop: Callable[[], bool] | None = None
) -> tuple[Plan, float]:
    """Return a plan, and how long planning took."""
    begun_s = time.perf_counter()
    planned = plan(situation, request, should_stop=should_stop)
    return planned, time.perf_counter() - begun_s
