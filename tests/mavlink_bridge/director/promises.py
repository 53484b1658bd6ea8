"""What the bridge promises, checked on every message it sends: whatever others do, and whatever the link loses."""

from __future__ import annotations

from typing import TYPE_CHECKING

from mavlink_bridge.director import State
from mavlink_bridge.mavlink import messages as m
from mavlink_bridge.mavlink.rover import Mode
from missions.items import Command

if TYPE_CHECKING:
    from director.conducting import Conductor

ON_ITS_WAY_S = 0.55
"""What is overheard so soon after a target may have been on its way before it."""

SLOWEST_LINK_S = 0.3
"""A heartbeat that comes sooner after a takeover may tell what was before it."""


class Promises:
    """Looks at what reaches the director and at what it sends; collects broken promises.

    Parameters
    ----------
    run : Conductor
        The director and its vehicle.
    """

    def __init__(self, run: Conductor) -> None:
        self.broken: list[str] = []
        self._run = run
        self._mode: int | None = None
        self._is_armed = False
        self._heartbeats = 0
        self._has_clashed = False
        self._was_clashing = False  # when it last sent: an upload that has ended since leaves its last words
        self._took: tuple[float, int | None] | None = None  # when, and to which mode
        self._knows = False
        self._asked_s = -1e9
        self._last_auto_heartbeats = -1
        self._texts_s = -1e9
        receive, messages_to_send = run.director.receive, run.director.messages_to_send

        def listen(frame: m.Frame, now_s: float) -> None:
            self._hear(frame, now_s)
            receive(frame, now_s)

        def send() -> list[m.Message]:
            messages = messages_to_send()
            for message in messages:
                self._check(message)
            self._was_clashing = run.director.state is State.CLASHING
            return messages

        run.director.receive = listen
        run.director.messages_to_send = send

    # What others do

    def clashed(self) -> None:
        """Take notice that somebody speaks with our ids: from now on HOLD, and an upload's end, are all there may be until a target is typed."""
        self._has_clashed = True

    def typed(self) -> None:
        """Take notice that somebody types a target."""
        self._has_clashed = False

    def asked(self) -> None:
        """Take notice that somebody gives a target: it is the bridge's turn again."""
        self._took, self._knows = None, False
        self._asked_s = self._run.now_s

    def taken_over(self, mode: int | None) -> None:
        """Take notice that somebody switches to a mode; None for disarming or switching off."""
        # A heartbeat cannot tell of a mode that it told of before.
        shown = None if mode == self._run.vehicles[0].mode else mode
        self._took, self._knows = (self._run.now_s, shown), False

    def _hear(self, frame: m.Frame, now_s: float) -> None:
        message = frame.message
        if isinstance(message, m.Heartbeat) and (frame.system, frame.component) == (1, 1):
            self._mode = message.custom_mode
            self._is_armed = bool(message.base_mode & m.ModeFlag.SAFETY_ARMED)
            self._heartbeats += 1
            self._learn_of_takeover(now_s)
        elif isinstance(message, m.SetMode) and self._took is not None:
            self._knows = self._knows or now_s - self._asked_s > ON_ITS_WAY_S

    def _learn_of_takeover(self, now_s: float) -> None:
        if self._took is None or now_s - self._took[0] < SLOWEST_LINK_S:
            return
        mode = self._took[1]
        # HOLD by somebody looks like our own; GUIDED right after a click may be the click's.
        shows_mode = mode not in (None, Mode.HOLD, Mode.GUIDED) and self._mode == mode
        self._knows = self._knows or shows_mode

    # What the bridge sends

    def _check(self, message: m.Message) -> None:
        orders = self._run.director.orders
        self._check_clashed(message)
        if isinstance(message, m.Statustext):
            if self._run.now_s - self._texts_s < 0.99:
                self._break("two texts within a second")
            self._texts_s = self._run.now_s
        elif isinstance(message, m.MissionCount) and message.mission_type == m.MissionType.MISSION:
            self._check_upload()
        elif isinstance(message, m.CommandLong):
            if message.command == Command.COMPONENT_ARM_DISARM:
                self._check_taken_over("arming")
                if not orders.arm:
                    self._break("armed unasked")
                if message.param1 != 1.0:
                    self._break("disarmed")
            elif message.command == Command.DO_SET_MODE:
                self._check_mode(int(message.param2))

    def _check_clashed(self, message: m.Message) -> None:
        if not self._has_clashed or isinstance(message, m.Statustext | m.CommandAck):
            return
        is_hold = isinstance(message, m.CommandLong) and (message.command, message.param2) == (
            Command.DO_SET_MODE,
            Mode.HOLD,
        )
        is_uploads_end = isinstance(message, m.MissionAck | m.MissionRequestInt) and self._was_clashing
        if is_uploads_end or self._run.director.state is State.CLASHING or is_hold:
            return
        self._break(f"{type(message).__name__} after somebody spoke with our ids")

    def _check_mode(self, mode: int) -> None:
        self._check_taken_over(f"mode {mode}")
        if not self._run.director.orders.drive:
            self._break("a mode change without orders to drive")
        if mode not in (Mode.HOLD, Mode.AUTO):
            self._break(f"mode {mode} is none of ours")
        if mode != Mode.AUTO:
            return
        if self._mode != Mode.HOLD:
            self._break(f"AUTO though the last heartbeat said mode {self._mode}")
        if self._heartbeats == self._last_auto_heartbeats:
            self._break("AUTO twice without a heartbeat in between")
        self._last_auto_heartbeats = self._heartbeats
        outcome = self._run.director.upload_outcome
        if outcome is None or not outcome.is_verified:
            self._break("AUTO without a verified mission")

    def _check_upload(self) -> None:
        if not self._run.director.orders.upload:
            self._break("an upload without orders to")
        if self._run.director.state is State.WITHDRAWING:
            return  # no half mission is left behind
        if self._mode == Mode.AUTO and self._is_armed:
            self._break("an upload under a vehicle that drives")

    def _check_taken_over(self, what: str) -> None:
        if self._knows:
            self._break(f"{what} after somebody took over")

    def _break(self, what: str) -> None:
        self.broken.append(f"{self._run.now_s:.2f} s, {self._run.director.state}: {what}")
