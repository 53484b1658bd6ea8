"""The mark of a plan whose drive lies outside what was measured: it promises nothing, unless the drive model is to be trusted there too."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from missions.drive_model import extrapolated
from missions.errors import ExtrapolatedError
from missions.items import Command

if TYPE_CHECKING:
    from missions.planned import Plan
    from missions.request import Request

_NOTHING = "the drive is extrapolated beyond what was measured: no clearance is promised (--trust-model promises it anyway)"
_TRUSTED = "the drive is extrapolated beyond what was measured; clearance is promised anyway (--trust-model)"


def unpromised(plan: Plan) -> ExtrapolatedError | None:
    """Return why a plan is not to be taken to a vehicle: it was to promise something, and lies outside what was measured."""
    if not plan.extrapolated or plan.clearance_m is not None:
        return None
    return ExtrapolatedError(
        f"not uploaded: the drive is extrapolated beyond what was measured, and no clearance is promised: {'; '.join(plan.extrapolated)}",
        extrapolated=list(plan.extrapolated),
    )


def marked(plan: Plan, request: Request) -> Plan:
    """Return a plan with what lies outside the measurements, and without its promise where something does."""
    loiters = any(item.command == Command.NAV_LOITER_UNLIM for item in plan.items)
    reasons = extrapolated(plan.vehicle, plan.envelope, *plan.speeds, ends_in_loiter=loiters)
    if not reasons or plan.clearance_m is None:
        return plan
    if request.trusts_model:
        others = tuple(warning for warning in plan.warnings if warning not in reasons)
        return replace(plan, extrapolated=reasons, warnings=others, info=(*plan.info, *reasons, _TRUSTED))
    warnings = (*dict.fromkeys((*plan.warnings, *reasons)), _NOTHING)
    keeps = replace(plan.keeps, promised_m=None, start_m=None)
    return replace(plan, keeps=keeps, extrapolated=reasons, warnings=warnings)
