"""What the vehicle does now, from its newest telemetry: its mode, whether it is armed, its speed, and whether it drives its mission."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from mavlink_bridge.mavlink.messages import Autopilot, GlobalPositionInt, Heartbeat, MissionCurrent, ModeFlag
from mavlink_bridge.mavlink.modes import ARDUPILOT_MODES, Modes, modes_of

if TYPE_CHECKING:
    from mavlink_bridge.mavlink.messages import Message

FRESH_S = 3.0
"""How old telemetry may be to show what the vehicle does now: a heartbeat comes every second."""

MISSION_COMPLETE = 5
"""MISSION_STATE_COMPLETE in MISSION_CURRENT.mission_state; ArduPilot reports it, 0 is from those that do not."""


@dataclass(frozen=True, slots=True)
class Doing:
    """What a vehicle does, as far as it has reported.

    Parameters
    ----------
    mode : int, optional
        HEARTBEAT.custom_mode; None before the first heartbeat.
    is_armed : bool, optional
        Whether it is armed; None before the first heartbeat.
    speed_mps : float, optional
        Its speed over ground; None if it reported none.
    has_completed : bool
        Whether it reports its mission as complete.
    age_s : float
        How old the newest heartbeat is; infinite before the first.
    speed_age_s : float
        How old the speed is.
    modes : Modes
        Its autopilot's modes.
    """

    mode: int | None = None
    is_armed: bool | None = None
    speed_mps: float | None = None
    has_completed: bool = False
    age_s: float = math.inf
    speed_age_s: float = math.inf
    modes: Modes = ARDUPILOT_MODES

    @property
    def is_fresh(self) -> bool:
        """Whether the heartbeat is young enough to show what the vehicle does now."""
        return self.age_s <= FRESH_S

    @property
    def drives_mission(self) -> bool:
        """Whether it drives its mission: armed in AUTO (PX4: AUTO.MISSION), and the mission is not complete."""
        return bool(self.is_armed) and self.mode == self.modes.mission and not self.has_completed


class VehicleWatch:
    """Keeps the newest of what a vehicle reports about itself; the caller gives it that vehicle's messages only."""

    def __init__(self) -> None:
        self._heartbeat: Heartbeat | None = None
        self._speed_mps: float | None = None
        self._mission_state = 0
        self._heartbeat_s = self._speed_s = self._mission_s = -math.inf

    @property
    def heartbeat_s(self) -> float:
        """When the newest heartbeat came; minus infinity before the first."""
        return self._heartbeat_s

    def receive(self, message: Message, now_s: float) -> None:
        """Take a message of the vehicle."""
        if isinstance(message, Heartbeat):
            self._heartbeat, self._heartbeat_s = message, now_s
        elif isinstance(message, GlobalPositionInt):
            self._speed_mps, self._speed_s = math.hypot(message.vx, message.vy) / 100, now_s
        elif isinstance(message, MissionCurrent):
            self._mission_state, self._mission_s = message.mission_state, now_s

    def doing(self, now_s: float) -> Doing:
        """Return what the vehicle does, as last reported."""
        heartbeat = self._heartbeat
        if heartbeat is None:
            return Doing()
        # A mission may be started anew: an old report of its end does not count.
        has_completed = self._mission_state == MISSION_COMPLETE and now_s - self._mission_s <= FRESH_S
        return Doing(
            heartbeat.custom_mode,
            bool(heartbeat.base_mode & ModeFlag.SAFETY_ARMED),
            self._speed_mps,
            has_completed=has_completed,
            age_s=max(0.0, now_s - self._heartbeat_s),
            speed_age_s=max(0.0, now_s - self._speed_s),
            modes=modes_of(ardupilot=heartbeat.autopilot != Autopilot.PX4),
        )

    def is_active(self, now_s: float) -> bool | None:
        """Return whether the vehicle drives its mission; None if its last heartbeat is too old."""
        doing = self.doing(now_s)
        return doing.drives_mission if doing.is_fresh else None
