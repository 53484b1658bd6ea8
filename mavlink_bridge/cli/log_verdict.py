"""What a log shows of a vehicle's drives, in words: where it left the fence, how its drives compare with the prediction, the verdict."""

from __future__ import annotations

from typing import TYPE_CHECKING

from mavlink_bridge.logbook.grade import OUTSIDE_M

if TYPE_CHECKING:
    from collections.abc import Iterable

    from mavlink_bridge.logbook import Intrusion, VehicleLog
    from mavlink_bridge.logbook.grade import Grade

_MOST_LINES = 40  # of one kind, so that they fit a terminal's screen; chosen


def place_in_words(intrusion: Intrusion) -> str:
    """Return on which side of which zone a vehicle was, and how deep."""
    side = "inside" if intrusion.zone.startswith("exclusion") else "outside"
    if not intrusion.deepest_m:  # a line that crossed it from one position to the next
        return f"{side} {intrusion.zone} between two positions"
    return f"{intrusion.deepest_m:.2f} m {side} {intrusion.zone}"


def findings(vehicle: VehicleLog) -> Iterable[str]:
    """Return line by line where the vehicle came near to the fence or left it, how it drove, and what to know besides."""
    near = vehicle.nearest
    if near is not None and not vehicle.intrusions:
        yield f"Least clearance: {near.clearance_m:.2f} m at {near.time_s:.1f} s, {near.position}, {near.zone}"
    first = max(0, len(vehicle.intrusions) - _MOST_LINES)
    for number, intrusion in enumerate(vehicle.intrusions[first:], start=first + 1):
        deepest = f" (deepest at {intrusion.position})" if intrusion.position != intrusion.begun_at else ""
        yield (
            f"Breach {number}: left the fence at {intrusion.begun_s:.1f} s, {intrusion.begun_at}; "
            f"{place_in_words(intrusion)}{deepest}, until {intrusion.ended_s:.1f} s"
        )
    if vehicle.reported_breaches:
        last = vehicle.reported_breaches[-1]
        yield f"Breaches reported by the autopilot: {len(vehicle.reported_breaches)}, the last at {last.time_s:.1f} s"
    for number, grade in enumerate(vehicle.grades[:_MOST_LINES], start=1):
        yield from _graded(number, grade)
    yield from (f"Note: {note}" for note in vehicle.notes)


def verdict(vehicle: VehicleLog) -> tuple[str, bool]:
    """Return how a vehicle kept to the fence and to what was predicted, in one line; and whether it did."""
    intrusions, near = vehicle.intrusions, vehicle.nearest
    strayed = [number for number, grade in enumerate(vehicle.grades, 1) if grade.is_as_foreseen is False]
    if intrusions:
        deepest = max(intrusions, key=lambda one: one.deepest_m)
        times = "once:" if len(intrusions) == 1 else f"{len(intrusions)} times, at most"
        told = f"left the fence {times} {place_in_words(deepest)}"
    elif near is not None:
        told = f"stayed inside the fence; least clearance {near.clearance_m:.2f} m, from {near.zone}"
    elif vehicle.fences:
        told = "the track was not compared with the fence"
        if not vehicle.driven_m:
            told = f"never drove while armed: {told}"
    else:
        told = "no fence in the log, so no clearance was measured"
    reported = len(vehicle.reported_breaches)
    parts = [told]
    if reported:
        parts.append(f"the autopilot reported {reported} breach{'es' * (reported > 1)}")
    if strayed:
        names = ", ".join(map(str, strayed))
        parts.append(f"drive{'s' * (len(strayed) > 1)} {names} left the predicted corridor")
    return "; ".join(parts), not (intrusions or reported or strayed)


def names_of_stretches(vehicle: VehicleLog) -> list[str]:
    """Return the name of each stretch of a track: the drive of a mission that it is, else its mode."""
    names = [part.mode for part in vehicle.track]
    for number, grade in enumerate(vehicle.grades, start=1):
        begun = [
            place
            for place, part in enumerate(vehicle.track)
            if part.begun_s <= grade.begun_s + _HEARTBEATS_S and part.mode.startswith("AUTO")
        ]
        if begun:
            names[begun[-1]] = f"drive {number} ({vehicle.track[begun[-1]].mode})"
    return names


_HEARTBEATS_S = 2.0
"""A drive is found to have begun up to a heartbeat and a half before its mode was reported (`logbook.drives`)."""


def _graded(number: int, grade: Grade) -> Iterable[str]:
    foreseen = grade.foreseen
    ending = "arrived" if grade.arrived else f"{grade.reached} of {grade.items} waypoints reached"
    yield f"Drive {number} from {grade.begun_s:.1f} s: items {grade.first_item} to {grade.last_item}, {grade.driven_m:.1f} m, {ending}"

    def compared(name: str, found: float | None, told: float | None, unit: str) -> Iterable[str]:
        if found is not None:
            beside = "" if told is None else f", {told:.2f} {unit} predicted"
            yield f"  {name}: {found:.2f} {unit}{beside}"

    told = (
        (None, None, None)
        if foreseen is None
        else (foreseen.least_clearance_m, foreseen.deviation_m, foreseen.took_s)
    )
    if told[0] == 0 and grade.least_clearance_m is not None:
        kept = f"{grade.least_clearance_m:.2f} m" if grade.least_clearance_m else "left the fence"
        yield f"  least clearance: {kept}; predicted to leave the fence"
    elif grade.least_clearance_m == 0:
        yield f"  least clearance: left the fence{'' if told[0] is None else f'; {told[0]:.2f} m predicted'}"
    else:
        yield from compared("least clearance", grade.least_clearance_m, told[0], "m")
    yield from compared("farthest from the straight legs", grade.deviation_m, told[1], "m")
    yield from compared("time to the last waypoint reached", grade.took_s, told[2], "s")
    if grade.outside_m is not None:
        yield f"  {_corridor(grade.outside_m)}"
    yield from (f"  {note}" for note in grade.notes)


def _corridor(outside_m: float) -> str:
    if outside_m < 0.005:
        return "within the predicted corridor"
    if outside_m <= OUTSIDE_M:
        return f"within the predicted corridor and the {OUTSIDE_M:g} m allowed for position error ({outside_m:.2f} m outside it)"
    return f"{outside_m:.2f} m outside the predicted corridor ({OUTSIDE_M:g} m is allowed for position error)"
