"""What an identity clash comes to: somebody else on the link speaks with our system and component id.

At the start another program has them by mistake, and is not disturbed: we end, and say which ids to choose. Later it may be anybody who forges a
frame, so that it must not end a bridge that drives. What the vehicle is told under our ids is then no longer ours alone, and neither is what it
answers: a drive of ours is held, an upload brought to its end, and nothing more is done until the operator types a target. A click comes by the
same link as the clash and counts for nothing.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum, auto
from typing import TYPE_CHECKING

from mavlink_bridge.director.states import State

if TYPE_CHECKING:
    from mavlink_bridge.mavlink.messages import Frame

CLASHES = frozenset({State.CLASHING, State.CLASHED})
"""States in which nobody but the operator's keyboard is heeded."""

_NOTHING_DONE = frozenset(
    {State.LEARNING, State.READY, State.PLANNING, State.PROPOSED, State.UPLOADING, State.LOST}
)
"""States of a single job before the first message that changes something on the vehicle, as long as no upload has begun to write."""

_DRIVEN = frozenset({State.STARTING, State.DRIVING})
_OUT_OF_SIGHT = frozenset({State.LEARNING, State.LOST})


class Answer(Enum):
    """What is done about a clash."""

    REFUSE = auto()
    HOLD = auto()
    LET_BE = auto()


@dataclass(frozen=True, slots=True)
class Circumstances:
    """What is under way when a clash is heard.

    Parameters
    ----------
    state : State
        The director's.
    is_start : bool
        Whether the vehicle was never learnt yet.
    is_single_job : bool
        Whether the director ends after one job.
    has_written : bool
        Whether anything was written on the vehicle in this run.
    may_drive : bool
        Whether the orders let us switch modes.
    drives_ours : bool
        Whether the vehicle, as far as is known, drives our mission.
    """

    state: State
    is_start: bool
    is_single_job: bool
    has_written: bool
    may_drive: bool
    drives_ours: bool

    @property
    def answer(self) -> Answer:
        """What is done."""
        is_undone = self.is_single_job and self.state in _NOTHING_DONE and not self.has_written
        if self.is_start or is_undone:
            return Answer.REFUSE
        is_out_of_sight = self.state in _OUT_OF_SIGHT and self.drives_ours
        return Answer.HOLD if self.may_drive and (self.state in _DRIVEN or is_out_of_sight) else Answer.LET_BE


def is_clash(frame: Frame, identity: tuple[int, int] | None) -> bool:
    """Return whether a frame that we did not send has our own ids."""
    return (frame.system, frame.component) == identity


def account(identity: tuple[int, int], answer: Answer, state: State, *, is_single_job: bool) -> str:
    """Return what is told of a clash: the state is the one that it led to."""
    parts = [f"another program on the link uses our ids (system {identity[0]} component {identity[1]})"]
    if answer is Answer.HOLD:
        parts.append("HOLD")
    elif state is State.CLASHING:
        parts.append("the upload is finished first")
    if not is_single_job:
        parts.append("waiting for a typed target; map clicks are ignored")
    return "; ".join(parts)
