"""Who is on a stream: telling vehicles from ground stations and companions, and choosing the one that is meant."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from mavlink_bridge.errors import VehicleNotFoundError
from mavlink_bridge.mavlink import messages as m

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from mavlink_bridge.mavlink.messages import Frame


class HeardVehicle(NamedTuple):
    """A vehicle heard on a stream: its ids and its MAV_TYPE."""

    system: int
    component: int
    type: int

    @property
    def is_rover(self) -> bool:
        """Whether it is a ground rover or a boat."""
        return self.type in (m.MavType.GROUND_ROVER, m.MavType.SURFACE_BOAT)


def vehicles_heard(frames: Iterable[Frame]) -> list[HeardVehicle]:
    """Return the vehicles (not ground stations, companions or other components) that sent a HEARTBEAT, in order of system id."""
    return sorted(
        {
            HeardVehicle(frame.system, frame.component, frame.message.type)
            for frame in frames
            if isinstance(frame.message, m.Heartbeat) and is_vehicle(frame.message)
        }
    )


def is_vehicle(heartbeat: m.Heartbeat) -> bool:
    """Return whether a HEARTBEAT is an autopilot's."""
    return heartbeat.autopilot != m.Autopilot.INVALID and heartbeat.type != m.MavType.GCS


def choose_vehicle(heard: Sequence[HeardVehicle], system: int | None, *, any_vehicle: bool) -> HeardVehicle:
    """Choose the vehicle that is meant among those heard.

    Raises
    ------
    VehicleNotFoundError
        Nobody fits, or several do and no system id was given; the message names who was heard.
    """
    names = ", ".join(f"system {v.system} (MAV_TYPE {v.type})" for v in heard)
    fitting = [v for v in heard if system in (None, v.system)]
    chosen = [v for v in fitting if any_vehicle or v.is_rover]
    if len({v.system for v in chosen}) > 1:
        raise VehicleNotFoundError(f"several vehicles were heard ({names}); choose one with --system N")
    if chosen:
        return chosen[0]
    if not heard:
        raise VehicleNotFoundError("no vehicle's HEARTBEAT was heard")
    if fitting:
        raise VehicleNotFoundError(
            f"{names} is not a rover or boat (MAV_TYPE 10 or 11); --any-vehicle accepts it"
        )
    raise VehicleNotFoundError(f"system {system} was not heard, only {names}")


def not_known(system: int | None, autopilot: int | None) -> VehicleNotFoundError:
    """Return the error that a vehicle is, whose autopilot is not known here.

    Whether a mission's first item is home, how waypoints are driven, how lists are stored and what modes are called is each autopilot's own:
    of another one nothing could be promised.

    Parameters
    ----------
    system : int or None
        The vehicle's system id.
    autopilot : int or None
        MAV_AUTOPILOT of its heartbeat; None is one that is not known, but not ArduPilot.
    """
    name = "" if autopilot is None else f" (MAV_AUTOPILOT {autopilot})"
    return VehicleNotFoundError(
        f"the autopilot of system {system} is neither ArduPilot nor PX4{name}: no other is supported for now",
        autopilot=autopilot,
    )
