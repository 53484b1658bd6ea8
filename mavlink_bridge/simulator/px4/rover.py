"""PX4's rover without its link: modes, arming, missions and fence as measured.

With steered wheels it drives as `pursuit` says. With skid steering (CA_AIRFRAME 6 or 13), which was not measured, it drives straight lines at its speed, turns on the
spot, stands while it waits, and stops where it is told to.
"""

from __future__ import annotations

import cmath
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from mavlink_bridge.mavlink.messages import MissionType
from mavlink_bridge.simulator.flat import FlatFrame
from mavlink_bridge.simulator.px4.fence import activation_s, enforced_fence
from mavlink_bridge.simulator.px4.pursuit import Aim, PursuitBody, PursuitDrive, turn_rad
from missions.items import Command

if TYPE_CHECKING:
    from collections.abc import Mapping

    from mavlink_bridge.simulator.px4.lists import Px4List
    from mavlink_bridge.simulator.px4.parameters import Px4Parameters
    from missions.geo import LatLon
    from missions.items import MissionItem

TICK_S = 0.05  # chosen: 0.16 m at the highest speed, and a sixth of its lags
FENCE_LOOK_S = 0.2  # five times a second
FAILSAFE_HOLD_S = 5.0
"""HOLD before a failsafe's RTL or LAND."""

DISARM_AFTER_S = 2.0  # at home after RTL, or in LAND

# Main modes, sub-modes of AUTO, MISSION_STATE and MAV_SEVERITY by their numbers.
AUTO, MANUAL = 4, 1
TAKEOFF, HOLD, MISSION, RTL, LAND = 2, 3, 4, 5, 6
_MAIN_NAMES = {1: "Manual", 2: "Altitude", 3: "Position", 5: "Acro", 6: "Offboard", 7: "Stabilized"}
_PLACED = (
    Command.NAV_WAYPOINT,
    Command.NAV_LOITER_TIME,
    Command.NAV_LOITER_UNLIM,
    Command.NAV_LAND,
    Command.NAV_TAKEOFF,
)
_WAITS = (Command.NAV_LOITER_TIME, Command.NAV_DELAY)
_SKID_AIRFRAMES = (6, 13)
_STANDS_M = 0.21
"""Where it brakes for a DELAY on 1.18: it stood 0.10 to 0.14 m from its waypoint."""

_LATE_TICKS = 4
"""How long it drives on before HOLD reaches it: with 0.2 s it rolls about as far past the place of the mode change as measured (2.3 m from 3 m/s, 1.9 m from 2 m/s)."""

_CREEPS_MPS = 0.05  # how fast it comes there; chosen
_ROLLS_MPS2 = 0.32
"""How disarming slows it on 1.18: 14 m from 3 m/s. On 1.17 it rolls on for good."""

_NOT_ARMED_S = 150.0
"""For so long at the least it could not be armed after that."""

# MISSION_STATE, MAV_SEVERITY
_NO_MISSION, _NOT_STARTED, _ACTIVE, _PAUSED, _COMPLETE = 1, 2, 3, 4, 5
_CRITICAL, _INFO = 2, 6


@dataclass(slots=True)
class _Progress:
    """How far the mission is."""

    seq: int = 0
    reached: int = -1
    is_complete: bool = False
    is_valid: bool = False
    has_begun: bool = False
    speed_mps: float = 0.0  # of DO_CHANGE_SPEED
    start_m: complex = 0j  # where the line to the next place begins
    wait_until_s: float | None = None


class Px4Rover:
    """Modes, arming, missions and fence.

    Parameters
    ----------
    parameters : Px4Parameters
        Read whenever they matter.
    lists : mapping of MissionType to Px4List
        Its lists.
    home : LatLon
        Where it stands.
    heading_deg : float
        Where it looks, clockwise from north.
    tells_modes : bool
        Whether it says of a mode that it does not have that it is unsupported, as from 1.18 on.

    Attributes
    ----------
    texts : list of tuple of int and str
        Its status texts with their severity; the caller empties it.
    mode : tuple of int
        Main mode and sub-mode.
    breaches : int
        How often it saw itself leave allowed ground.
    """

    # Many attributes: all that PX4 itself keeps of its state at once, of modes, mission, fence, failsafes and where it drives.

    def __init__(
        self,
        parameters: Px4Parameters,
        lists: Mapping[MissionType, Px4List],
        home: LatLon,
        heading_deg: float,
        *,
        tells_modes: bool,
    ) -> None:
        self.parameters = parameters
        self._lists = lists
        self._tells_modes = tells_modes
        self.home = home
        self.frame = FlatFrame(home)
        self.motion = PursuitBody(0j, math.radians(heading_deg))
        self._pursuit = PursuitDrive(parameters)
        self._late_ticks = 0
        self._goal_m: complex | None = None  # outside of missions: where it is to go, or to stay
        self.breaches = 0
        self.texts: list[tuple[int, str]] = []
        self._now_s = self._arms_from_s = 0.0
        self._counts_from_s = 0.0
        self._area = enforced_fence((), self.frame, 0j, None, 0.0).area
        self.reboot()

    def reboot(self) -> None:
        """Begin anew where it stands, in HOLD."""
        self.mode = (AUTO, HOLD)
        self.is_armed = False
        self.is_in_failsafe = False
        self.is_outside = False
        self.progress = _Progress()
        self.motion = PursuitBody(self.motion.position_m, self.motion.heading_rad)
        self._goal_m = None
        self._known = (-1, -1)
        self._looked_s = -math.inf
        self._then: tuple[float, int] | None = None  # when a failsafe's HOLD ends, and in which mode
        self._disarms_s = math.inf

    @property
    def position(self) -> LatLon:
        """Where it is."""
        return self.frame.to_lat_lon(self.motion.position_m)

    @property
    def heading_deg(self) -> float:
        """Where it looks, 0 to 360 clockwise from north."""
        return math.degrees(self.motion.heading_rad) % 360.0

    @property
    def mission(self) -> tuple[MissionItem, ...]:
        """The mission as it reads back."""
        return self._lists[MissionType.MISSION].items

    @property
    def mission_state(self) -> int:
        """MISSION_CURRENT.mission_state."""
        if not self.mission or not self.progress.is_valid:
            return _NO_MISSION
        if self.progress.is_complete:
            return _COMPLETE
        if self.mode == (AUTO, MISSION) and self.is_armed:
            return _ACTIVE
        return _PAUSED if self.progress.has_begun else _NOT_STARTED

    def set_mode(self, main: int, sub: int) -> bool:
        """Change the mode; return whether it is one that is available."""
        if main == AUTO and sub in (0, TAKEOFF, HOLD, MISSION, RTL, LAND):
            wanted = (AUTO, sub or MISSION)
        elif main in _MAIN_NAMES:
            self._say(_CRITICAL, f"Switching to {_MAIN_NAMES[main]} is currently not available")
            return False
        else:
            if self._tells_modes:
                self._say(_CRITICAL, "Unsupported auto mode" if main == AUTO else "Unsupported main mode")
            return False
        self._then = None
        if wanted == self.mode == (AUTO, HOLD):
            self.is_in_failsafe = (
                False  # nothing begins anew: as read in the source, it goes on to where it was sent
            )
        else:
            self._enter(wanted)
        return True

    def arm(self, how: str) -> bool:
        """Let the motors run; return whether it is armed."""
        if not self.is_armed:
            if self._arms_from_s > self._now_s:
                self._say(_CRITICAL, "Arming denied: Resolve system health failures first")
                return False
            self.is_armed = True
            self._say(_INFO, f"Armed by {how}")
        return True

    def disarm(self, how: str) -> None:
        """Let the motors stop."""
        if self.is_armed:
            self.is_armed = False
            if self._is_skid:
                self.motion.speed_mps = 0.0
            elif self.motion.speed_mps and self._tells_modes:
                self._arms_from_s = self._now_s + _NOT_ARMED_S
            self.motion.ramped_mps = 0.0
            self._goal_m = None
            self._disarms_s = math.inf
            self._say(_INFO, f"Disarmed by {how}")

    def start_mission(self, seq: int) -> bool:
        """Arm and drive the mission from an item; return whether there is one."""
        if not self.progress.is_valid or not 0 <= seq < len(self.mission):
            self._say(_CRITICAL, "Mission start denied! No valid mission")
            return False
        if not self.arm("mission start"):
            return False
        self.set_current(seq)
        self._enter((AUTO, MISSION))
        return True

    def set_current(self, seq: int) -> bool:
        """Make an item the current one; return whether there is one."""
        if not 0 <= seq < len(self.mission):
            return False
        self.progress.seq, self.progress.is_complete = seq, False
        self.progress.wait_until_s = None
        return True

    def go_to(self, place: LatLon | None, *, changes_mode: bool) -> bool:
        """Drive straight to a place, without one to where it is; return whether it does so in HOLD."""
        if changes_mode:
            self._enter((AUTO, HOLD))
        if self.mode != (AUTO, HOLD):
            return False
        self._goal_m = self.motion.position_m if place is None else self.frame.to_flat(place)
        self.progress.start_m = self.motion.position_m
        if self._area.clearance_m(self._goal_m) < 0:
            self._say(_CRITICAL, "Reposition is outside geofence")
        return True

    def look(self, now_s: float) -> None:
        """Take notice of changed lists: a mission is judged at once, a fence counts after a while."""
        self._now_s = now_s if math.isfinite(now_s) else self._now_s
        mission, fence = self._lists[MissionType.MISSION], self._lists[MissionType.FENCE]
        known = (mission.changes, fence.changes)
        if known != self._known:
            if fence.changes != self._known[1]:
                self._counts_from_s = now_s + activation_s(fence.items)
            if mission.changes != self._known[0]:
                self._take_mission(mission)
            self._known = known
            self._judge_mission()
        if now_s >= self._counts_from_s:
            self._counts_from_s = math.inf
            self.renew_fence()

    @property
    def deadline_s(self) -> float:
        """When `look` wants to be called, a new fence being about to count."""
        return self._counts_from_s

    def renew_fence(self) -> None:
        """Let the fence that is stored count, as far as it does."""
        vehicle_m = self.motion.position_m if self.is_armed else None
        radius_m = self.parameters["GF_MAX_HOR_DIST"]
        items = self._lists[MissionType.FENCE].items
        enforced = enforced_fence(items, self.frame, 0j, vehicle_m, radius_m)
        self._area = enforced.area
        for text in enforced.texts:
            self._say(_CRITICAL, text)
        self._judge_mission()

    @property
    def is_idle(self) -> bool:
        """Whether a tick would change nothing."""
        if not self.is_armed:
            return self.motion.speed_mps == 0
        moves = self.mode[1] in (MISSION, RTL, LAND) or self._goal_m is not None or self.motion.speed_mps > 0
        return not (moves or self._then is not None)

    def step(self, now_s: float) -> None:
        """Let one tick pass."""
        if not self.is_armed:
            self._roll()
            return
        if self._then is not None and now_s >= self._then[0]:
            self._enter((AUTO, self._then[1]))
            self._then = None
        if now_s >= self._disarms_s:
            self.disarm("auto disarm")
            return
        self._drive(now_s)
        if now_s >= self._looked_s + FENCE_LOOK_S:
            self._looked_s = now_s
            self._watch_fence(now_s)

    def _roll(self) -> None:
        """Roll on for a tick, disarmed."""
        motion = self.motion
        if self._tells_modes:
            motion.speed_mps = max(0.0, motion.speed_mps - _ROLLS_MPS2 * TICK_S)
        motion.position_m += cmath.rect(motion.speed_mps * TICK_S, motion.heading_rad)

    def _take_mission(self, mission: Px4List) -> None:
        if mission.current is not None:
            self.progress.seq = mission.current
        elif self.progress.seq >= len(mission):
            self.progress.seq = 0
        self.progress = _Progress(self.progress.seq)

    def _judge_mission(self) -> None:
        """Find out whether the mission may be driven: its waypoints, not its legs, have to lie inside the fence that counts."""
        was_driving = self.mode == (AUTO, MISSION) and self.is_armed
        outside = [
            number
            for number, item in enumerate(self.mission, 1)
            if item.command in _PLACED and self._area.clearance_m(self.frame.to_flat(item.position)) < 0
        ]
        for number in outside:
            self._say(_CRITICAL, f"Geofence violation for waypoint {number}")
        self.progress.is_valid = bool(self.mission) and not outside
        if was_driving and not self.progress.is_valid:
            self._no_mission()

    def _no_mission(self) -> None:
        self._say(_INFO, "No valid mission available, loitering")
        self._enter((AUTO, HOLD))

    def _enter(self, mode: tuple[int, int]) -> None:
        self.mode = mode
        holds = mode == (AUTO, HOLD) and self.motion.speed_mps > 0
        self._goal_m = self.motion.position_m if holds else None
        self._late_ticks = _LATE_TICKS if holds and not self._is_skid else 0
        self.progress.start_m = self.motion.position_m
        self.progress.wait_until_s = None
        self._disarms_s = math.inf
        self.is_in_failsafe = False
        if mode == (AUTO, MISSION) and self.is_armed:
            if not self.progress.is_valid or self.progress.is_complete:
                self._no_mission()
            else:
                self._say(_INFO, "Executing Mission")

    def _drive(self, now_s: float) -> None:
        if self.mode == (AUTO, MISSION):
            self._run_mission(now_s)
        elif self.mode == (AUTO, RTL):
            if self._approach(0j):
                self._disarms_s = min(self._disarms_s, now_s + DISARM_AFTER_S)
                self._stop()
        elif self.mode == (AUTO, LAND):
            self._stop()
            self._disarms_s = min(self._disarms_s, now_s + DISARM_AFTER_S)
        elif self._late_ticks:
            self._late_ticks -= 1
            self.motion.position_m += cmath.rect(self.motion.speed_mps * TICK_S, self.motion.heading_rad)
        elif self._goal_m is None:
            self._stop()
        elif self._approach(self._goal_m):
            self._stop()
            if self.motion.speed_mps == 0:
                self._goal_m = None

    def _run_mission(self, now_s: float) -> None:
        self.progress.has_begun = True
        if self.progress.seq >= len(self.mission):
            self._finish()
            return
        item = self.mission[self.progress.seq]
        if item.command == Command.DO_CHANGE_SPEED and item.params[1] > 0:
            self.progress.speed_mps = item.params[1]
        if item.command == Command.DO_JUMP:
            self.progress.seq = int(item.params[0])  # endless: how often it was done is not counted here
            return
        waits = self.progress.wait_until_s is not None
        if item.command in _PLACED and not waits and not self._approach_item(item):
            return
        if item.command in _WAITS and self._waits(item, now_s):
            return
        if item.command == Command.NAV_LOITER_UNLIM:
            self._wait_about(self.frame.to_flat(item.position))
            return
        if item.command == Command.NAV_RETURN_TO_LAUNCH:
            self._enter((AUTO, RTL))
            return
        if item.command in _PLACED:
            self.progress.start_m = self.frame.to_flat(item.position)
        self.progress.reached = self.progress.seq
        self.progress.seq += 1
        if self.progress.seq >= len(self.mission):
            self._finish()

    def _waits(self, item: MissionItem, now_s: float) -> bool:
        if self.progress.wait_until_s is None:
            self.progress.wait_until_s = now_s + item.params[0]
        here_m = self.frame.to_flat(item.position) if item.command in _PLACED else self.progress.start_m
        if item.command == Command.NAV_DELAY and self._tells_modes and not self._is_skid:
            self._approach(here_m, nearest_m=_STANDS_M)
        else:
            self._wait_about(here_m)
        if now_s < self.progress.wait_until_s:
            return True
        self.progress.wait_until_s = None
        return False

    def _wait_about(self, place_m: complex) -> None:
        """Wait: PX4's rover with steered wheels drives on about the place."""
        if self._is_skid:
            self._stop()
        else:
            self._pursuit.circle(self.motion, place_m, self._cruise_mps, TICK_S)

    def _finish(self) -> None:
        self.progress.seq = max(0, len(self.mission) - 1)
        self.progress.is_complete = True
        self._say(_INFO, "Mission finished, loitering")
        self._enter((AUTO, HOLD))
        self._late_ticks = 0

    @property
    def _is_skid(self) -> bool:
        return self.parameters.whole("CA_AIRFRAME") in _SKID_AIRFRAMES

    @property
    def _cruise_mps(self) -> float:
        return min(self.progress.speed_mps or math.inf, self.parameters["RO_SPEED_LIM"])

    def _stop(self) -> None:
        """Brake for a tick."""
        if self._is_skid:
            self.motion.speed_mps = 0.0
        else:
            self._pursuit.step(self.motion, None, TICK_S)

    def _approach_item(self, item: MissionItem) -> bool:
        """Drive a tick to a mission's place; return whether it counts as reached: with steered wheels early, where the next leg turns."""
        goal_m = self.frame.to_flat(item.position)
        if self._is_skid:
            return self._approach_straight(goal_m)
        after = self._after()
        if after is None:
            stands = self._tells_modes and self._delays_next
            return self._approach(goal_m, nearest_m=self.parameters["NAV_ACC_RAD"] if stands else None)
        turned_rad = turn_rad(self.progress.start_m, goal_m, after)
        if item.command == Command.NAV_LOITER_TIME:
            turned_rad = 0.0
        if abs(goal_m - self.motion.position_m) <= self._pursuit.reached_m(turned_rad):
            return True
        cruise_mps = self._cruise_mps
        corner_mps = self._pursuit.corner_mps(turned_rad, cruise_mps)
        self._pursuit.step(self.motion, Aim(self.progress.start_m, goal_m, cruise_mps, corner_mps), TICK_S)
        return False

    @property
    def _delays_next(self) -> bool:
        following = self.mission[self.progress.seq + 1 : self.progress.seq + 2]
        return bool(following) and following[0].command == Command.NAV_DELAY

    def _after(self) -> complex | None:
        """Return the place that the mission leads to next, None where it stops before: at its end, for RTL, and for a DELAY of 1.18."""
        for item in self.mission[self.progress.seq + 1 :]:
            if item.command in _PLACED:
                return self.frame.to_flat(item.position)
            if item.command == Command.NAV_RETURN_TO_LAUNCH or (
                item.command == Command.NAV_DELAY and self._tells_modes
            ):
                return None
            if item.command == Command.DO_JUMP:
                target = (
                    self.mission[int(item.params[0])] if 0 <= item.params[0] < len(self.mission) else None
                )
                return (
                    self.frame.to_flat(target.position)
                    if target is not None and target.command in _PLACED
                    else None
                )
        return None

    def _approach(self, goal_m: complex, *, nearest_m: float | None = None) -> bool:
        """Drive a tick to a place to stop at; return whether it is reached."""
        if self._is_skid:
            return self._approach_straight(goal_m)
        radius_m = self.parameters["NAV_ACC_RAD"]
        away_m = abs(goal_m - self.motion.position_m)
        if nearest_m is None and away_m <= radius_m:
            return True
        arrival_mps = 0.0 if nearest_m is None else _CREEPS_MPS
        if nearest_m is not None and away_m <= nearest_m:
            self._stop()
            return True
        self._pursuit.step(
            self.motion, Aim(self.progress.start_m, goal_m, self._cruise_mps, arrival_mps), TICK_S
        )
        return False

    def _approach_straight(self, goal_m: complex) -> bool:
        """Drive a tick straight to a point; return whether it is reached."""
        away_m = goal_m - self.motion.position_m
        step_m = self._cruise_mps * TICK_S
        radius_m = max(self.parameters["NAV_ACC_RAD"], step_m)
        if abs(away_m) <= radius_m:
            return True
        self.motion.heading_rad = math.atan2(away_m.imag, away_m.real)
        self.motion.speed_mps = self._cruise_mps
        self.motion.position_m += away_m / abs(away_m) * step_m
        return False

    def _watch_fence(self, now_s: float) -> None:
        was_outside, self.is_outside = self.is_outside, self._area.clearance_m(self.motion.position_m) < 0
        action = self.parameters.whole("GF_ACTION")
        if not self.is_outside or was_outside or action == 0:
            return
        self.breaches += 1
        self._say(_CRITICAL, "Geofence: approaching or outside geofence")
        if action == 1:
            return
        self._say(_CRITICAL, "Failsafe activated")
        self._enter((AUTO, HOLD))
        self.is_in_failsafe = True
        follows = {3: RTL, 5: LAND}.get(action)
        if follows is not None:
            self._then = (now_s + FAILSAFE_HOLD_S, follows)

    def _say(self, severity: int, text: str) -> None:
        self.texts.append((severity, f"{text}\t"[:50]))
