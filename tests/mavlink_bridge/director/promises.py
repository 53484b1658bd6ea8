"""What the bridge promises, checked on every message it sends: whatever others do, and whatever the link loses."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from mavlink_bridge.director import EventName, State
from mavlink_bridge.mavlink import messages as m
from mavlink_bridge.mavlink.autopilots import autopilot_table
from missions.fence import CircleZone, ZoneKind
from missions.items import Command

if TYPE_CHECKING:
    from director.conducting import Conductor

    from mavlink_bridge.director import Event
    from missions.fence import Zone
    from missions.situation import Pose

ON_ITS_WAY_S = 0.55
"""What is overheard so soon after a target may have been on its way before it."""

SLOWEST_LINK_S = 0.3
"""A heartbeat that comes sooner after a takeover may tell what was before it."""

ROLLS_S = 1.0
"""Every rover rolls on farther than it drives in this time: braking with 1 m/s² from 2 m/s on, rolling by the measured rows from any speed."""

TAKEN_S = 0.5
"""A HOLD that the link brings later than this may end farther on than was foretold."""

ROLLING_S = 15.0
"""The longest measured way to a standstill took 12.2 s."""


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
        self._is_px4 = run.vehicles[0].config.autopilot is m.Autopilot.PX4
        self._modes = autopilot_table(run.vehicles[0].config.autopilot).modes
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
        self._announced_s = -1e9
        self._owes_announcement = ""
        self._hold_s: float | None = None  # our newest HOLD, as long as it may roll
        self._held_fence: object = None
        self._mode_before: int | None = None
        self._breaches = 0
        director = run.director
        receive, messages_to_send, take_events = (
            director.receive,
            director.messages_to_send,
            director.take_events,
        )

        def listen(frame: m.Frame, now_s: float) -> None:
            self._hear(frame, now_s)
            fence, was_driving = director.situation.fence, director.state is State.DRIVING
            receive(frame, now_s)
            if director.situation.fence is not fence and was_driving:
                self._hear_of_fence()

        def told() -> list[Event]:
            events = take_events()
            self._check_announced(events)
            return events

        def send() -> list[m.Message]:
            self._check_breach()
            messages = messages_to_send()
            for message in messages:
                self._check(message)
            self._was_clashing = run.director.state is State.CLASHING
            return messages

        run.director.receive = listen
        run.director.messages_to_send = send
        run.director.take_events = told

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
        shows_mode = mode not in (None, self._modes.hold, self._modes.guided) and self._mode == mode
        self._knows = self._knows or shows_mode

    # Breaches to come

    def _hear_of_fence(self) -> None:
        """Note that a fence arrived so near ahead that no HOLD stops before it, while the vehicle drives."""
        situation = self._run.director.situation
        pose = situation.pose.value if situation.pose is not None else None
        if pose is None or pose.speed_mps < 2.0 or self._run.director.state is State.DRIVING:
            return  # a route that keeps off it goes on
        if _is_fence_within(pose, ROLLS_S * pose.speed_mps, situation.fence.value.zones):
            self._owes_announcement = (
                f"a fence within {ROLLS_S * pose.speed_mps:.1f} m at {pose.speed_mps:.1f} m/s"
            )

    def _check_announced(self, events: list[Event]) -> None:
        if any(event.name is EventName.BREACH_AHEAD for event in events):
            self._announced_s = self._run.now_s
        elif self._owes_announcement:
            self._break(f"{self._owes_announcement} was not announced")
        self._owes_announcement = ""

    @property
    def _fence(self) -> object:
        fence = self._run.director.situation.fence
        return fence.value if fence is not None else None

    def _check_breach(self) -> None:
        """Look whether a HOLD of ours has led into a fence that was known, without a word."""
        run, vehicle = self._run, self._run.vehicles[0]
        if vehicle.mode == self._modes.hold != self._mode_before and self._hold_s is not None:
            is_late = run.now_s > self._hold_s + TAKEN_S
            self._hold_s = None if is_late else self._hold_s
        is_rolling = self._hold_s is not None and run.now_s <= self._hold_s + ROLLING_S
        if (
            self._told_breaches > self._breaches
            and self._mode_before == self._modes.hold
            and is_rolling
            and vehicle.is_armed
            and self._speed_mps > 0
            and self._fence == self._held_fence
            and self._announced_s < self._hold_s - 2.0
        ):
            self._break("a breach by our HOLD that was not announced")
        self._mode_before, self._breaches = vehicle.mode, self._told_breaches

    @property
    def _told_breaches(self) -> int:
        vehicle = self._run.vehicles[0]
        return vehicle.rover.breaches if self._is_px4 else vehicle.breaches

    @property
    def _speed_mps(self) -> float:
        rover = self._run.vehicles[0].rover
        return rover.motion.speed_mps if self._is_px4 else rover.body.speed_mps

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
                self._check_mode(self._modes.asked_for(message.param2, message.param3))

    def _check_clashed(self, message: m.Message) -> None:
        if not self._has_clashed or isinstance(message, m.Statustext | m.CommandAck):
            return
        is_switch = isinstance(message, m.CommandLong) and message.command == Command.DO_SET_MODE
        is_hold = is_switch and self._modes.asked_for(message.param2, message.param3) == self._modes.hold
        asks = isinstance(message, m.CommandLong) and message.command == Command.REQUEST_MESSAGE
        is_holds = is_hold or (asks and message.param1 == 0.0)  # a heartbeat, which shows what became of HOLD
        is_uploads_end = isinstance(message, m.MissionAck | m.MissionRequestInt) and self._was_clashing
        if is_uploads_end or self._run.director.state is State.CLASHING or is_holds:
            return
        self._break(f"{type(message).__name__} after somebody spoke with our ids")

    def _check_mode(self, mode: int) -> None:
        self._check_taken_over(f"mode {mode}")
        if not self._run.director.orders.drive:
            self._break("a mode change without orders to drive")
        if mode not in (self._modes.hold, self._modes.mission):
            self._break(f"mode {mode} is none of ours")
        if mode == self._modes.hold != self._mode_before:
            self._hold_s, self._held_fence = self._run.now_s, self._fence
        if mode != self._modes.mission:
            return
        self._hold_s = None
        if self._mode != self._modes.hold:
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
        if self._mode == self._modes.mission and self._is_armed:
            self._break("an upload under a vehicle that drives")

    def _check_taken_over(self, what: str) -> None:
        if self._knows:
            self._break(f"{what} after somebody took over")

    def _break(self, what: str) -> None:
        self.broken.append(f"{self._run.now_s:.2f} s, {self._run.director.state}: {what}")


def _is_fence_within(pose: Pose, reach_m: float, zones: tuple[Zone, ...]) -> bool:
    """Return whether the straight way on leads out of the inclusions or into an exclusion; by points, in the flat metres of the place."""
    north_m, east_m = 111_200.0, 111_320.0 * math.cos(math.radians(pose.position.lat_deg))
    away = (pose.velocity_mps[0] / pose.speed_mps / east_m, pose.velocity_mps[1] / pose.speed_mps / north_m)
    for step in range(int(reach_m / 0.1)):
        lon_deg, lat_deg = (
            pose.position.lon_deg + 0.1 * step * away[0],
            pose.position.lat_deg + 0.1 * step * away[1],
        )
        for zone in zones:
            if isinstance(zone, CircleZone):
                off_m = math.hypot(
                    (lon_deg - zone.centre.lon_deg) * east_m, (lat_deg - zone.centre.lat_deg) * north_m
                )
                is_in = off_m < zone.radius_m
            else:
                is_in = False
                for a, b in zip(zone.vertices, (*zone.vertices[1:], zone.vertices[0]), strict=True):
                    if (a.lat_deg > lat_deg) != (b.lat_deg > lat_deg):
                        share = (lat_deg - a.lat_deg) / (b.lat_deg - a.lat_deg)
                        is_in ^= lon_deg < a.lon_deg + share * (b.lon_deg - a.lon_deg)
            if is_in != (zone.kind is ZoneKind.INCLUSION):
                return True
    return False
