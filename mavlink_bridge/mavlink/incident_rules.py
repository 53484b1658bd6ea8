"""What autopilots tell of breaches and failsafes, and what they answer them with: data alone, as part of each autopilot's table."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import TYPE_CHECKING

from mavlink_bridge.mavlink.modes import PX4_MODES, px4_mode
from mavlink_bridge.mavlink.rover import Mode

if TYPE_CHECKING:
    from collections.abc import Mapping

DISARMING = -1
"""Stands among modes for disarming."""


@dataclass(frozen=True, slots=True)
class Action:
    """What a parameter of the vehicle's lets it do.

    Parameters
    ----------
    parameter : str
        Its name.
    modes : mapping of int to frozenset of int
        For each of its values the modes that the vehicle may go to.
    """

    parameter: str
    modes: Mapping[int, frozenset[int]]

    def answers(self, parameters: Mapping[str, float]) -> frozenset[int]:
        """Return what the vehicle may do; nothing where its value is not known or means nothing, for then nothing can be claimed."""
        value = parameters.get(self.parameter, math.nan)
        return self.modes.get(int(value), frozenset()) if math.isfinite(value) else frozenset()


@dataclass(frozen=True, slots=True, kw_only=True)
class IncidentRules:
    """How an autopilot tells of breaches and failsafes. Texts are regular expressions that match at a text's beginning, in either case.

    Parameters
    ----------
    breach_text : str
        A breach told by text.
    counts_breaches : bool
        Whether FENCE_STATUS tells of breaches, too, and counts them; where it does not, the text is all there is.
    failsafes : tuple of tuple of str
        A failsafe's text, and what it is called; the first one that fits counts.
    warning : tuple of str, optional
        A text that comes before the change of mode of a failsafe whose own text comes after it, and that failsafe.
    goes_on_text : str, optional
        Tells that a failsafe is not answered.
    actions_of : mapping of str to frozenset of int
        What failsafes are answered with; `any_action` where they do not stand there.
    any_action : frozenset of int
        What any failsafe may be answered with.
    breach_action : Action
        What a breach is answered with.
    failsafe_action : Action, optional
        What those in ``by_parameter`` are answered with.
    by_parameter : frozenset of str
        Failsafes whose answer is a parameter's.
    answered_within_s : float
        So long after it an answer shows in a heartbeat.
    shown_by_heartbeat : bool
        Whether the heartbeat of a vehicle that is in a failsafe says MAV_STATE_CRITICAL, and no other does: without it nothing is the autopilot's doing.
    shown_by_text : frozenset of str
        What is its doing all the same.
    """

    breach_text: str
    counts_breaches: bool = True
    failsafes: tuple[tuple[str, str], ...]
    warning: tuple[str, str] | None = None
    goes_on_text: str | None = None
    actions_of: Mapping[str, frozenset[int]]
    any_action: frozenset[int]
    breach_action: Action
    failsafe_action: Action | None = None
    by_parameter: frozenset[str] = frozenset()
    answered_within_s: float
    shown_by_heartbeat: bool = False
    shown_by_text: frozenset[str] = frozenset()

    def tells_breach(self, text: str) -> bool:
        """Return whether a text of the vehicle tells of a breach."""
        return re.match(self.breach_text, text.strip(), re.IGNORECASE) is not None

    def tells_breach_alone(self, text: str) -> bool:
        """Return whether it does, and nothing else will."""
        return not self.counts_breaches and self.tells_breach(text)


_RADIO, _GCS, _EKF, _BATTERY = "radio failsafe", "ground station failsafe", "EKF failsafe", "battery failsafe"
_CRASH, _TERMINATION = "crash check", "termination"
_ARDUPILOT_ACTIONS: dict[int, frozenset[int]] = {
    0: frozenset(),
    1: frozenset({Mode.RTL, Mode.HOLD}),
    2: frozenset({Mode.HOLD}),
    3: frozenset({Mode.SMART_RTL, Mode.RTL, Mode.HOLD}),
    4: frozenset({Mode.SMART_RTL, Mode.HOLD}),
    5: frozenset({DISARMING}),
    6: frozenset({Mode.LOITER, Mode.HOLD}),
}
"""What FENCE_ACTION and FS_ACTION let a Rover do: it goes to HOLD where it cannot do what is asked, or is more than 100 m outside."""

ARDUPILOT_INCIDENTS = IncidentRules(
    breach_text=r".*\bfences? breached|fence breach(ed)?$",
    failsafes=(
        (r"(radio|throttle) failsafe$", _RADIO),
        (r"gcs failsafe$", _GCS),
        (r"ekf failsafe$", _EKF),
        (r"battery \d+ is (low|critical)|low battery|battery failsafe", _BATTERY),
        (r"crash: ", _CRASH),
        (r"terminating due to ", _TERMINATION),
        (r"[\w ]{1,30}\bfailsafe$", "failsafe"),
    ),
    warning=(r"ekf variance$", _EKF),
    goes_on_text=r"failsafe - continuing",
    actions_of={
        _EKF: frozenset({Mode.HOLD}),
        _CRASH: frozenset({Mode.HOLD, DISARMING}),
        _TERMINATION: frozenset({Mode.HOLD, DISARMING}),
    },
    any_action=frozenset({Mode.RTL, Mode.SMART_RTL, Mode.HOLD, Mode.LOITER, DISARMING}),
    breach_action=Action("FENCE_ACTION", _ARDUPILOT_ACTIONS),
    failsafe_action=Action("FS_ACTION", _ARDUPILOT_ACTIONS),
    by_parameter=frozenset({_RADIO, _GCS}),
    # ArduPilot switches in the same turn of its loop; a heartbeat tells of it at once, and where that is lost, the next one a second later.
    answered_within_s=1.5,
)
"""Rover's fence.cpp, failsafe.cpp, ekf_check.cpp, crash_check.cpp; AP_BattMonitor."""

_NO_MISSION = "no valid mission"
_HOLD, _RTL, _LAND = PX4_MODES.hold, PX4_MODES.rtl, px4_mode(4, 6)

PX4_INCIDENTS = IncidentRules(
    breach_text=r"geofence: (approaching or outside geofence|exceeding maximum distance)",
    counts_breaches=False,
    failsafes=(
        (r"no valid mission available", _NO_MISSION),
        (r"failsafe activated", "failsafe"),
    ),
    actions_of={_NO_MISSION: frozenset({_HOLD})},
    any_action=frozenset({_HOLD, _RTL, _LAND, DISARMING}),
    # 3: HOLD for 5 s, then RTL; 5: HOLD for 5 s, then LAND, and it disarms; 4, which terminates, was not measured.
    breach_action=Action(
        "GF_ACTION",
        {
            0: frozenset(),
            1: frozenset(),
            2: frozenset({_HOLD}),
            3: frozenset({_HOLD, _RTL}),
            5: frozenset({_HOLD, _LAND, DISARMING}),
        },
    ),
    # HOLD for 5 s before RTL or LAND, and a heartbeat a second that does not come at once.
    answered_within_s=7.0,
    shown_by_heartbeat=True,
    shown_by_text=frozenset({_NO_MISSION}),
)
"""As recorded. Battery and lost links are told by texts that were not recorded: what is done about them shows in the heartbeat alone."""
