"""The part of the director that leaves the vehicle to the operator: the operator's word always counts more than ours."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

from mavlink_bridge.director import clash
from mavlink_bridge.director.core import Core, Part
from mavlink_bridge.director.events import EventName
from mavlink_bridge.director.incidents import Incidents
from mavlink_bridge.director.put_back import PutBack
from mavlink_bridge.director.starter import START_YOURSELF
from mavlink_bridge.director.states import ON_VEHICLE, Cue, Notice, Signal, State
from mavlink_bridge.director.steps import step
from mavlink_bridge.director.takeover import Takeover, account_of
from mavlink_bridge.errors import OutcomeError
from mavlink_bridge.mavlink import messages as m

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from mavlink_bridge.director.drive_supervisor import DriveSupervisor
    from mavlink_bridge.director.halter import Halter
    from mavlink_bridge.director.home_caller import HomeCaller
    from mavlink_bridge.mavlink.messages import Frame


class HandOver(Part):
    """Notices who else has the vehicle, and tells of it.

    Attributes
    ----------
    incidents : Incidents
        What the autopilot tells of breaches and failsafes.
    taken : Takeover or None
        What was done that is not told yet; None where the vehicle itself was not taken, but its mission.
    was_in_auto_by_us : bool
        Whether it was in AUTO by our doing when it was last heard, before the link was lost.
    why_held : str
        Who asked for the newest HOLD at a page of ours.
    """

    def __init__(self, core: Core, halter: Halter, driver: DriveSupervisor, caller: HomeCaller) -> None:
        super().__init__(core)
        self._caller = caller
        self._halter = halter
        self._driver = driver
        self.incidents = Incidents(core.voice, core.orders.request)
        self.taken: Takeover | None = None
        self.was_in_auto_by_us = False
        self.why_held = ""
        self._after_withdrawing: OutcomeError | None = None

    def receive(self, frame: Frame, now_s: float) -> Iterable[Signal]:
        """Look at what the vehicle shows and what others ask of it."""
        core = self.core
        self.incidents.autopilot = core.autopilot
        if core.is_from_vehicle(frame):
            self.incidents.receive(frame.message, core.situation, now_s)
        if core.state in clash.CLASHES:
            return []
        if core.is_from_vehicle(frame):
            return (
                self._take_heartbeat(frame.message, now_s) if isinstance(frame.message, m.Heartbeat) else []
            )
        return self._overhear(frame, now_s)

    def _take_heartbeat(self, heartbeat: m.Heartbeat, now_s: float) -> Iterable[Signal]:
        core = self.core
        taken = core.operator.take_heartbeat(heartbeat, now_s)
        if taken is not None and self._driver.has_ended(taken, now_s):
            return [Cue.REACHED]
        if taken is None and self._driver.is_unarmed(now_s):
            taken = Takeover(None)
        if taken is not None:
            return self._let_go(taken, now_s)
        if core.operator.is_late_click(heartbeat, now_s) and self._halter.stopping is None:
            self._halter.command_hold(now_s)
        elif core.state in ON_VEHICLE and not core.orders.drive and core.is_driving_ours:
            return self._driver.resume("somebody else started the mission")
        if self._caller.sees_rtl(heartbeat.custom_mode):
            taken = Takeover(heartbeat.custom_mode, shows_failsafe=core.operator.shows_failsafe(heartbeat))
            return self._caller.answer(taken, now_s, by_autopilot=self._is_by_autopilot(taken, now_s)) or []
        return []

    def _is_by_autopilot(self, taken: Takeover, now_s: float) -> bool:
        """Return whether the autopilot is known to have done it by a failsafe or a breach."""
        return taken.asker is None and self.incidents.explains(taken, now_s)

    def _overhear(self, frame: Frame, now_s: float) -> Iterable[Signal]:
        peer = self.core.peer
        if peer is None or (frame.system, frame.component) == self.core.identity:
            return []
        taken = self.core.operator.overhear(frame, peer.system, peer.component, now_s)
        return self._let_go(taken, now_s) if taken is not None else []

    def _let_go(self, taken: Takeover, now_s: float) -> Sequence[Signal]:
        """Return that the vehicle was taken; an RTL may be answered by a way home."""
        core = self.core
        by_autopilot = self._is_by_autopilot(taken, now_s)
        if (answer := self._caller.answer(taken, now_s, by_autopilot=by_autopilot)) is not None:
            return answer
        if core.state is State.ARRIVED and core.orders.once:
            return [Notice.DRIVE_ENDED]  # it has arrived; whoever has it now
        if not core.heeds(Cue.TAKEN_OVER):
            return []
        if self._is_refusal(taken, now_s):
            return [Notice.MISSION_INVALID]
        self.taken = taken
        return [Cue.TAKEN_OVER]

    def _is_refusal(self, taken: Takeover, now_s: float) -> bool:
        """Return whether the autopilot itself has held a drive of ours for a mission that it does not take any more: its fence is another one than ours."""
        core = self.core
        is_ours = core.state is State.DRIVING and core.orders.drive and taken.asker is None
        return is_ours and taken.mode == core.modes.hold and self.incidents.refuses_mission(now_s)

    def hold_asked(self, reason: str) -> Sequence[Signal]:
        """Return that a person at a page of ours stops the vehicle: all that was wanted is let go of, as where somebody takes over."""
        core = self.core
        if core.peer is None or not core.orders.drive:
            return []
        self.taken, self.why_held = None, reason
        return [Cue.TAKEN_OVER, Notice.HOLD_ASKED]

    def account_for(
        self, taken: Takeover, so_far: str, now_s: float, *, was_in_auto: bool
    ) -> Sequence[Signal]:
        """Report who took the vehicle; the state has moved, and nothing is wanted any more.

        Parameters
        ----------
        taken : Takeover
            What was done.
        so_far : str
            How the drive went until then, in words that follow others.
        now_s : float
            When.
        was_in_auto : bool
            Whether it may be in the AUTO that we switched it to.
        """
        core = self.core
        self.taken = None
        is_withdrawing = core.state is State.WITHDRAWING
        then = "the upload is finished first" if is_withdrawing else "waiting for a new target"
        cause = self.incidents.cause_of(taken, now_s)
        account = account_of(taken, cause, self.incidents.heard_before(now_s), core.modes)
        mode = core.modes.words(core.situation.mode if taken.mode is None else taken.mode)
        text = f"{account.text}; {then}"
        core.voice.tell(now_s, EventName.TAKEN_OVER, text, mode, str(account.by), account.reason)
        trouble = OutcomeError(f"{account.text}, before it arrived{so_far}", mode=mode)
        if is_withdrawing:
            self._after_withdrawing = trouble
        elif taken.mode is None and was_in_auto:
            self._put_back(str(trouble), now_s)
        else:
            return core.give_up(trouble)
        return []

    def withdrawn(self) -> Sequence[Signal]:
        """Return what follows from a takeover once the upload under way has ended."""
        trouble, self._after_withdrawing = self._after_withdrawing, None
        return self.core.give_up(trouble) if trouble is not None else []

    # A vehicle that was disarmed in our AUTO

    def note_silence(self) -> None:
        """Remember of a vehicle that has fallen silent whether it is in AUTO by our doing; what is under way is dropped after that."""
        is_in_auto_by_us = self._halter.may_be_in_auto or self._driver.is_our_drive
        self.was_in_auto_by_us = self.was_in_auto_by_us or is_in_auto_by_us

    def put_back_after_silence(self, now_s: float) -> None:
        """Take a vehicle that is heard again out of our AUTO, where it was disarmed meanwhile."""
        was_in_auto_by_us, self.was_in_auto_by_us = self.was_in_auto_by_us, False
        situation = self.core.situation
        if was_in_auto_by_us and situation.mode == self.core.modes.mission and not situation.armed:
            self._put_back("the vehicle was disarmed while the link was lost", now_s)

    def _put_back(self, what: str, now_s: float) -> None:
        """Take the vehicle, disarmed now, out of the AUTO that we switched it to."""
        assert self.core.peer is not None
        self.core.steps.run([step(PutBack(self.core.peer), partial(self._was_put_back, what))], now_s)

    def _was_put_back(self, what: str, machine: PutBack, now_s: float) -> Sequence[Signal]:
        if machine.is_left_in_auto:
            text = f"{what}, and it did not switch to HOLD: it is in AUTO, where arming it makes it drive"
        elif machine.was_needed:
            text = f"{what}; it was switched back from AUTO to HOLD, so that arming it does not make it drive"
        else:
            text = what
        trouble = OutcomeError(
            text, advice=START_YOURSELF, mode=self.core.modes.words(self.core.situation.mode)
        )
        if machine.was_needed:
            self.core.voice.error(now_s, EventName.TROUBLE, trouble, dict(trouble.details))
        return self.core.give_up(trouble)
