"""The fence that is known of a vehicle: which one counts, and the remarks about it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from missions.errors import FenceMissingError
from missions.situation import ListKind
from missions.vehicle import Autopilot, known_ardupilot

if TYPE_CHECKING:
    from missions.fence import Fence
    from missions.situation import Situation
    from missions.vehicle import Vehicle

_TOTAL = "FENCE_TOTAL"
_STATIONS = {
    True: "MAVProxy: fence list; Mission Planner, QGroundControl: download in the Plan view",
    False: "QGroundControl: download in the Plan view",
}
"""How a fence is downloaded, by whether the autopilot is ArduPilot."""


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
        how = _STATIONS[known_ardupilot(situation) is not False]
        raise FenceMissingError(
            f"no fence to plan around: {trouble}. Download the fence from the vehicle in the ground station ({how}) while the log is recorded, "
            "or use a fence file (--fence FILE)"
        )
    if not known.value.zones:
        raise FenceMissingError(f"no fence to plan around: the fence from {known.source} is empty")
    return known.value


def _never_seen(situation: Situation) -> str:
    """Return why no fence is known: none was seen, though the vehicle may report that it holds one."""
    total = situation.parameters.get(_TOTAL, 0.0)
    if not total > 0:
        return "no fence was uploaded or downloaded"
    return (
        f"the vehicle holds a fence of {total:g} points ({_TOTAL}), but it was not sent as mission items "
        "(older autopilots and ground stations use FENCE_POINT messages, which are not supported)"
    )


def fence_trouble(situation: Situation) -> str | None:
    """Return why the newest fence that was seen cannot be used; None where it can be."""
    if situation.fence_trouble:
        return f"a fence was sent but cannot be used ({situation.fence_trouble})"
    for to_vehicle in (True, False):
        transfer = situation.transfers.get((ListKind.FENCE, to_vehicle))
        if transfer is None:
            continue
        what = "upload" if to_vehicle else "download"
        if transfer.is_complete:
            return f"a fence {what} of {transfer.count} items was not acknowledged (MISSION_ACK)"
        of = "an unknown number of" if transfer.count is None else transfer.count
        return f"a fence {what} is incomplete ({len(transfer.items)} of {of} items)"
    return None


def fence_warnings(vehicle: Vehicle, situation: Situation) -> list[str]:
    """Warn of a newer fence that could not be used, and of one that the autopilot does not enforce."""
    trouble = fence_trouble(situation)
    warnings = [f"{trouble}; an older fence is used"] if trouble else []
    if vehicle.fence.enforces_zones or not situation.parameters:
        return warnings
    if vehicle.autopilot is Autopilot.PX4:
        reason = "GF_ACTION is 0"
    elif vehicle.fence.enabled:
        reason = "FENCE_TYPE bit 2 (value 4) is not set"
    elif any(assumed.parameter == "FENCE_ENABLE" for assumed in vehicle.assumed):
        reason = "FENCE_ENABLE unknown, default 0"
    else:
        reason = "FENCE_ENABLE is 0"
    return [
        *warnings,
        f"the autopilot does not enforce this fence ({reason}); it is used here anyway",
    ]
