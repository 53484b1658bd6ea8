"""Situations from recorded logs."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from mavlink_bridge.errors import LogError, VehicleNotFoundError
from mavlink_bridge.fold import FOLDED, fold
from mavlink_bridge.mavlink.messages import AutopilotVersion, Heartbeat, Statustext
from mavlink_bridge.mavlink.vehicles import HeardVehicle, choose_vehicle, vehicles_heard
from mavlink_bridge.tlog import TlogReader
from missions.situation import Situation

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable
    from pathlib import Path

    from mavlink_bridge.tlog import Damage, LogEntry

ABOUT_THE_AUTOPILOT = (Heartbeat, AutopilotVersion, Statustext)
"""What says whose autopilot it is, which version, and how it encodes parameters."""


def begun(entries: Iterable[LogEntry], vehicle: HeardVehicle) -> Situation:
    """Return what is known of a vehicle before a log's first frame: its ids, and what the whole log reports of its autopilot.

    How parameters are encoded, and the version, were so before they were reported.
    """
    situation = Situation(system=vehicle.system, component=vehicle.component, vehicle_type=vehicle.type)
    for entry in entries:
        if isinstance(entry.frame.message, ABOUT_THE_AUTOPILOT):
            told = fold(situation, entry.frame, entry.time_s)
            situation = replace(
                situation, ardupilot=told.ardupilot, reading=told.reading, firmware=told.firmware
            )
    return situation


def vehicle_of(
    path: Path | str, entries: Iterable[LogEntry], system: int | None, *, any_vehicle: bool
) -> HeardVehicle:
    """Return the vehicle of a log that is meant, by its heartbeats.

    Raises
    ------
    LogError
        The log holds no such vehicle, or several and none was chosen.
    """
    try:
        heard = vehicles_heard(entry.frame for entry in entries)
        return choose_vehicle(heard, system, any_vehicle=any_vehicle)
    except VehicleNotFoundError as error:
        raise LogError(f"{path}: {error}", file=str(path)) from None


def situation_from_log(
    path: Path | str,
    system: int | None = None,
    *,
    any_vehicle: bool = False,
    on_damage: Callable[[Damage], None] | None = None,
) -> Situation:
    """Fold a whole log into the situation at its end.

    Parameters
    ----------
    path : Path or str
        A ``.tlog``.
    system : int, optional
        Which vehicle, by MAVLink system id; needed where several were heard.
    any_vehicle : bool
        Accept vehicles other than rovers and boats.
    on_damage : callable, optional
        Told what of the log could not be read, if anything.

    Raises
    ------
    LogError
        The log is missing, empty or not one; or it holds no such vehicle, or several and none was chosen.
    """
    about = list(TlogReader(path, ABOUT_THE_AUTOPILOT))
    situation = begun(about, vehicle_of(path, about, system, any_vehicle=any_vehicle))
    reader = TlogReader(path, FOLDED)
    for entry in reader:
        situation = fold(situation, entry.frame, entry.time_s)
    if on_damage is not None and not reader.damage.is_clean:
        on_damage(reader.damage)
    return situation
