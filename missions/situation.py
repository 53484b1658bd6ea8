"""What is known of a vehicle and its field: the one type that streams, logs and files are folded into."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from enum import StrEnum
from types import MappingProxyType
from typing import TYPE_CHECKING, Generic, TypeVar

from missions.fence import Obstacles
from missions.stops import Stops

if TYPE_CHECKING:
    from collections.abc import Mapping

    from missions.fence import Fence
    from missions.firmware import Firmware
    from missions.geo import LatLon, Vector
    from missions.items import MissionItem
    from missions.rally import RallyPoint

T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class Known(Generic[T]):
    """A fact, when it was learnt (None where there is no clock, as in a file) and from what."""

    value: T
    time_s: float | None
    source: str


@dataclass(frozen=True, slots=True)
class Mission:
    """A mission's items without the home item that ArduPilot keeps at seq 0, and that home where it is known."""

    items: tuple[MissionItem, ...]
    home: LatLon | None = None

    def item_count(self, *, has_home: bool = True) -> int:
        """Return how many items the list on a vehicle has: ArduPilot's begins with home, PX4's does not."""
        return len(self.items) + int(has_home and bool(self.items))


@dataclass(frozen=True, slots=True)
class Pose:
    """Where the vehicle is, where it heads (degrees clockwise from north) and how it moves (east and north, m/s); None where unknown."""

    position: LatLon
    heading_deg: float | None = None
    velocity_mps: Vector | None = None

    @property
    def speed_mps(self) -> float:
        """How fast it moves; 0 where that is not known."""
        return math.hypot(*self.velocity_mps) if self.velocity_mps is not None else 0.0


@dataclass(frozen=True, slots=True)
class Fix:
    """How well the vehicle knows its position.

    Parameters
    ----------
    kind : int
        GPS_FIX_TYPE: 3 is 3D, 4 DGPS, 5 RTK float, 6 RTK fixed.
    error_m : float or None
        The receiver's own figure for its horizontal error (GPS_RAW_INT.h_acc), None without one.
    """

    kind: int
    error_m: float | None = None


class ListKind(StrEnum):
    """The lists a vehicle holds."""

    MISSION = "mission"
    FENCE = "fence"
    RALLY = "rally"


@dataclass(frozen=True, slots=True)
class ListTransfer:
    """A list on its way from or to the vehicle, as far as it was seen.

    Parameters
    ----------
    to_vehicle : bool
        True for an upload, False for a read-back.
    count : int or None
        How many items were announced; None where the start was not seen.
    items : mapping of int to MissionItem
        The items seen, by seq.
    """

    to_vehicle: bool
    count: int | None
    items: Mapping[int, MissionItem]

    @property
    def is_complete(self) -> bool:
        """Whether every announced item was seen."""
        return self.count is not None and all(seq in self.items for seq in range(self.count))

    def in_order(self) -> tuple[MissionItem, ...]:
        """Return the items of a complete list in order."""
        return tuple(self.items[seq] for seq in range(self.count or 0))


@dataclass(frozen=True, slots=True)
class MadeFor:
    """Which vehicle a file says that it is made for (QGroundControl's .plan): that counts only where nothing is known of the vehicle itself.

    Parameters
    ----------
    source : str
        The file.
    ardupilot : bool or None
        Whether for ArduPilot; False is PX4, None is not said.
    vehicle_type : int or None
        MAV_TYPE.
    """

    source: str
    ardupilot: bool | None = None
    vehicle_type: int | None = None


@dataclass(frozen=True, slots=True)
class Reading:
    """How a situation's facts were read, and what was read that is no fact (yet).

    Parameters
    ----------
    bytewise : bool or None
        Whether the autopilot reports whole-number parameters as the bits of a float (PX4), not as its value.
    no_numbers : mapping of str to str
        Parameters that last came as no number (``nan``, ``inf``), and what came; what was known of them before still stands.
    transfers : mapping
        Lists on their way, by kind and direction (True: to the vehicle).
    fence_trouble : str or None
        Why the newest fence that was seen could not be used.
    remarks : tuple of str
        Warnings from reading a file: what was skipped, and what was assumed.
    made_for : MadeFor, optional
        Which vehicle the file says that it is made for.
    """

    bytewise: bool | None = None
    no_numbers: Mapping[str, str] = field(default_factory=lambda: MappingProxyType({}))
    transfers: Mapping[tuple[ListKind, bool], ListTransfer] = field(
        default_factory=lambda: MappingProxyType({})
    )
    fence_trouble: str | None = None
    remarks: tuple[str, ...] = ()
    made_for: MadeFor | None = None


@dataclass(frozen=True, slots=True)
class CornerClass:
    """How one rover's corners of like angle and speed compare with the drive model's bounds.

    Parameters
    ----------
    turn_from_deg, turn_to_deg : float
        The angle, to either side; the second is outside.
    speed_from_mps, speed_to_mps : float
        The faster of the speeds asked for before and after it; the second is outside.
    stands : bool
        Corners that the rover stops or turns on the spot at, or those that it drives through.
    corners : int
        How many were driven.
    inside_more_m, outside_more_m : float
        What is added to the bound of the cut, and of the overshoot; negative where this rover needs less.
    beyond_m : float
        How far the corridor grows there: the farthest outside it that the rover was seen, from the middle of one leg to the middle of the next.
    """

    turn_from_deg: float
    turn_to_deg: float
    speed_from_mps: float
    speed_to_mps: float
    stands: bool
    corners: int
    inside_more_m: float
    outside_more_m: float
    beyond_m: float


@dataclass(frozen=True, slots=True)
class LegClass:
    """How one rover's straight legs of like speed compare with the drive model's band: what is added to it, never less than nothing."""

    speed_from_mps: float
    speed_to_mps: float
    legs: int
    more_m: float


@dataclass(frozen=True, slots=True)
class Calibration:
    """What one rover's recorded drives show beside the drive model.

    Parameters
    ----------
    system : int
        The vehicle's MAVLink system id.
    drives : int
        How many drives it rests on.
    steering : str
        `missions.vehicle.Steering` of the rover.
    corners : tuple of CornerClass
    legs : tuple of LegClass
    parameters : mapping of str to float
        Those that it drove with, by name.
    firmware : str or None
        The autopilot's version then.
    """

    system: int
    drives: int
    steering: str
    corners: tuple[CornerClass, ...]
    legs: tuple[LegClass, ...]
    parameters: Mapping[str, float] = field(hash=False)
    firmware: str | None = None


@dataclass(frozen=True, slots=True)
class Situation:
    """What is known, each fact with its time and source; None is not known.

    A link, a log and the simulator fill it message by message, a file at once.

    Parameters
    ----------
    system, component : int or None
        The vehicle's MAVLink ids.
    ardupilot : bool or None
        Whether the autopilot is ArduPilot.
    mode : int or None
        The autopilot's own mode number (HEARTBEAT.custom_mode).
    target : Known of LatLon
        The newest place somebody asked the vehicle to drive to.
    firmware : Firmware or None
        The autopilot's version.
    parameters : mapping of str to float
        The autopilot's parameters, as far as they are known; each a number.
    stops : Stops
        How far it rolls on after HOLD or disarming, as far as that was said or seen.
    obstacles : Obstacles
        What was reported to stand or move in the field, as it may be when a vehicle that is told to stop now stands.
    reading : Reading
        How all that was read.
    calibration : Calibration, optional
        What this rover's own drives show of its corners and legs.
    """

    system: int | None = None
    component: int | None = None
    ardupilot: bool | None = None
    firmware: Firmware | None = None
    vehicle_type: int | None = None
    mode: int | None = None
    armed: bool | None = None
    fence: Known[Fence] | None = None
    mission: Known[Mission] | None = None
    rally: Known[tuple[RallyPoint, ...]] | None = None
    home: Known[LatLon] | None = None
    pose: Known[Pose] | None = None
    fix: Known[Fix] | None = None
    target: Known[LatLon] | None = None
    parameters: Mapping[str, float] = field(default_factory=lambda: MappingProxyType({}))
    stops: Stops = field(default_factory=Stops)
    obstacles: Obstacles = field(default_factory=Obstacles)
    reading: Reading = field(default_factory=Reading)
    calibration: Calibration | None = None

    @property
    def bytewise(self) -> bool | None:
        """`Reading.bytewise`."""
        return self.reading.bytewise

    @property
    def no_numbers(self) -> Mapping[str, str]:
        """`Reading.no_numbers`."""
        return self.reading.no_numbers

    @property
    def transfers(self) -> Mapping[tuple[ListKind, bool], ListTransfer]:
        """`Reading.transfers`."""
        return self.reading.transfers

    @property
    def fence_trouble(self) -> str | None:
        """`Reading.fence_trouble`."""
        return self.reading.fence_trouble

    @property
    def remarks(self) -> tuple[str, ...]:
        """`Reading.remarks`."""
        return self.reading.remarks
