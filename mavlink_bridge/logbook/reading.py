"""From a log file to a logbook: two passes over the file, neither of which keeps it in memory."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from mavlink_bridge.errors import LogError
from mavlink_bridge.fold import fold
from mavlink_bridge.logbook.clock import NEAR_S, SILENCE_S, Pulse, SteadyClock
from mavlink_bridge.logbook.facts import Logbook, VehicleLog
from mavlink_bridge.logbook.log_situation import ABOUT_THE_AUTOPILOT, begun
from mavlink_bridge.logbook.recorder import RECORDED, VehicleRecorder
from mavlink_bridge.mavlink import messages as m
from mavlink_bridge.mavlink.autopilot_facts import with_parameter
from mavlink_bridge.mavlink.parameter_values import parameter_value
from mavlink_bridge.mavlink.vehicles import HeardVehicle, vehicles_heard
from mavlink_bridge.tlog import TlogReader
from mavlink_bridge.tlog.reader import entries
from mavlink_bridge.tlog.survey import TrafficCount

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

    from mavlink_bridge.logbook.recorder import TrackTaker
    from mavlink_bridge.mavlink.messages import Message
    from mavlink_bridge.tlog import LogEntry
    from missions.situation import Situation

_TELLING = {
    *ABOUT_THE_AUTOPILOT,
    *(m.ParamValue, m.HomePosition, m.MissionCount, m.MissionItem, m.MissionItemInt),
    *(m.MissionAck, m.MissionClearAll, m.MissionWritePartialList),
}
"""The message types that may tell of what was so before."""

_AUTOPILOT = 1
"""MAV_COMP_ID_AUTOPILOT1."""


def read_logbook(path: Path, system: int | None = None, *, on_track: TrackTaker | None = None) -> Logbook:
    """Return what a log holds.

    Parameters
    ----------
    path : pathlib.Path
        A ``.tlog`` or ``.raw``, packed or not.
    system : int, optional
        Only this vehicle; default every one that is heard.
    on_track : callable, optional
        Takes every position (`VehicleRecorder`); a logbook itself keeps only a thinned track.

    Raises
    ------
    LogError
        The file is missing, unreadable, empty or no log; or the vehicle asked for is not in it.
    """
    head = _Head(path)
    begins_s, duration_s = head.begins_s, max(0.0, head.duration_s)
    recorders = [
        VehicleRecorder(situation, on_track) for situation in head.first_situations(head.vehicles(system))
    ]
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
        clock_jumps=head.clock_jumps,
        clock_trouble=pulse.trouble,
        traffic=tuple(head.traffic.rows),
        damage=replace(reader.damage, frames=reader.damage.frames + reader.damage.bad_crcs),
        vehicles=logs,
    )


class _Head:
    """What has to be known of a log before its frames are followed, in one pass over it.

    That is who speaks, how long it is, and what is reported late but was so from the beginning: to follow the frames in the same pass, all of them would
    have to be kept until the last has come.

    Parameters
    ----------
    path : pathlib.Path
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._told: list[LogEntry] = []
        self._last: dict[tuple[int, int, str], Message] = {}
        self._last_s = self.begins_s = self.duration_s = 0.0
        self.clock_jumps = 0
        self.traffic = TrafficCount()
        is_first = True
        for block, places in TlogReader(path, _TELLING).blocks():
            self.traffic.take(block)
            self._take_times(_without_outliers(block.time_us / 1e6), is_first=is_first)
            self._told += filter(self._is_news, entries(block, places))
            is_first = False

    def _take_times(self, times_s: NDArray[np.float64], *, is_first: bool) -> None:
        """Add to the length by a clock that only runs forward, and to how often the log's own was set."""
        if is_first:
            self.begins_s = self._last_s = float(times_s[0])
        steps_s = np.diff(times_s, prepend=self._last_s)
        passed = (steps_s >= -NEAR_S) & (steps_s <= SILENCE_S)
        self.duration_s += float(steps_s[passed].sum())
        self.clock_jumps += int((~passed).sum())
        self._last_s = float(times_s[-1])

    def _is_news(self, entry: LogEntry) -> bool:
        """Return whether a frame is to be kept: a heartbeat or parameter that is the same again tells nothing."""
        frame, message = entry.frame, entry.frame.message
        if not isinstance(message, m.Heartbeat | m.ParamValue):
            return True
        key = (frame.system, frame.component, getattr(message, "param_id", ""))
        before, self._last[key] = self._last.get(key), message
        return before != message

    def vehicles(self, system: int | None) -> list[HeardVehicle]:
        """Return the vehicles that are heard, one for each system: its autopilot."""
        heard = vehicles_heard(entry.frame for entry in self._told)
        # The last of a system's entries counts: the autopilot's own component where there is one.
        heard.sort(key=lambda vehicle: (vehicle.system, vehicle.component == _AUTOPILOT))
        chosen = {vehicle.system: vehicle for vehicle in heard}
        if system is None:
            return list(chosen.values())
        if system not in chosen:
            names = ", ".join(f"system {number}" for number in chosen) or "no vehicle"
            raise LogError(f"{self._path}: system {system} was not heard, only {names}", file=str(self._path))
        return [chosen[system]]

    def first_situations(self, vehicles: list[HeardVehicle]) -> list[Situation]:
        """Return the situation of each vehicle when the log begins.

        A parameter or home that is reported later held before, and so did a fence that is first seen when it is read from the vehicle.
        """
        now = {vehicle.system: begun(self._told, vehicle) for vehicle in vehicles}
        first = dict(now)
        for entry in self._told:
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
                if is_first and not isinstance(
                    message, m.MissionAck
                ):  # that ends an upload; it was not so before
                    first[number] = replace(first[number], fence=fence)
                if first[number].home is None and after.home is not None:
                    first[number] = replace(first[number], home=after.home)
        return list(first.values())


def _without_outliers(times_s: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the times with each lone outlier replaced by the time before it: one that lies off both its neighbours."""
    if len(times_s) > 2:
        before, here, after = times_s[:-2], times_s[1:-1], times_s[2:]
        alone = (np.abs(here - before) > NEAR_S) & (np.abs(after - before) <= NEAR_S)
        times_s[1:-1][alone] = before[alone]
    return times_s
