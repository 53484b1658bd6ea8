"""The part of the director that answers an identity clash (see `clash`), until the operator types a target."""

from __future__ import annotations

from typing import TYPE_CHECKING

from mavlink_bridge.director import clash
from mavlink_bridge.director.core import Core, Part
from mavlink_bridge.director.events import EventName
from mavlink_bridge.director.put_back import PutBack
from mavlink_bridge.director.states import Cue, Signal, State
from mavlink_bridge.mavlink import messages as m
from mavlink_bridge.protocol.find import identity_shared, identity_taken

if TYPE_CHECKING:
    from collections.abc import Sequence

    from mavlink_bridge.director.halter import Halter
    from mavlink_bridge.director.learner import Learner
    from mavlink_bridge.director.mission_writer import MissionWriter
    from mavlink_bridge.director.target_inbox import TargetInbox
    from mavlink_bridge.mavlink.messages import Frame


class IdentityGuard(Part):
    """Does what a clash asks for, once until it is settled by a typed target."""

    def __init__(
        self, core: Core, learner: Learner, halter: Halter, inbox: TargetInbox, writer: MissionWriter
    ) -> None:
        super().__init__(core)
        self._learner = learner
        self._halter = halter
        self._inbox = inbox
        self._writer = writer
        self._answer = clash.Answer.LET_BE

    def is_clash(self, frame: Frame) -> bool:
        """Return whether a frame has our own ids, and says nothing but that somebody else uses them."""
        is_heeded = self.core.state is State.LISTENING or self.core.orders.passive
        return not is_heeded and clash.is_clash(frame, self.core.identity)

    def take_clash(self, now_s: float) -> Sequence[Signal]:
        """Return what a clash leads to."""
        core, identity = self.core, self.core.identity
        if identity is None or core.is_done or core.steps.runs(PutBack):  # that first: it takes seconds
            return []
        answer = clash.Circumstances(
            core.state,
            is_start=self._learner.is_first_time,
            is_single_job=core.orders.once,
            has_written=self._writer.has_written,
            may_drive=core.orders.drive,
            drives_ours=core.is_driving_ours,
        ).answer
        if answer is clash.Answer.REFUSE:
            core.steps.clear()
            return self._learner.refuse(identity_taken(identity), now_s)
        if not core.heeds(Cue.CLASH) or (core.state is State.CLASHING and self._inbox.waiting is None):
            return []
        self._answer = answer
        return [Cue.CLASH]

    def answer(self, now_s: float) -> Sequence[Signal]:
        """Hold the vehicle where the clash asks for it, and tell; nothing else is wanted or under way any more, but for an upload."""
        core, halter = self.core, self._halter
        is_holding = halter.stopping is not None
        if is_holding:
            halter.expect_hold()
        elif self._answer is clash.Answer.HOLD:
            halter.command_hold(now_s)
            is_holding = True
        identity = core.identity or (0, 0)
        text = clash.account(identity, self._answer, core.state, is_single_job=core.orders.once)
        core.voice.tell(now_s, EventName.IDENTITY_CLASH, text, *identity, is_holding)
        return self.settle("nothing more is done") if core.state is State.CLASHED else []

    def receive(self, frame: Frame, now_s: float) -> Sequence[Signal]:
        """Leave the vehicle to whoever takes it while our HOLD is under way."""
        core, halter = self.core, self._halter
        is_watched = core.state in clash.CLASHES and core.is_from_vehicle(frame)
        if not is_watched or not isinstance(frame.message, m.Heartbeat) or halter.stopping is None:
            return []
        if core.operator.take_heartbeat(frame.message, now_s) is None:
            return []
        halter.stopping = None
        return self.settle("another station has taken over the vehicle; the mission is on it")

    def hold_ended(self) -> Sequence[Signal]:
        """Go on from a HOLD that was taken, or was not."""
        done = "was switched to HOLD" if self._halter.is_hold_granted else "did not switch to HOLD"
        return self.settle(f"the vehicle {done}; the mission is on it")

    def settle(self, then: str) -> Sequence[Signal]:
        """Go on from a clash once nothing is under way any more: to the end of a single job, else to a target that is typed."""
        core = self.core
        if self._halter.stopping is not None:
            return []
        if self._inbox.waiting is not None:
            return self._inbox.take_waiting()
        if core.orders.once and (core.orders.drive or self._writer.outcome is None):
            return core.give_up(identity_shared(core.identity or (0, 0), then))
        return core.end()
