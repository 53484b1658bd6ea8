"""Situations from recorded logs."""

from __future__ import annotations

from typing import TYPE_CHECKING

from mavlink_bridge.errors import VehicleNotFoundError
from mavlink_bridge.fold import FOLDED, Vehicle, fold, vehicles_heard
from mavlink_bridge.messages import Heartbeat
from mavlink_bridge.tlog import TlogReader
from missions.situation import Situation

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path


def situation_from_log(path: Path, system: int | None = None, *, any_vehicle: bool = False) -> Situation:
    """Fold a whole log into the situation at its end.

    Parameters
    ----------
    path : Path
        A ``.tlog``.
    system : int, optional
        Which vehicle, by MAVLink system id; needed where several were heard.
    any_vehicle : bool
        Take vehicles that are neither rover nor boat too.

    Raises
    ------
    LogError
        The log is missing, empty or not one.
    VehicleNotFoundError
        No such vehicle, or several and none chosen.
    """
    vehicles = vehicles_heard(entry.frame for entry in TlogReader(path, {Heartbeat}))
    vehicle = choose_vehicle(vehicles, system, any_vehicle=any_vehicle, where=str(path))
    situation = Situation(system=vehicle.system, component=vehicle.component, vehicle_type=vehicle.type)
    for entry in TlogReader(path, FOLDED):
        situation = fold(situation, entry.frame, entry.time_s)
    return situation


def choose_vehicle(
    vehicles: Sequence[Vehicle], system: int | None, *, any_vehicle: bool, where: str
) -> Vehicle:
    """Choose the vehicle that is meant among those heard.

    Raises
    ------
    VehicleNotFoundError
        Nobody fits, or several do and no system id was given; says who was heard.
    """
    heard = ", ".join(f"system {v.system} (MAV_TYPE {v.type})" for v in vehicles) or "no vehicle"
    fitting = [v for v in vehicles if system in (None, v.system)]
    rovers = [v for v in fitting if any_vehicle or v.is_rover]
    if len({v.system for v in rovers}) > 1:
        raise VehicleNotFoundError(
            f"{where}: several vehicles were heard ({heard}); choose one with --system N"
        )
    if rovers:
        return rovers[0]
    if fitting:
        raise VehicleNotFoundError(
            f"{where}: {heard} is no rover (MAV_TYPE 10 or 11); --any-vehicle takes it all the same"
        )
    wanted = "a vehicle" if system is None else f"system {system}"
    raise VehicleNotFoundError(
        f"{where}: {wanted} was not heard, only {heard}" if vehicles else f"{where}: no vehicle's HEARTBEAT"
    )
