"""The part of the director that knows where a HOLD ends: it announces one that ends beyond a fence, and lets the vehicle go on first where that is better.

HOLD does not brake, the vehicle rolls on. A fence put inside its stopping distance is breached by a HOLD sent at once, and perhaps not by one sent
after the next corner, or at the route's end. So where we may switch modes, and it drives our mission:

- a HOLD that ends within the fence is sent at once;
- else, where the rest of the route leads to a place from which a HOLD ends within the fence, and the predicted track stays within it until there, the
  vehicle goes on, and each position is looked at again; where positions fail, HOLD is sent when that place should be reached;
- else HOLD is sent at once: it is slower at the fence, and ends less far beyond it.

A click makes the vehicle drive straight to its target, so that HOLD follows it at once, whatever that leads to.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from mavlink_bridge.director.core import Core, Part
from mavlink_bridge.director.events import EventName
from mavlink_bridge.director.halter import STILL_MPS
from mavlink_bridge.director.states import Notice, Signal, State
from mavlink_bridge.mavlink import messages as m
from missions.checking.holding import HoldNow, hold_now
from missions.fence import OBSTACLE

if TYPE_CHECKING:
    from collections.abc import Sequence

    from mavlink_bridge.director.drive_supervisor import DriveSupervisor
    from mavlink_bridge.director.drive_watch import DriveWatch
    from mavlink_bridge.director.halter import Halter
    from mavlink_bridge.mavlink.messages import Frame
    from mavlink_bridge.protocol.mode_switch import ModeSwitch
    from mavlink_bridge.protocol.stop_here import StopHere

_SAME_S = 1.0
"""A HOLD that follows an announcement so soon is the one that was announced."""


class HoldWatch(Part):
    """Knows where a HOLD ends."""

    def __init__(self, core: Core, halter: Halter, driver: DriveSupervisor) -> None:
        super().__init__(core)
        self._halter = halter
        self._driver = driver
        self._seen: ModeSwitch | StopHere | None = None  # the newest HOLD that was looked at
        self._told_s = -math.inf
        self._going_on: DriveWatch | None = None  # the drive that goes on before its HOLD
        self._hold_due_s = math.inf

    @property
    def deadline_s(self) -> float | None:
        """When a HOLD that was sent is looked at, or one is sent at the latest."""
        if self._is_news:
            return -math.inf
        return self._hold_due_s if self._is_going_on else None

    def receive(self, frame: Frame, now_s: float) -> Sequence[Signal]:
        """Look at each position of a vehicle that goes on before its HOLD."""
        is_position = isinstance(frame.message, m.GlobalPositionInt) and self.core.is_from_vehicle(frame)
        return self._look_again(now_s) if self._is_going_on and is_position else []

    def handle_timer(self, now_s: float) -> Sequence[Signal]:
        """Announce where a HOLD that was sent ends; send one where positions fail."""
        if self._is_news:
            self._seen = self._halter.stopping
            if now_s > self._told_s + _SAME_S:
                self.announce(now_s)
        return self._stop_going_on() if self._is_going_on and now_s >= self._hold_due_s else []

    def announce(self, now_s: float) -> None:
        """Announce a breach to come, where a HOLD sent now would end beyond a fence."""
        self._tell(self._found(now_s), now_s)

    def goes_on_first(self, now_s: float) -> bool:
        """Return whether the vehicle is to go on before its HOLD; a HOLD that ends beyond a fence is announced."""
        found = self._found(now_s)
        if now_s > self._told_s + _SAME_S:
            self._tell(found, now_s)
        self._wait(found, now_s)
        return self._is_going_on

    @property
    def _is_news(self) -> bool:
        return self._halter.stopping is not None and self._halter.stopping is not self._seen

    @property
    def _is_going_on(self) -> bool:
        return self._going_on is not None and self._going_on is self._driver.drive

    @property
    def _may_choose(self) -> bool:
        return self.core.orders.drive and self.core.state is State.DRIVING

    def _found(self, now_s: float) -> HoldNow | None:
        core, pose = self.core, self.core.situation.pose
        if pose is None or pose.time_s is None or pose.value.speed_mps <= STILL_MPS:
            return None
        plan = core.plan if self._driver.drive is not None else None
        return hold_now(
            core.situation,
            core.orders.request,
            plan,
            item=self._driver.item,
            age_s=max(0.0, now_s - pose.time_s),
        )

    def _wait(self, found: HoldNow | None, now_s: float) -> None:
        goes_on = found is not None and found.go_on_m is not None and self._may_choose
        self._going_on = self._driver.drive if goes_on else None
        if found is not None and found.go_on_m is not None:
            self._hold_due_s = now_s + found.go_on_m / found.roll_out.speed_mps

    def _look_again(self, now_s: float) -> Sequence[Signal]:
        found = self._found(now_s)
        self._wait(found, now_s)
        if self._is_going_on:
            return []
        return self._stop_going_on()

    def _stop_going_on(self) -> Sequence[Signal]:
        """Return what the HOLD waits for: a target, or a route that is to be made anew."""
        self._going_on = None
        return [Notice.GONE_ON]

    def _tell(self, found: HoldNow | None, now_s: float) -> None:
        if found is None:
            return
        self._told_s = now_s
        roll, best, then = found.roll_out, None, ""
        if self._may_choose:
            best = "hold" if found.go_on_m is None else "go_on"
            then = (
                "; HOLD at once"
                if found.go_on_m is None
                else f"; going on for {found.go_on_m:.0f} m along the route, then HOLD"
            )
        is_obstacle = (roll.fence or "").startswith(OBSTACLE)
        ahead = f"breach ahead: fence {roll.to_fence_m:.1f} m"
        beyond = roll.fence or "the fence"
        if is_obstacle:
            ahead = f"obstacle inside the stopping distance: {roll.to_fence_m:.1f} m ahead"
            beyond = f"the edge of the {roll.fence}"
        self.core.voice.tell(
            now_s,
            EventName.BREACH_AHEAD,
            f"{ahead}, stops in {roll.stopping_m:.1f} m from {roll.speed_mps:.1f} m/s "
            f"({found.source}), {roll.beyond_m:.1f} m beyond {beyond}{then}",
            roll.fence,
            round(roll.to_fence_m, 2),
            round(roll.stopping_m, 2),
            round(roll.speed_mps, 2),
            found.source,
            best,
            None if found.go_on_m is None or best is None else round(found.go_on_m, 1),
        )
