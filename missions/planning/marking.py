"""The mark of a plan whose drive lies outside what was measured: it promises nothing, unless the drive model is to be trusted there too."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from missions.drive_model import extrapolated

if TYPE_CHECKING:
    from missions.planned import Plan
    from missions.request import Request

_NOTHING = "the drive is extrapolated beyond what was measured: no clearance is promised (--trust-model promises it anyway)"
_TRUSTED = "the drive is extrapolated beyond what was measured; clearance is promised anyway (--trust-model)"


def marked(plan: Plan, request: Request) -> Plan:
    """Return a plan with what lies outside the measurements, and without its promise where something does."""
    reasons = extrapolated(plan.vehicle, plan.envelope, *plan.speeds)
    if not reasons or plan.clearance_m is None:
        return plan
    if request.trusts_model:
        others = tuple(warning for warning in plan.warnings if warning not in reasons)
        return replace(plan, extrapolated=reasons, warnings=others, info=(*plan.info, *reasons, _TRUSTED))
    warnings = (*dict.fromkeys((*plan.warnings, *reasons)), _NOTHING)
    return replace(plan, clearance_m=None, extrapolated=reasons, warnings=warnings)
