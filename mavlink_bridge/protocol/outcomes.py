"""Outcomes of transfers in words: the messages for people, and which error it is.

However an upload ends, by its own outcome, a broken link, an interrupt, or a defect of ours, `end_of_upload` reports what may be on the vehicle
and where the old list lies. Every shell that writes lists passes what ended it through there.
"""

from __future__ import annotations

from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING

from mavlink_bridge.errors import BridgeError, DefectError, LinkError, OutcomeError, RefusedError
from mavlink_bridge.mavlink.messages import MissionResult
from mavlink_bridge.protocol.transitions import DownloadState
from mavlink_bridge.protocol.undisturbed_read import UndisturbedRead
from mavlink_bridge.protocol.verified_upload import Held, OutcomeKind
from missions.errors import MissionError

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
    from pathlib import Path

    from mavlink_bridge.protocol.download import Download
    from mavlink_bridge.protocol.parameters import SetParameter
    from mavlink_bridge.protocol.verified_upload import VerifiedUpload, VerifiedUploadOutcome
    from missions.items import MissionItem

_HELD = {
    Held.WANTED: "the new list is on the vehicle",
    Held.OLD: "the list that was there before is on the vehicle, unchanged",
    Held.UNFINISHED: "a mix of the old and the new list is on the vehicle: do not drive it",
    Held.FOREIGN: "a list that is neither ours nor the old one is on the vehicle",
    Held.UNKNOWN: "what is on the vehicle now is unknown: read it back before driving",
}
_BROKEN_OFF = "the vehicle may hold the old list, the new one, or part of both: read it back before driving"
_BROKEN_OFF_WHOLE = (
    "the vehicle holds the complete old list or the complete new one: read it back to know which"
)
_INTERRUPTED = "interrupted"


def held_text(held: Held) -> str:
    """Return what a vehicle holds after an upload, for people."""
    return _HELD[held]


def upload_trouble(outcome: VerifiedUploadOutcome) -> BridgeError | None:
    """Return the error that an upload's outcome is; None for a verified one."""
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
        why = "" if outcome.writer else "another ground station is transferring the list (DENIED)"
        return RefusedError(f"{why or _other_writer(outcome)}; {held}", **details)
    if outcome.kind is OutcomeKind.ACTIVE:
        return RefusedError(
            "the vehicle is armed and driving its mission in AUTO; nothing was written. Switch it to HOLD first",
            **details,
        )
    if outcome.kind is OutcomeKind.NO_ANSWER:
        why = outcome.shortfall or "the vehicle does not answer"
        return LinkError(f"{why}; nothing was written", **details)
    differences = "".join(f"; {difference}" for difference in outcome.differences[:3])
    why = "".join(f"; {text}" for text in (_other_writer(outcome), outcome.shortfall) if text)
    return OutcomeError(f"the upload failed ({outcome.kind}): {held}{why}{differences}{texts}", **details)


def _other_writer(outcome: VerifiedUploadOutcome) -> str:
    if outcome.writer is None:
        return ""
    system, component = outcome.writer
    return f"system {system} component {component} wrote to the list meanwhile"


@dataclass(frozen=True, slots=True)
class Writing:
    """An upload as its shell knows it.

    Parameters
    ----------
    name : str
        Which list: mission, fence or rally.
    machine : VerifiedUpload
        What uploads it.
    backup : Path, optional
        Where the old list is kept; None as long as it is not.
    """

    name: str
    machine: VerifiedUpload
    backup: Path | None

    @property
    def is_settled(self) -> bool:
        """Whether nothing was written, or the vehicle is known to hold the new list or the old one."""
        outcome = self.machine.outcome
        if not self.machine.has_written:
            return True
        # Kept busy all the while: the vehicle took nothing of ours.
        return outcome is not None and (
            outcome.is_verified or outcome.held is Held.OLD or outcome.kind is OutcomeKind.BUSY
        )

    @property
    def held(self) -> Held:
        """What the vehicle holds now, as far as that is known."""
        outcome = self.machine.outcome
        return outcome.held if outcome is not None else Held.UNKNOWN


@contextmanager
def ends_in_words(
    writing: Callable[[], Writing | None],
    verified: Sequence[str] = (),
    last_words: Callable[[], None] = lambda: None,
    causes: type[BaseException] = BaseException,
) -> Iterator[None]:
    """Run a block that writes lists to a vehicle; whatever ends it before its time ends as in `end_of_upload`.

    Parameters
    ----------
    writing : callable
        Returns the upload under way; asked when the block has ended so.
    verified : sequence of str
        The lists that are on the vehicle by this run, verified; read when the block has ended so.
    last_words : callable, optional
        Called in the end, however that is.
    causes : type of BaseException
        Which causes end so; others pass, because they do not end the upload: a link that is opened again.
    """
    try:
        yield
    except causes as cause:
        ended = end_of_upload(cause, writing(), verified)
        if ended is cause:
            raise
        raise ended from cause
    finally:
        last_words()


def end_of_upload(
    cause: BaseException, writing: Writing | None, verified: Sequence[str] = ()
) -> BaseException:
    """Return the error with which a run ends that is ended by ``cause``.

    Parameters
    ----------
    cause : BaseException
        What ended it: the error of the upload's own outcome, a broken link, an interrupt, a defect.
    writing : Writing, optional
        The upload that was under way or had just ended; None if none was.
    verified : sequence of str
        The lists that this run has put on the vehicle before, verified.

    Returns
    -------
    BaseException
        Where nothing was written, or the vehicle is known to hold the new list or the old one: the cause, an error of ours with the list's name.
        Otherwise an `OutcomeError`, or an interrupt, that says what may be on the vehicle and where the old list lies.
    """
    if isinstance(cause, KeyboardInterrupt) and cause.args:
        return cause  # it has its words already
    is_settled = writing is None or writing.is_settled
    is_ours = isinstance(cause, BridgeError)
    if is_settled and not verified and not (is_ours and writing is not None):
        return cause
    words = [_reason(cause)]
    details: dict[str, object] = dict(getattr(cause, "details", {}))
    if writing is not None:
        words[0] = f"{writing.name}: {words[0]}"
        details |= {"list": writing.name, "backup": str(writing.backup) if writing.backup else None}
        if not is_settled:
            words += _what_is_left(writing, words[0])
            details |= {"outcome": details.get("outcome", "unknown"), "held": str(writing.held)}
        elif verified and not writing.machine.has_written:
            words.append(f"the {writing.name} was not written")
    if verified:
        words[0] = words[0].replace("nothing was written", "nothing more was written")
        words.append(f"written and verified before: {', '.join(verified)}")
    keeps_kind = is_ours and is_settled and (not verified or isinstance(cause, RefusedError))
    return _ended(cause, "; ".join(words), details, keeps_kind=keeps_kind)


def _what_is_left(writing: Writing, said: str) -> list[str]:
    broken_off = _BROKEN_OFF_WHOLE if writing.machine.is_atomic else _BROKEN_OFF
    held = broken_off if writing.machine.outcome is None else _HELD[writing.held]
    if writing.backup is None:
        where = "the old list was not kept"
    else:
        where = (
            f"the old list is kept in {writing.backup}, `pbpp upload --restore {writing.backup}` puts it back"
        )
    return [where] if held in said else [held, where]


def end_of_parameters(
    cause: BaseException, setting: SetParameter | None, changed: Collection[str]
) -> BaseException:
    """Return the error with which setting parameters ends that is ended by ``cause``.

    Parameters
    ----------
    cause : BaseException
        What ended it.
    setting : SetParameter, optional
        What sets the newest one; None if none was begun.
    changed : collection of str
        The parameters that were set and confirmed before.

    Returns
    -------
    BaseException
        The cause itself where nothing was sent. Otherwise an `OutcomeError`, or an interrupt, that says what was set.
    """
    if setting is None:
        return cause
    words = [_reason(cause)]
    if setting.outcome is None:
        words.append(f"parameter {setting.name} may be set or not: read it back")
    words.append(f"set before it: {', '.join(changed) or 'none'}")
    details = {**getattr(cause, "details", {}), "parameter": setting.name, "changed": list(changed)}
    return _ended(cause, "; ".join(words), details)


def _reason(cause: BaseException) -> str:
    if isinstance(cause, KeyboardInterrupt):
        return _INTERRUPTED
    if isinstance(cause, (BridgeError, MissionError)):
        return str(cause)
    if isinstance(cause, OSError):
        return f"{cause.strerror or cause}" + (f" ({cause.filename})" if cause.filename else "")
    return "the upload broke off"


def _ended(
    cause: BaseException, message: str, details: Mapping[str, object], *, keeps_kind: bool = False
) -> BaseException:
    ended: BaseException
    if isinstance(cause, KeyboardInterrupt):
        ended = type(cause)(message)  # a SIGTERM stays one
    elif keeps_kind and isinstance(cause, BridgeError):
        ended = type(cause)(message, **details)
    elif isinstance(cause, (BridgeError, MissionError, OSError)):
        ended = OutcomeError(message, **details)
    else:
        ended = DefectError(message, **details)
    ended.__cause__ = cause
    return ended


def list_read(machine: Download | UndisturbedRead, what: str) -> tuple[MissionItem, ...] | BridgeError:
    """Return what a finished reading of a list brought, or the error that it is."""
    outcome = machine.outcome
    assert outcome is not None
    if isinstance(machine, UndisturbedRead) and machine.is_disturbed:
        return RefusedError(f"another station keeps writing the {what}: it changed while it was read")
    if outcome.is_complete:
        return outcome.items
    if outcome.state is DownloadState.BUSY:
        return RefusedError(f"another ground station is transferring the {what} (DENIED)", result="DENIED")
    if outcome.result is not None:
        return _download_refusal(what, outcome.result)
    return LinkError(f"the {what} could not be read: {outcome.shortfall}")


def _download_refusal(what: str, result: MissionResult) -> RefusedError:
    """Return the error that a refused download of a list is; an autopilot that does not know such lists may hold one all the same."""
    why = ""
    if what != "mission" and result is MissionResult.UNSUPPORTED:
        older = "; a fence stored with the older FENCE_POINT messages is not read" if what == "fence" else ""
        why = f" (this autopilot transfers no {what} as mission items{older})"
    return RefusedError(f"the vehicle refused to send its {what}: {result.name}{why}", result=result.name)
