"""What a safe upload concludes from what it read and was answered: pure functions."""

from __future__ import annotations

from typing import TYPE_CHECKING

from mavlink_bridge.mavlink.messages import MissionResult
from mavlink_bridge.mavlink.stored_form import differences, is_same_item, is_unfinished_write
from mavlink_bridge.protocol.transitions import UploadState
from mavlink_bridge.protocol.verified_outcome import Held

if TYPE_CHECKING:
    from collections.abc import Sequence

    from mavlink_bridge.mavlink.autopilots import ListRules
    from mavlink_bridge.mavlink.messages import MissionType
    from mavlink_bridge.protocol.upload import UploadOutcome
    from missions.items import MissionItem


def held_list(
    found: Sequence[MissionItem],
    wanted: Sequence[MissionItem],
    old: Sequence[MissionItem],
    mission_type: MissionType,
    lists: ListRules,
    *,
    coarse: bool,
) -> Held:
    """Return which list was found: the wanted one, the old one, our unfinished write of one over the other, or a foreign one."""
    if not differences(wanted, found, mission_type, lists.form, coarse=coarse):
        return Held.WANTED
    if not differences(old, found, mission_type, lists.form, coarse=coarse):
        return Held.OLD
    if lists.is_atomic:
        is_unfinished = _is_cut_short(found, wanted, mission_type, lists)
    else:
        is_unfinished = is_unfinished_write(found, old, wanted, mission_type, coarse=coarse)
    return Held.UNFINISHED if is_unfinished else Held.FOREIGN


def _is_cut_short(
    found: Sequence[MissionItem], wanted: Sequence[MissionItem], mission_type: MissionType, lists: ListRules
) -> bool:
    """Return whether only the first items of the wanted list are there: where MISSION_COUNT of an earlier upload still counted, PX4 takes no more."""
    return 0 < len(found) < len(wanted) and all(
        is_same_item(a, b, mission_type, lists.form) for a, b in zip(found, wanted, strict=False)
    )


def is_settled_refusal(pushed: UploadOutcome, before: UploadOutcome | None) -> bool:
    """Return whether the vehicle surely refuses the list, so that there is no use in sending it again.

    ERROR also answers an item that nobody waits for (after a reboot, say): it must come twice. And with several items under way the refused one is
    not certain. Serving the items one by one settles both.
    """
    if pushed.state is not UploadState.REFUSED or not pushed.item_is_certain:
        return False
    return pushed.result is not MissionResult.ERROR or _is_same(pushed, before)


def _is_same(a: UploadOutcome, b: UploadOutcome | None) -> bool:
    return b is not None and (a.state, a.result, a.item) == (b.state, b.result, b.item)
