"""Whether the vehicle's fix is good enough for a way home."""

from __future__ import annotations

from typing import TYPE_CHECKING

from missions.promise import FIX_ERRORS_M
from missions.words import metres

if TYPE_CHECKING:
    from missions.planned import Plan
    from missions.request import Request
    from missions.situation import Fix, Situation

_WANDERS_M = 0.3
"""What a receiver's own figure may wander by without a word; chosen, not measured."""

_BETTER = 0.8
"""A way that was refused is asked for again with a fix whose error is at most this share of the one then; chosen, not measured."""


def no_fix(situation: Situation, request: Request) -> str:
    """Return in words that there is no fix to plan by, and nobody has said how far the position may be off; empty where there is one."""
    fix = situation.fix
    if request.position_error_m is not None or fix is None or fix.value.kind in FIX_ERRORS_M:
        return ""
    return "no 3D GPS fix"


def fix_trouble(situation: Situation, plan: Plan | None, request: Request) -> str:
    """Return in words why the fix is worse than the plan that is driven has room for; empty where it is not."""
    if (trouble := no_fix(situation, request)) or plan is None or plan.clearance_m is None:
        return trouble
    error_m = _error_m(situation.fix.value) if situation.fix is not None else None
    if error_m is None or request.position_error_m is not None:
        return ""
    kept_m = max(
        plan.asked_m, plan.driven_clearance_m
    )  # a start near a fence, or in one, keeps less: it was left
    room_m = kept_m - plan.clearance_m - request.reserve_m
    if error_m <= room_m + _WANDERS_M:
        return ""
    return f"GPS error {metres(error_m)}, the route has room for {metres(max(room_m, 0.0))}"


def is_better(situation: Situation, before: Fix | None) -> bool:
    """Return whether the fix is clearly better than another one."""
    if situation.fix is None or before is None:
        return situation.fix is not None
    now_m, before_m = _error_m(situation.fix.value), _error_m(before)
    if now_m is None or before_m is None:
        return now_m is not None
    return now_m < before_m * _BETTER


def _error_m(fix: Fix) -> float | None:
    return fix.error_m if fix.error_m is not None else FIX_ERRORS_M.get(fix.kind)
