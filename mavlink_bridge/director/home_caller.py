"""The part of the director that calls the vehicle home by a route (`--rtl-by-route`), and knows when its call counts for nothing.

Data flow
---------
A call is a target whose place is chosen when the vehicle stands, so it goes the way of every target, through the same table of states::

    RTL, battery, silence, breach ──HomeCaller──► Target(call) ──inbox──► HOLD ──desk: HomeTask──► plan to the nearest place ──► verified ──► AUTO

Who calls
---------
RTL        the vehicle is seen in RTL or SMART_RTL, or a ground station asks it for that, with `--rtl-by-route`; whoever it was
battery    at or below what the options say, or the autopilot's own text of a low battery (`battery_watch`)
silence    no heartbeat of a ground station for so long, once one was heard
breach     FENCE_STATUS tells of a breach on a drive of ours, or a text does, of an autopilot that sends none

The last three call only a vehicle that we have in hand: one on our drive, or that stands in HOLD since it has arrived. What an operator drives, or has
stopped, is left to the operator, and that is said.

Why this is the one exception to the operator's word
----------------------------------------------------
RTL drives straight, through whatever lies between. So the first RTL is answered by HOLD and a way round. The second one counts as said: it is left to the
autopilot, like any other mode at any moment. Which one it is:

- what is seen or heard within a few seconds of the first is the same press, said again by a ground station that missed the answer: HOLD once more;
- an RTL that the autopilot has answered a failsafe with, which was heard, is nobody's second: it is answered each time;
- after the operator has taken over a way home, RTL within a minute is the second one still: a transmitter cannot press RTL twice but through another mode.

That it was the second, and is left to the operator, is said. The count begins anew with an arrival and with another target. An RTL from before the bridge knew the vehicle, or from while it was not heard, is not answered.

Where it waits
--------------
Without a 3D fix the vehicle is held and the way waits for one (`RouteDesk`). On the way a fix that is worse than the plan has room for is answered by HOLD.
Where no place can be reached it holds, and tries again when fence, places or fix are others than before: never straight home.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from mavlink_bridge.director import clash
from mavlink_bridge.director.battery_watch import BatteryWatch
from mavlink_bridge.director.core import Core, Part
from mavlink_bridge.director.events import EventName
from mavlink_bridge.director.fixes import fix_trouble, is_better
from mavlink_bridge.director.incidents import BreachTexts
from mavlink_bridge.director.orders import TargetSource
from mavlink_bridge.director.states import ON_VEHICLE, Notice, Signal, State
from mavlink_bridge.director.targets import HomeCall, Target
from mavlink_bridge.mavlink import messages as m
from missions.geo import LatLon

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from mavlink_bridge.director.halter import Halter
    from mavlink_bridge.director.home_keeper import HomeKeeper
    from mavlink_bridge.director.takeover import Takeover
    from mavlink_bridge.director.target_inbox import TargetInbox
    from mavlink_bridge.mavlink.messages import Frame
    from missions.situation import Fix

SAME_PRESS_S = 4.0
"""QGroundControl says a command that is not answered again after 3 s, Mission Planner says each mode twice at once; a link adds to it. Chosen, not measured."""

OVERRULED_S = 60.0
"""So long after a way home was taken over an RTL is the second one still; chosen, not measured."""

_BAD_FIXES = 3
"""So many GPS_RAW_INT in a row have to tell of a fix that is too bad: one may be a moment's; ArduPilot sends two a second. Chosen, not measured."""

_TRY_AGAIN_S = 5.0
"""Between two attempts, with better fixes or after a failed upload; chosen, not measured."""

_STALE_S = 1.5
"""For so long after the HOLD at a drive's end a heartbeat may still show AUTO."""

_ABROAD = frozenset({State.LISTENING, State.LOST, State.DONE, State.FAILED}) | clash.CLASHES
"""States in which nothing is answered."""

_BUSY = frozenset({State.LEARNING, State.UPLOADING, State.WITHDRAWING})
"""States that a call waits for."""

_IN_HAND = frozenset(
    {
        State.HOLDING,
        State.PLANNING,
        State.PROPOSED,
        State.UPLOADING,
        *ON_VEHICLE,
        State.STARTING,
        State.DRIVING,
        State.ARRIVED,  # until its HOLD is taken; who is watched for after that is said by `_arrived_s`
    }
)
"""States in which an armed vehicle that is watched for takeovers is ours."""


class HomeCaller(Part):
    """Hears what calls the vehicle home, and answers.

    Parameters
    ----------
    core : Core
        What all parts share.
    inbox : TargetInbox
        Takes a call as a target.
    halter : Halter
        Stops the vehicle.
    keeper : HomeKeeper
        Knows the nearest place.
    """

    def __init__(self, core: Core, inbox: TargetInbox, halter: Halter, keeper: HomeKeeper) -> None:
        super().__init__(core)
        homing = core.orders.homing
        self._inbox = inbox
        self._halter = halter
        self._keeper = keeper
        self._battery = BatteryWatch(homing.battery_percent, homing.battery_volts)
        self._station_s: float | None = (
            None  # when a ground station was last heard; None before, and once that was answered
        )
        self._rtl_s: float | None = None  # when the operator's RTL was answered on this way home
        self._overruled_s = -math.inf
        self._second_s = -math.inf  # when the second RTL was heard or seen last
        self._is_seen = True  # the mode told last was told a moment ago
        self._was_breached = False
        self._breach_texts = BreachTexts()
        self._bad_fixes = 0
        self._arrived_s: float | None = None  # since when it stands in HOLD after a drive of ours
        self._refused_fix: Fix | None = None
        self._refused_s = (
            math.inf
        )  # when a way home came to nothing; not to be tried again as long as none did

    @property
    def deadline_s(self) -> float | None:
        """When the silence of all ground stations is answered."""
        timeout_s = self.core.orders.homing.gcs_timeout_s
        if timeout_s is None or self._station_s is None or not self._is_on:
            return None
        return self._station_s + timeout_s

    def handle_timer(self, now_s: float) -> Sequence[Signal]:
        """Answer the silence of all ground stations, once."""
        due_s = self.deadline_s
        if due_s is None or now_s < due_s:
            return []
        self._station_s = None
        return self._call_in_hand(HomeCall.GCS, f"for {self.core.orders.homing.gcs_timeout_s:g} s", now_s)

    def receive(self, frame: Frame, now_s: float) -> Iterable[Signal]:
        """Take a frame of anybody."""
        core, message = self.core, frame.message
        if not self._is_on:
            return []
        if not core.is_from_vehicle(frame):
            self._hear_station(frame, now_s)
            return []
        if isinstance(message, m.Heartbeat):
            return self._take_heartbeat(message, now_s)
        if isinstance(message, m.GpsRawInt):
            return self._look_at_fix(now_s)
        if isinstance(message, m.FenceStatus):
            return self._look_at_breach(message, now_s)
        if isinstance(message, m.Statustext) and self._tells_breach(message, now_s):
            return self._take_breach(now_s)
        low = self._battery.receive(message, now_s)
        return self._call_in_hand(HomeCall.BATTERY, low, now_s) if low else []

    @property
    def _is_on(self) -> bool:
        orders = self.core.orders
        is_allowed = orders.homing.by_route and orders.drive and not (orders.once or orders.passive)
        return is_allowed and self.core.state not in _ABROAD

    @property
    def _is_called(self) -> bool:
        """Whether the vehicle is on its way home, or waits to be."""
        targets = (self.core.target, self._inbox.waiting)
        return any(target is not None and target.is_home for target in targets)

    # What calls

    def answer(self, taken: Takeover, now_s: float, *, by_autopilot: bool) -> Sequence[Signal] | None:
        """Return what follows from an RTL that is answered by a route; None where the takeover counts as said.

        Parameters
        ----------
        taken : Takeover
            What was done to the vehicle's mode.
        now_s : float
            When.
        by_autopilot : bool
            Whether the autopilot is known to have done it by a failsafe or a breach.
        """
        if taken.mode not in self.core.modes.homing or not self._is_on or not self.core.situation.armed:
            return None
        if self._rtl_s is not None and now_s <= self._rtl_s + SAME_PRESS_S:
            return self._hold_again(now_s)
        is_second = self._rtl_s is not None or now_s <= self._overruled_s + OVERRULED_S
        if is_second and not by_autopilot:
            self._leave_second(taken.mode, now_s)
            return None
        if not by_autopilot:
            self._rtl_s = now_s
        if self._is_called and by_autopilot:
            return self._hold_again(now_s)
        return self._call(HomeCall.RTL, self.core.modes.words(taken.mode), now_s)

    def _leave_second(self, mode: int, now_s: float) -> None:
        """Report once that this RTL is the second one, which is not answered: who pressed it may wait for a route."""
        if now_s > self._second_s + SAME_PRESS_S:
            name = self.core.modes.words(mode)
            text = f"second {name} is yours: drives straight home"
            why = "the second one: the vehicle is left to the operator"
            self.core.voice.tell(now_s, EventName.CALL_IGNORED, text, name, why)
        self._second_s = now_s

    def sees_rtl(self, mode: int) -> bool:
        """Return whether a heartbeat shows an RTL that has just begun, where nobody watches for takeovers; one from before the first heartbeat is nobody's call."""
        before = self.core.before.mode if self._is_seen else None
        homing = self.core.modes.homing
        is_new = mode in homing and before is not None and before not in homing
        return is_new and self._is_on and not (self.core.operator.is_on or self._is_called)

    def _take_heartbeat(self, heartbeat: m.Heartbeat, now_s: float) -> Sequence[Signal]:
        """Notice whether a vehicle still stands where it has arrived."""
        self._is_seen = True
        is_armed = bool(heartbeat.base_mode & m.ModeFlag.SAFETY_ARMED)
        is_held = is_armed and heartbeat.custom_mode == self.core.modes.hold
        if self._arrived_s is not None and not is_held and now_s > self._arrived_s + _STALE_S:
            self._arrived_s = None
        return []

    def _hear_station(self, frame: Frame, now_s: float) -> None:
        message = frame.message
        is_ours = (frame.system, frame.component) == self.core.identity
        if isinstance(message, m.Heartbeat) and message.type == m.MavType.GCS and not is_ours:
            self._station_s = now_s

    def _look_at_breach(self, status: m.FenceStatus, now_s: float) -> Sequence[Signal]:
        was_breached, self._was_breached = self._was_breached, bool(status.breach_status)
        return self._take_breach(now_s) if self._was_breached and not was_breached else []

    def _tells_breach(self, message: m.Statustext, now_s: float) -> bool:
        return self._breach_texts.tells_new(message.text, self.core.autopilot.incidents, now_s)

    def _take_breach(self, now_s: float) -> Sequence[Signal]:
        if self.core.state not in (State.STARTING, State.DRIVING):
            return []
        if self._is_called:
            return self._hold_again(now_s)
        return self._call_in_hand(HomeCall.BREACH, "", now_s)

    def _call_in_hand(self, call: HomeCall, detail: str, now_s: float) -> Sequence[Signal]:
        """Call a vehicle that we have in hand; leave any other to who has it, and say so."""
        core = self.core
        if self._is_called:
            return []
        if core.situation.armed and self._is_in_hand:
            return self._call(call, detail, now_s)
        text = f"{_named(call, detail)}: not called home, because this bridge is not driving the vehicle"
        core.voice.tell(now_s, EventName.CALL_IGNORED, text, str(call), "not on a drive of this bridge")
        return []

    @property
    def _is_in_hand(self) -> bool:
        """Whether the vehicle is on a drive of ours, or stands in our HOLD since: also where it waits for an obstacle to go, or has no route."""
        core = self.core
        if core.state is State.ARRIVED and self._arrived_s is not None:
            return True
        is_held = core.state is State.READY and core.operator.is_ours(core.modes.hold)
        return core.operator.is_on and (core.state in _IN_HAND or is_held)

    def _call(self, call: HomeCall, detail: str, now_s: float) -> Sequence[Signal]:
        text = f"called home ({_named(call, detail)}): HOLD, then a route home"
        self.core.voice.tell(now_s, EventName.CALLED_HOME, text, str(call), detail)
        self._bad_fixes = 0
        self._refused_s = math.inf
        return self._inbox.take_call(Target(self._guess, TargetSource.HOME, call=call))

    @property
    def _guess(self) -> LatLon:
        """The place as far as it is known before the vehicle stands."""
        if self._keeper.way is not None:
            return self._keeper.way.place.position
        situation = self.core.situation
        if situation.home is not None:
            return situation.home.value
        return situation.pose.value.position if situation.pose is not None else LatLon(0.0, 0.0)

    def _hold_again(self, now_s: float) -> Sequence[Signal]:
        """Stop the vehicle once more: it may have set off after our HOLD; where nothing is to be driven home, it is only held."""
        core, waiting = self.core, self._inbox.waiting
        if core.state not in _BUSY:
            if core.target is not None and core.target.is_home:
                return [Notice.ROUTE_WANTED]
            if waiting is not None and waiting.is_home:  # it was to go on first; now it has set off
                return self._inbox.take_call(Target(self._guess, TargetSource.HOME, call=HomeCall.RTL))
        self._halter.command_hold(now_s)
        return []

    # The fix

    def _look_at_fix(self, now_s: float) -> Sequence[Signal]:
        """Hold a vehicle on its way home whose fix is too bad for the plan; try again with a better one where no way was found."""
        core, target = self.core, self.core.target
        if target is None or target.call is None:
            return []
        if core.state is State.READY:
            is_due = now_s >= self._refused_s + _TRY_AGAIN_S
            if not is_due or not is_better(core.situation, self._refused_fix):
                return []
            self._refused_s = math.inf
            return [Notice.ROUTE_WANTED]
        if core.state is not State.DRIVING:
            self._bad_fixes = 0
            return []
        trouble = fix_trouble(core.situation, core.plan, core.orders.request)
        self._bad_fixes = self._bad_fixes + 1 if trouble else 0
        if self._bad_fixes < _BAD_FIXES:
            return []
        self._bad_fixes = 0
        core.voice.home_waits(now_s, target.call, trouble)
        return [Notice.ROUTE_WANTED]

    # What others tell

    def learnt(self, now_s: float) -> None:
        """Report to those who may press RTL what comes of it: they do not read what is printed beside the vehicle."""
        if self._is_on:
            text = "RTL once: round fences; RTL again: straight"
            self.core.voice.tell(now_s, EventName.RTL_BY_ROUTE, text)

    def planned(self, now_s: float) -> None:
        """Report where a way home leads."""
        core = self.core
        target, plan = core.target, core.plan
        assert target is not None
        assert plan is not None
        core.target = Target(plan.targets[-1], TargetSource.HOME, call=target.call)
        core.voice.going_home(now_s, target.call, self._keeper.name_of(plan.targets[-1]), plan)

    def refused(self, now_s: float) -> None:
        """Take notice that no way home was found, which was told: the vehicle is held, and nothing drives it straight."""
        fix = self.core.situation.fix
        self._refused_fix, self._refused_s = fix.value if fix is not None else None, now_s
        call = self.core.target.call if self.core.target is not None else None
        self.core.voice.home_waits(
            now_s, call, "until a change of the fence, the places or the GPS fix makes a way possible"
        )

    def not_written(self, now_s: float) -> None:
        """Take notice that an upload has failed, which was told: a way home is tried again a little later."""
        target = self.core.target
        if target is None or not target.is_home:
            return
        self._refused_fix, self._refused_s = None, now_s
        text = f"the upload failed; it is tried again in {_TRY_AGAIN_S:.0f} s"
        self.core.voice.home_waits(now_s, target.call, text)

    def not_held(self) -> None:
        """Take notice that a HOLD was not taken, which was told: the vehicle may drive straight, so that it is tried again at once."""
        self._refused_fix, self._refused_s = None, -math.inf

    def try_again(self) -> Sequence[Signal]:
        """Return that a way home is wanted again, where none was found on another field than the one now known."""
        target = self.core.target
        is_waiting = self.core.state is State.READY and target is not None and target.is_home
        return [Notice.ROUTE_WANTED] if is_waiting else []

    def begin_anew(self) -> None:
        """Take notice of an arrival, or of another target: the next RTL is a first one."""
        self._rtl_s = None
        self._overruled_s = -math.inf
        self._arrived_s = None

    def arrived(self, now_s: float) -> None:
        """Take notice that a drive of ours has ended in HOLD."""
        self.begin_anew()
        self._arrived_s = now_s

    def adopted(self, now_s: float) -> None:
        """Take notice that a way home of an earlier run goes on: the RTL that it answered was the first one."""
        target = self.core.target
        if target is not None and target.call is HomeCall.RTL:
            self._rtl_s = now_s - SAME_PRESS_S

    def overruled(self, now_s: float) -> None:
        """Take notice that somebody has taken the vehicle; on its way home that is remembered for a while."""
        if self._is_called:
            self._overruled_s = now_s
        self._rtl_s = self._arrived_s = None

    def lose_sight(self) -> None:
        """Take notice that the vehicle is not heard, or was switched off and on: what is seen next is nobody's call."""
        self.begin_anew()
        self._is_seen = False
        self._station_s = None
        self._was_breached = False
        self._keeper.forget()


def _named(call: HomeCall, detail: str) -> str:
    if call is HomeCall.RTL and detail == HomeCall.RTL:
        return detail
    if call is HomeCall.GCS:
        return f"{call} {detail}"
    return f"{call}: {detail}" if detail else str(call)
