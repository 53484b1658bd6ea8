"""What a rover's own recorded drives add to the drive model's bounds, and take from them."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Final, NamedTuple

from missions.vehicle.measured_corners import LEAST_MORE_M
from missions.words import counted

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from missions.situation import Calibration, CornerClass
    from missions.vehicle.model import Vehicle

TURN_STEP_DEG: Final = 15.0
SPEED_STEP_MPS: Final = 0.5
"""How wide a class of corners is. Chosen: so that 300 of one class come together in a season's logs; within a class the drive model follows angle and speed."""

LEAST_CORNERS: Final = 300
"""Fewer corners of a class never narrow a bound: with 99 % of corners within a bound, the largest of 299 lies beyond it with 95 % confidence (0.99^299 = 0.0495; order
statistics, as in David and Nagaraja, Order Statistics, 3rd edition, 2003, section 7.2: tolerance intervals)."""

_ROUNDING = 1e-4  # speeds and angles come as float32 and from degE7: 1.99999 m/s is 2
_DRIVING = ("WP_", "ATC_", "PSC_", "TURN_", "CRUISE_", "SERVO", "MOT_", "RO_", "RA_", "RD_", "PP_", "NAV_ACC")
_SPEEDS = ("WP_SPEED", "CRUISE_SPEED", "RO_SPEED_LIM")  # classes have theirs


def turn_class(turn_deg: float) -> int:
    """Return the number of a turn's class, from 0."""
    return int((abs(turn_deg) + _ROUNDING) // TURN_STEP_DEG)


def speed_class(speed_mps: float) -> int:
    """Return the number of a speed's class, from 0."""
    return int((speed_mps + _ROUNDING) // SPEED_STEP_MPS)


class CornerMore(NamedTuple):
    """What is added at a corner: to the bound of its cut, to that of its overshoot, and to the corridor about it; only the first two can be negative."""

    inside_m: float = 0.0
    outside_m: float = 0.0
    beyond_m: float = 0.0


def corner_more(vehicle: Vehicle, turn_deg: float, speed_mps: float, *, stands: bool) -> CornerMore:
    """Return what a rover's calibration adds at a corner.

    A class that was driven has its own numbers, never less than the autopilot's measured rows allow (`missions.vehicle.measured_corners`). One that was not
    takes the most that the nearest classes add, and nothing that they take away.

    Parameters
    ----------
    vehicle : Vehicle
    turn_deg : float
        Change of course.
    speed_mps : float
        The faster of the speeds asked for before and after it.
    stands : bool
        Whether the rover stops or turns on the spot there.
    """
    if vehicle.calibration is None:
        return CornerMore()
    turn, speed = turn_class(turn_deg), speed_class(speed_mps)
    classes = [one for one in vehicle.calibration.corners if one.stands == stands]
    for one in classes:
        if turn_class(one.turn_from_deg) == turn and speed_class(one.speed_from_mps) == speed:
            least = least_more_m(str(vehicle.steering), turn, speed)
            return CornerMore(
                max(one.inside_more_m, least[0]), max(one.outside_more_m, least[1]), max(one.beyond_m, 0.0)
            )
    near = _nearest(classes, turn, speed)
    return CornerMore(
        max((one.inside_more_m for one in near if one.inside_more_m > 0), default=0.0),
        max((one.outside_more_m for one in near if one.outside_more_m > 0), default=0.0),
        max((one.beyond_m for one in near), default=0.0),
    )


def _nearest(classes: Iterable[CornerClass], turn: int, speed: int) -> list[CornerClass]:
    """Return the classes nearest in angle and speed together, and those one step farther: on both sides, where there are such."""
    steps = {
        one: abs(turn_class(one.turn_from_deg) - turn) + abs(speed_class(one.speed_from_mps) - speed)
        for one in classes
    }
    least = min(steps.values(), default=0)
    return [one for one, away in steps.items() if away <= least + 1]


def least_more_m(steering: str, turn: int, speed: int) -> tuple[float, float]:
    """Return how far bounds of a class may be narrowed at the most: what the autopilot's measured rows of it left unused; nothing where there are none."""
    return LEAST_MORE_M.get((steering, turn, speed), (0.0, 0.0))


def leg_more_m(vehicle: Vehicle, speed_mps: float) -> float:
    """Return what is added to the straight-line band at a speed: that of its class, else of the nearest on either side."""
    if vehicle.calibration is None or not vehicle.calibration.legs:
        return 0.0
    speed = speed_class(speed_mps)
    steps = {one: abs(speed_class(one.speed_from_mps) - speed) for one in vehicle.calibration.legs}
    least = min(steps.values())
    return max(0.0, *(one.more_m for one, away in steps.items() if away == least))


def calibrated(vehicle: Vehicle, calibration: Calibration | None, parameters: Mapping[str, float]) -> Vehicle:
    """Return a vehicle with its calibration; where it steers otherwise now, or its parameters have changed, that narrows nothing."""
    if calibration is None:
        return vehicle
    is_as_it_was = calibration.steering == str(vehicle.steering) and not changed_parameters(
        calibration, parameters
    )
    return replace(vehicle, calibration=calibration if is_as_it_was else _only_wider(calibration))


def _only_wider(calibration: Calibration) -> Calibration:
    return replace(
        calibration,
        corners=tuple(
            replace(
                one, inside_more_m=max(one.inside_more_m, 0.0), outside_more_m=max(one.outside_more_m, 0.0)
            )
            for one in calibration.corners
        ),
    )


def changed_parameters(calibration: Calibration, parameters: Mapping[str, float]) -> list[str]:
    """Return which parameters that bend the track are other now than when the rover was calibrated."""
    return sorted(
        name
        for name, before in calibration.parameters.items()
        if bends_the_track(name) and abs(parameters.get(name, before) - before) > 1e-6 * max(1.0, abs(before))
    )


def bends_the_track(name: str) -> bool:
    """Return whether a parameter's change may change how corners are driven; of speeds there are classes."""
    return name.startswith(_DRIVING) and name not in _SPEEDS


def calibration_info(vehicle: Vehicle) -> tuple[str, ...]:
    """Return on how many drives a vehicle's corridor rests besides the drive model."""
    calibration = vehicle.calibration
    if calibration is None:
        return ()
    corners = sum(one.corners for one in calibration.corners)
    return (
        f"calibrated from {counted(calibration.drives, 'drive')} of vehicle {calibration.system} ({counted(corners, 'corner')})",
    )


def calibration_warnings(calibration: Calibration | None, parameters: Mapping[str, float]) -> list[str]:
    """Return a warning where the vehicle drives with other parameters than when it was calibrated."""
    if calibration is None or not (changed := changed_parameters(calibration, parameters)):
        return []
    shown = ", ".join(
        f"{name} {parameters[name]:g} (then {calibration.parameters[name]:g})" for name in changed[:3]
    )
    more = f" and {len(changed) - 3} more" if len(changed) > 3 else ""
    return [
        f"parameters have changed since the rover was calibrated: {shown}{more}; the calibration widens the corridor, and narrows it nowhere"
    ]
