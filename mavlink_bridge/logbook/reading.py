"""From a log file to a logbook: passes over the file, none of which keeps it in memory."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from mavlink_bridge.errors import LogError
from mavlink_bridge.fold import FOLDED, fold
from mavlink_bridge.logbook.clock import NEAR_S, SILENCE_S, Pulse, SteadyClock
from mavlink_bridge.logbook.facts import Logbook, VehicleLog
from mavlink_bridge.logbook.log_situation import begun
from mavlink_bridge.logbook.recorder import RECORDED, VehicleRecorder
from mavlink_bridge.mavlink import messages as m
from mavlink_bridge.mavlink.autopilot_facts import with_parameter
from mavlink_bridge.mavlink.parameter_values import parameter_value
from mavlink_bridge.mavlink.vehicles import HeardVehicle, vehicles_heard
from mavlink_bridge.tlog import TlogReader, survey

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

    from missions.situation import Situation

_AUTOPILOT = 1
"""MAV_COMP_ID_AUTOPILOT1."""


def read_logbook(path: Path, system: int | None = None) -> Logbook:
    """Return what a log holds.

    Parameters
    ----------
    path : pathlib.Path
        A ``.tlog`` or ``.raw``, packed or not.
    system : int, optional
        Only this vehicle; default every one that is heard.

    Raises
    ------
    LogError
        The file is missing, unreadable, empty or no log; or the vehicle asked for is not in it.
    """
    traffic, damage = survey(path)
    begins_s, duration_s, jumps = _span(path)
    vehicles = _vehicles(path, system)
    recorders = [VehicleRecorder(situation) for situation in _first_situations(path, vehicles)]
    clock = SteadyClock()
    clock.advance(begins_s, None)
    reader = TlogReader(path, RECORDED)
    pulse = Pulse()
    for entry, now_s in clock.over(reader):
        pulse.take(entry.frame, now_s)
        for recorder in recorders:
            recorder.take(entry.frame, now_s - begins_s)
    logs: tuple[VehicleLog, ...] = tuple(recorder.finish(duration_s) for recorder in recorders)
    return Logbook(
        name=path.name,
        begins_s=begins_s,
        duration_s=duration_s,
        has_timestamps=reader.has_timestamps,
        clock_jumps=jumps,
        clock_trouble=pulse.trouble,
        traffic=tuple(traffic),
        damage=replace(damage, bad_crcs=reader.damage.bad_crcs),
        vehicles=logs,
    )


def _span(path: Path) -> tuple[float, float, int]:
    """Return when a log begins, how long it is by a clock that only runs forward, and how often its own was set."""
    begins_s: float | None = None
    last_s = duration_s = 0.0
    jumps = 0
    for block, _ in TlogReader(path, []).blocks():
        times_s = _without_outliers(block.time_us / 1e6)
        if begins_s is None:
            begins_s = last_s = float(times_s[0])
        steps_s = np.diff(times_s, prepend=last_s)
        passed = (steps_s >= -NEAR_S) & (steps_s <= SILENCE_S)
        duration_s += float(steps_s[passed].sum())
        jumps += int((~passed).sum())
        last_s = float(times_s[-1])
    return begins_s or 0.0, max(0.0, duration_s), jumps


def _without_outliers(times_s: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the times with each lone outlier replaced by the time before it: one that lies off both its neighbours."""
    if len(times_s) > 2:
        before, here, after = times_s[:-2], times_s[1:-1], times_s[2:]
        alone = (np.abs(here - before) > NEAR_S) & (np.abs(after - before) <= NEAR_S)
        times_s[1:-1][alone] = before[alone]
    return times_s


def _vehicles(path: Path, system: int | None) -> list[HeardVehicle]:
    """Return the vehicles that are heard, one for each system: its autopilot."""
    heard = vehicles_heard(entry.frame for entry in TlogReader(path, {m.Heartbeat}))
    # The last of a system's entries counts: the autopilot's own component where there is one.
    heard.sort(key=lambda vehicle: (vehicle.system, vehicle.component == _AUTOPILOT))
    chosen = {vehicle.system: vehicle for vehicle in heard}
    if system is None:
        return list(chosen.values())
    if system not in chosen:
        names = ", ".join(f"system {number}" for number in chosen) or "no vehicle at all"
        raise LogError(f"{path}: system {system} was not heard, only {names}", file=str(path))
    return [chosen[system]]


def _first_situations(path: Path, vehicles: list[HeardVehicle]) -> list[Situation]:
    """Return the situation of each vehicle when the log begins.

    A parameter or home that is reported later held before, and so did a fence that is first seen when it is read from the vehicle.
    """
    now = {vehicle.system: begun(path, vehicle) for vehicle in vehicles}
    first = dict(now)
    for entry in TlogReader(path, FOLDED - {m.GlobalPositionInt}):
        message = entry.frame.message
        if isinstance(message, m.ParamValue):
            known = first.get(entry.frame.system)
            if known is not None and message.param_id not in known.parameters:
                value = parameter_value(message, bytewise=bool(known.bytewise))
                first[entry.frame.system] = with_parameter(known, message.param_id, value)
            continue
        for number, before in now.items():
            after = now[number] = fold(before, entry.frame, entry.time_s)
            fence = after.fence
            is_first = before.fence is None and fence is not None and first[number].fence is None
            if is_first and fence is not None and fence.source.endswith("read-back"):
                first[number] = replace(first[number], fence=fence)
            if first[number].home is None and after.home is not None:
                first[number] = replace(first[number], home=after.home)
    return list(first.values())
