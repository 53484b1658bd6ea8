"""The fence that is known of a vehicle: which one counts, and the remarks about it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from missions.errors import FenceMissingError
from missions.situation import ListKind

if TYPE_CHECKING:
    from missions.fence import Fence
    from missions.situation import Situation
    from missions.vehicle import Vehicle

_TOTAL = "FENCE_TOTAL"
_ADVICE = (
    "Let the ground station read the fence from the vehicle (MAVProxy: fence list; Mission Planner, QGroundControl: "
    "download in the plan view) while the stream is recorded, or give a fence file (--fence)"
)


def known_fence(situation: Situation) -> Fence:
    """Return the fence to plan around.

    Raises
    ------
    FenceMissingError
        None is known, or it is empty; the message says why and what to do.
    """
    known = situation.fence
    if known is None:
        trouble = fence_trouble(situation) or _never_seen(situation)
        raise FenceMissingError(f"{trouble}: there is nothing to plan around. {_ADVICE}")
    if not known.value.zones:
        raise FenceMissingError(f"the fence from {known.source} is empty: there is nothing to plan around")
    return known.value


def _never_seen(situation: Situation) -> str:
    """Return why no fence is known: none was seen, though the vehicle may report that it holds one."""
    total = situation.parameters.get(_TOTAL, 0.0)
    if not total > 0:
        return "no fence was transferred"
    return (
        f"the vehicle holds a fence of {total:g} points ({_TOTAL}), but none was transferred as mission items "
        "(older autopilots and stations use FENCE_POINT messages, which are not read)"
    )


def fence_trouble(situation: Situation) -> str | None:
    """Return why the newest fence that was seen cannot be used; None where it can be."""
    if situation.fence_trouble:
        return f"a fence was transferred but is unusable ({situation.fence_trouble})"
    for to_vehicle in (True, False):
        transfer = situation.transfers.get((ListKind.FENCE, to_vehicle))
        if transfer is None:
            continue
        what = "upload" if to_vehicle else "read-back"
        if transfer.is_complete:
            return f"a fence {what} of {transfer.count} items was seen, but not that the vehicle accepted it"
        of = "an unknown number of" if transfer.count is None else transfer.count
        return f"a fence {what} was seen only in part ({len(transfer.items)} of {of} items)"
    return None


def fence_warnings(vehicle: Vehicle, situation: Situation) -> list[str]:
    """Warn of a newer fence that could not be used, and of one that the autopilot does not enforce."""
    trouble = fence_trouble(situation)
    warnings = [f"{trouble}, so an older one counts"] if trouble else []
    if vehicle.fence.enforces_zones or not situation.parameters:
        return warnings
    if vehicle.fence.enabled:
        reason = "FENCE_TYPE has no bit 2 (value 4)"
    elif any(assumed.parameter == "FENCE_ENABLE" for assumed in vehicle.assumed):
        reason = "FENCE_ENABLE is not known, and 0 by default"
    else:
        reason = "FENCE_ENABLE is 0"
    return [
        *warnings,
        f"the autopilot does not enforce this fence ({reason}); the route honours it all the same",
    ]
