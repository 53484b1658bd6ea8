"""The rover without its link: modes, arming, fence and driving, 50 times a second."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from mavlink_bridge.mavlink.rover import Mode
from mavlink_bridge.simulator.avoidance import Avoidance, AvoidanceSettings
from mavlink_bridge.simulator.body import Body
from mavlink_bridge.simulator.controllers import Settings
from mavlink_bridge.simulator.drive import Driver
from mavlink_bridge.simulator.fence_watch import FenceArea, bounded_fence
from mavlink_bridge.simulator.flat import FlatFrame, TrueFrame
from mavlink_bridge.simulator.mission_run import MissionRun
from missions.geo import from_e7, to_e7

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from mavlink_bridge.simulator.config import Battery, MovingDisc, Receiver
    from mavlink_bridge.simulator.parameters import ParameterStore
    from missions.geo import LatLon
    from missions.items import MissionItem

TICK_S = 0.02
"""The main loop's period (SCHED_LOOP_RATE 50)."""

GIVE_UP_M = 100.0
"""Further outside a fence than this the rover stops instead of driving home."""

_CIRCLE, _POLYGON = 2, 4  # bits 1 and 2 of FENCE_TYPE
_UNION = 2  # FENCE_OPTIONS bit 1
_AVOID_FENCE = 1  # AVOID_ENABLE bit 0
_DISARM, _LOITER = 5, 6  # FENCE_ACTION
_ON_BREACH = {1: Mode.RTL, 3: Mode.SMART_RTL, 4: Mode.SMART_RTL, _LOITER: Mode.LOITER}
"""FENCE_ACTION: the mode, HOLD for any other."""

_HOMING = (Mode.RTL, Mode.SMART_RTL)
_DRIVING = (Mode.AUTO, Mode.GUIDED, *_HOMING)
_COASTING = (Mode.MANUAL, Mode.HOLD)
"""With centred sticks: no throttle, no brake."""

_MODES = frozenset({*_DRIVING, Mode.MANUAL, Mode.HOLD, Mode.LOITER})
"""The modes that the simulated rover can be switched to."""


class Rover:
    """Modes, arming, fence and driving.

    Parameters
    ----------
    parameters : ParameterStore
        Read on every change.
    home : LatLon
        Where it stands.
    heading_deg : float
        Where it looks, clockwise from north.
    mission, fence : callable
        Give the lists as they are stored.
    turns_early : bool
        Whether it begins turns as ArduPilot did before 4.6.

    Attributes
    ----------
    texts : list of tuple of int and str
        Its status texts with their severity; the caller empties it.
    reached : list of int
        The numbers of items reached; the caller empties it.
    battery : Battery or None
        What its battery's monitor tells; None: it has no monitor.
    receiver : Receiver or None
        What its GPS receiver tells; None: what the simulated one always does. Its position is as good as ever.
    least_clearance_m : float
        The least distance of the true track to any fence, in true metres; negative on forbidden ground, infinite without fence.
    discs : list of MovingDisc
        What is in the field beside fences.
    breaches : int
        How often the vehicle saw itself leave allowed ground with the fence enabled.
    """

    # Many attributes: ArduPilot's own vehicle is one object with mode, arming, fence and drive, and this answers like it.

    def __init__(
        self,
        parameters: ParameterStore,
        home: LatLon,
        heading_deg: float,
        mission: Callable[[], Sequence[MissionItem]],
        fence: Callable[[], Sequence[MissionItem]],
        *,
        turns_early: bool = False,
    ) -> None:
        self.parameters = parameters
        self._turns_early = turns_early
        self._fence = fence
        self._mission = mission
        self.battery: Battery | None = None
        self.receiver: Receiver | None = None
        self.least_clearance_m = math.inf
        self.breaches = 0
        self.discs: list[MovingDisc] = []
        self._boot(home, heading_deg)

    def _boot(self, home: LatLon, heading_deg: float) -> None:
        """Begin at a place, which is home now."""
        self.home = from_e7(*to_e7(home))
        self.frame = FlatFrame(self.home)
        self._true_frame = TrueFrame(self.home)
        self.mode = Mode.INITIALISING
        self.is_armed = False
        self.texts: list[tuple[int, str]] = []
        self.reached: list[int] = []
        self.breached = False
        self.breach_time_s = 0.0
        settings = Settings.from_parameters(self.parameters)
        self.body = Body(0j, math.radians(heading_deg), settings.is_skid)
        self.drive = Driver(settings, self.body, turns_early=self._turns_early)
        self.mission_run = MissionRun(self._mission, self.drive, self.frame)
        self._current_before_auto = False
        self.renew_fence()

    @property
    def position(self) -> LatLon:
        """Where it is."""
        return self.frame.to_lat_lon(self.body.position_m)

    @property
    def estimate(self) -> LatLon:
        """Where it believes it is."""
        return self.frame.to_lat_lon(self.body.estimate_m)

    @property
    def heading_deg(self) -> float:
        """Where it looks, 0 to 360 clockwise from north."""
        return math.degrees(self.body.heading_rad) % 360.0

    @property
    def destination(self) -> LatLon | None:
        """Where it drives, None while it stops."""
        point_m = self.drive.destination_m
        return None if point_m is None else self.frame.to_lat_lon(point_m)

    @property
    def is_idle(self) -> bool:
        """Whether a tick would change nothing."""
        if not self.is_armed:
            return abs(self.body.speed_mps) < 1e-3
        return self.drive.is_still and (self.mode not in _DRIVING or self._rests())

    @property
    def is_running_mission(self) -> bool:
        """Whether it is armed in AUTO."""
        return self.is_armed and self.mode == Mode.AUTO

    def reboot(self) -> None:
        """Begin anew where it stands; home is there now."""
        self._boot(self.position, self.heading_deg)

    def renew_settings(self) -> None:
        """Take changed parameters."""
        settings = Settings.from_parameters(self.parameters)
        self.body.is_skid = settings.is_skid
        self.drive.change_settings(settings)
        self.renew_fence()

    def renew_fence(self) -> None:
        """Take a changed fence."""
        parameters = self.parameters
        self._enforced = parameters.whole("FENCE_TYPE") if parameters["FENCE_ENABLE"] else 0
        union = parameters.flag("FENCE_OPTIONS", _UNION)
        circle = (0j, parameters["FENCE_RADIUS"]) if self._enforced & _CIRCLE else None
        items = self._fence()
        own = items if self._enforced & _POLYGON else ()
        self._area = FenceArea(own, self.frame, union=union, home_circle=circle)
        self._true_area = FenceArea(items, self._true_frame, union=union, home_circle=circle)
        self._avoidance = None
        if parameters.flag("AVOID_ENABLE", _AVOID_FENCE) and not self._area.is_empty:
            settings = AvoidanceSettings.from_parameters(parameters)
            self._avoidance = Avoidance(bounded_fence(own), self.frame, settings, circle)
        self._measure_clearance()

    def set_mode(self, number: int, now_s: float) -> bool:
        """Change the mode; return whether that was possible."""
        if number not in _MODES:
            return False
        mode = Mode(number)
        if mode == self.mode:
            return True
        if mode == Mode.AUTO and self.mission_run.is_empty:
            self.texts.append((3, "No Mission. Can't set AUTO."))
            return False
        self.mode = mode
        self.drive.stop()
        if mode == Mode.AUTO:
            if self._current_before_auto:
                self.texts.append((2, "Internal Errors 0x20000000"))
            self.mission_run.start(now_s)
        elif mode in _HOMING:  # SMART_RTL straight home too: no way is remembered
            self.drive.go_to(self.frame.to_flat(self.home), None)
        self._current_before_auto = False
        self._pass_on()
        return True

    def set_current_item(self, seq: int, *, restart: bool, now_s: float) -> bool:
        """Go to a mission item; return whether there is one."""
        if restart:
            self.mission_run.restart()
        driving = self.mode == Mode.AUTO
        known = self.mission_run.set_current(seq, now_s=now_s, driving=driving)
        self._current_before_auto = known and self.mode == Mode.HOLD
        self._pass_on()
        return known

    def arm(self) -> None:
        """Let the motors run."""
        if not self.is_armed:
            self.is_armed = True
            self.drive.motors_off()
            self.texts.append((6, "Throttle armed"))

    def disarm(self) -> None:
        """Let the motors stop."""
        if self.is_armed:
            self.is_armed = False
            self.texts.append((6, "Throttle disarmed"))

    def go_to(self, target: LatLon) -> bool:
        """Drive to a place; only GUIDED does."""
        if self.mode != Mode.GUIDED:
            return False
        self.drive.stop()
        self.drive.go_to(self.frame.to_flat(target), None)
        return True

    def step(self, now_s: float) -> None:
        """Let one tick pass."""
        if self.is_armed and self.mode not in _COASTING:
            self._follow(now_s)
            self.drive.step(TICK_S, self._avoidance)
        else:
            self.drive.coast(TICK_S, armed=self.is_armed)
        self._measure_clearance()
        self.check_fence(now_s)

    def check_fence(self, now_s: float) -> None:
        """Look whether the fence is breached now, and act on it."""
        if self._area.is_empty or self._area.is_beyond(0.0, self.body.position_m):
            self.breached = False
            return
        clearance_m = self._area.clearance_m(self.body.position_m)
        was_breached, self.breached = self.breached, clearance_m < 0
        if not self.breached or was_breached:
            return
        self.breaches += 1
        self.breach_time_s = now_s
        if not self.is_armed:
            return
        action = self.parameters.whole("FENCE_ACTION")
        if action == _DISARM:
            self.disarm()
        elif action:
            can_return = action == _LOITER or -clearance_m < GIVE_UP_M
            self.set_mode(_ON_BREACH.get(action, Mode.HOLD) if can_return else Mode.HOLD, now_s)

    def _follow(self, now_s: float) -> None:
        if self.mode == Mode.AUTO:
            self.mission_run.step(now_s)
            self._pass_on()
        elif self.mode in _DRIVING and self.drive.has_arrived:
            self.drive.stop()
            if self.mode == Mode.GUIDED:
                self.reached.append(0)

    def _rests(self) -> bool:
        return self.mode != Mode.AUTO or self.mission_run.is_complete

    def _pass_on(self) -> None:
        self.texts += [(6, text) for text in self.mission_run.texts]
        self.reached += self.mission_run.reached
        self.mission_run.texts.clear()
        self.mission_run.reached.clear()

    def _measure_clearance(self) -> None:
        place_m = self._true_frame.to_flat(self.position)
        if not self._true_area.is_beyond(self.least_clearance_m, place_m):
            self.least_clearance_m = min(self.least_clearance_m, self._true_area.clearance_m(place_m))
