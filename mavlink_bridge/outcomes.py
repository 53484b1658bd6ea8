"""Outcomes of transfers in words: what people are told, and which error it is."""

from __future__ import annotations

from typing import TYPE_CHECKING

from mavlink_bridge.errors import BridgeError, LinkError, OutcomeError, RefusedError
from mavlink_bridge.messages import MissionResult
from mavlink_bridge.protocol.verified_upload import Held, OutcomeKind

if TYPE_CHECKING:
    from mavlink_bridge.protocol.verified_upload import VerifiedUploadOutcome

_HELD = {
    Held.WANTED: "the new list is on the vehicle",
    Held.OLD: "the list that was there before is on the vehicle, unchanged",
    Held.UNFINISHED: "a mix of the old and the new list is on the vehicle: do not drive it",
    Held.FOREIGN: "a list that is neither ours nor the old one is on the vehicle",
    Held.UNKNOWN: "what is on the vehicle now is not known: do not drive before it is read back",
}


def held_text(held: Held) -> str:
    """Return what a vehicle holds after an upload, for people."""
    return _HELD[held]


def upload_trouble(outcome: VerifiedUploadOutcome) -> BridgeError | None:
    """Give the error that an upload's outcome is; None for a verified one."""
    if outcome.is_verified:
        return None
    details = {"outcome": str(outcome.kind), "held": str(outcome.held), "item": outcome.item}
    held = _HELD[outcome.held]
    texts = "".join(f"; {text}" for text in outcome.texts)
    if outcome.kind is OutcomeKind.REFUSED:
        result = outcome.result.name if outcome.result is not None else "no reason"
        item = "" if outcome.item is None else f" at item {outcome.item}"
        return RefusedError(
            f"the vehicle refused the upload{item}: {result}{texts}; {held}", result=result, **details
        )
    if outcome.kind is OutcomeKind.BUSY:
        return RefusedError(f"another ground station keeps the list busy (DENIED); {held}", **details)
    if outcome.kind is OutcomeKind.ACTIVE:
        return RefusedError(
            "the vehicle is armed and drives its mission in AUTO; nothing was written. Switch it to HOLD first",
            **details,
        )
    if outcome.kind is OutcomeKind.NO_ANSWER:
        return LinkError("the vehicle does not answer; nothing was written", **details)
    differences = "".join(f"; {difference}" for difference in outcome.differences[:3])
    return OutcomeError(f"the upload ended {outcome.kind}: {held}{differences}{texts}", **details)


def download_refusal(what: str, result: MissionResult) -> RefusedError:
    """Give the error that a refused download of a list is; an autopilot that does not know such lists may hold one all the same."""
    why = ""
    if what != "mission" and result is MissionResult.UNSUPPORTED:
        older = "; one that it has by the older FENCE_POINT messages is not read" if what == "fence" else ""
        why = f" (this autopilot transfers no {what} as mission items{older})"
    return RefusedError(f"the vehicle refused to give its {what}: {result.name}{why}", result=result.name)
