"""Who has the vehicle: telling what somebody else did to its mode or arming from what we did ourselves.

The vehicle's own heartbeat tells of any takeover, also by remote control; a ground station's command that is overheard tells sooner, and tells
apart a HOLD that somebody pressed from our own.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from mavlink_bridge.director.takeover import Takeover
from mavlink_bridge.mavlink import messages as m
from mavlink_bridge.mavlink.modes import ARDUPILOT_MODES, Modes
from mavlink_bridge.protocol.wire import INT32_MAX
from missions.items import Command

if TYPE_CHECKING:
    from mavlink_bridge.mavlink.messages import Frame, Message

_STALE_S = 1.5
"""For so long after a mode change was accepted a heartbeat may still show what was before."""

_OVERTAKEN_S = 0.3
"""For so long after our mode was first shown a heartbeat from before may still come: one that was overtaken on the way."""

_ON_ITS_WAY_S = 0.5
"""What is overheard so soon after a target was typed may have been said before it."""

_CLICK_S = 1.5
"""A ground station's GUIDED within this time of its go-to click is part of the click."""

_CHANGES_MODE = 1  # MAV_DO_REPOSITION_FLAGS_CHANGE_MODE

_CRITICAL = 5  # MAV_STATE_CRITICAL

_LATE_CLICK_S = 3.0
"""A click that came to us at once may come to the vehicle so much later, by a radio that repeats it; chosen, not measured."""


class OperatorWatch:
    """Knows in which mode the vehicle is by our doing, and tells what is not.

    Attributes
    ----------
    modes : Modes
        Those of the vehicle's autopilot.
    clicks_are_targets : bool
        Whether a go-to click that is overheard is a target of ours, and so nobody's taking over.
    """

    def __init__(self) -> None:
        self.modes: Modes = ARDUPILOT_MODES
        self.clicks_are_targets = False
        self._ours: int | None = None
        self._fading: frozenset[int] = frozenset()
        self._fading_until_s = math.inf
        self._was_armed = False
        self._asked_s = self._clicked_s = -math.inf

    @property
    def is_on(self) -> bool:
        """Whether anything is watched for."""
        return self._ours is not None

    def is_ours(self, mode: int | None) -> bool:
        """Return whether a mode is the one that the vehicle is in by our doing."""
        return mode == self._ours

    def expect(self, mode: int | None, fading: set[int | None], *, is_armed: bool) -> None:
        """Watch for anything but a mode; the fading ones may show until it was seen or `settle` says how long."""
        self._ours = mode
        self._fading = frozenset(one for one in fading if one is not None) - {mode}
        self._fading_until_s = math.inf
        self._was_armed = self._was_armed or is_armed

    def settle(self, now_s: float) -> None:
        """Take notice that our mode was accepted: the ones before may only show a little longer."""
        self._fading_until_s = now_s + _STALE_S

    def stop(self) -> None:
        """Watch no more."""
        self._ours = None
        self._was_armed = False

    def take_target(self, now_s: float, *, is_click: bool) -> None:
        """Take notice of a target, a new one or one said again: what was on its way before it was typed does not revoke it."""
        if is_click:
            self._clicked_s = now_s
        else:
            self._asked_s = now_s

    def take_heartbeat(self, heartbeat: m.Heartbeat, now_s: float) -> Takeover | None:
        """Return what was done, as the vehicle's heartbeat tells; None where it is as we left it."""
        if self._ours is None:
            return None
        is_armed = bool(heartbeat.base_mode & m.ModeFlag.SAFETY_ARMED)
        if self._was_armed and not is_armed:
            return Takeover(None, shows_failsafe=self.shows_failsafe(heartbeat))
        self._was_armed = is_armed
        mode = heartbeat.custom_mode
        if mode == self._ours:
            self._fading_until_s = min(self._fading_until_s, now_s + _OVERTAKEN_S)
            return None
        is_stale = mode in self._fading and now_s <= self._fading_until_s
        if is_stale or self.is_late_click(heartbeat, now_s):
            return None
        return Takeover(mode, shows_failsafe=self.shows_failsafe(heartbeat))

    @staticmethod
    def shows_failsafe(heartbeat: m.Heartbeat) -> bool:
        """Return whether a heartbeat says MAV_STATE_CRITICAL."""
        return heartbeat.system_status == _CRITICAL

    def is_late_click(self, heartbeat: m.Heartbeat, now_s: float) -> bool:
        """Return whether a click has set the vehicle going after our HOLD, having come to it by a slower way than to us."""
        is_guided = heartbeat.custom_mode == self.modes.guided
        return is_guided and self._ours == self.modes.hold and now_s - self._clicked_s <= _LATE_CLICK_S

    def overhear(self, frame: Frame, system: int, component: int, now_s: float) -> Takeover | None:
        """Return what somebody asks of the vehicle; None where it takes nothing out of our hands."""
        if self._ours is None or now_s - self._asked_s <= _ON_ITS_WAY_S:
            return None
        message, asker = frame.message, (frame.system, frame.component)
        if getattr(message, "target_system", None) not in (0, system):
            return None
        if getattr(message, "target_component", component) not in (0, component):
            return None
        if _is_disarming(message):
            return Takeover(None, asker)
        mode = self._mode_asked_for(message)
        if mode is None or (mode == self._ours == self.modes.mission):
            return None
        if mode == self.modes.guided and now_s - self._clicked_s <= _CLICK_S:
            return None
        return Takeover(mode, asker)

    def _mode_asked_for(self, message: Message) -> int | None:
        if isinstance(message, m.SetMode):
            return message.custom_mode
        if not isinstance(message, m.CommandLong | m.CommandInt):
            return None
        if message.command == Command.DO_SET_MODE:
            return self.modes.asked_for(message.param2, message.param3)
        if message.command == Command.DO_REPOSITION:
            return self._mode_of_click(message)
        return self.modes.of_commands.get(message.command)

    def _mode_of_click(self, message: m.CommandLong | m.CommandInt) -> int | None:
        """Return the mode that a click leads to, where no heartbeat may tell of it: the one that stops may be on already.

        Without a place it is QGroundControl's "Pause", and stops the vehicle. Without its flag a click does nothing in another mode.
        """
        if self.modes.guided is not None:
            return None
        place = (
            (message.x, message.y) if isinstance(message, m.CommandInt) else (message.param5, message.param6)
        )
        is_pause = not all(math.isfinite(value) and value != INT32_MAX for value in place)
        changes_mode = math.isfinite(message.param2) and bool(int(message.param2) & _CHANGES_MODE)
        acts = changes_mode or self._ours == self.modes.hold
        return self.modes.hold if acts and (is_pause or not self.clicks_are_targets) else None


def _is_disarming(message: Message) -> bool:
    return (
        isinstance(message, m.CommandLong | m.CommandInt)
        and message.command == Command.COMPONENT_ARM_DISARM
        and message.param1 == 0
    )
