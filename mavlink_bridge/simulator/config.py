"""What a simulated rover starts with."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from mavlink_bridge.mavlink.messages import Autopilot
from missions.geo import LatLon

if TYPE_CHECKING:
    from collections.abc import Mapping

    from missions.firmware import Firmware
    from missions.items import MissionItem


DEFAULT_HOME = LatLon(40.071374, -105.229930)
"""Where the rover stands by default: the home of the recorded logs."""


@dataclass(frozen=True, slots=True)
class MovingDisc:
    """Something round in the field, for the rover's distance sensor; the rover drives through it.

    Parameters
    ----------
    centre : LatLon
        Where its middle is at first.
    radius_m : float
    speed_mps : float
    heading_deg : float
        Where it moves, clockwise from north.
    from_s : float
        When it appears and begins to move.
    """

    centre: LatLon
    radius_m: float
    speed_mps: float = 0.0
    heading_deg: float = 0.0
    from_s: float = 0.0


@dataclass(frozen=True, slots=True)
class Battery:
    """What the battery's monitor tells: percent left (-1: it does not know), volts, and of how many cells each (0 to 14; 0: of the whole)."""

    percent: int = 100
    volts: float = 12.6
    cells: int = 0


@dataclass(frozen=True, slots=True)
class Receiver:
    """What the GPS receiver tells: GPS_FIX_TYPE and its own figure for its error, None without one."""

    fix_type: int = 6
    error_m: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class SimulatorConfig:
    """What a simulated rover starts with.

    Parameters
    ----------
    system, component : int
        Its MAVLink identity.
    home : LatLon
        Where it stands at first.
    heading_deg : float
        Where it looks at first, clockwise from north.
    mission, fence, rally : tuple of MissionItem
        What is stored in it; the mission without the home item.
    parameters : mapping of str to float
        Parameters that differ from ArduRover's defaults.
    ready_after_s : float
        When after boot it can be armed (35 s on the measured autopilot).
    streams : bool
        Whether telemetry flows unasked; without it only HEARTBEAT does.
    list_ids : bool
        Whether MISSION_CURRENT carries ids of the lists, as PX4's does and ArduPilot's does not.
    autopilot : Autopilot
        Whose rover it is: ArduPilot's, or PX4's.
    firmware : Firmware or None
        The version it says that it is, and drives like; None: 4.7.0-dev of October 2025, the best measured; of PX4 the line of 1.18.
    discs : tuple of MovingDisc
        What is in the field beside fences.
    sensor_m : float
        How far a distance sensor sees all around (OBSTACLE_DISTANCE and ATTITUDE ten times a second); 0: it has none.
    uid : bytes
        The board's own id in AUTOPILOT_VERSION, at most 18 bytes; empty: none.
    battery : Battery or None
        What its battery's monitor tells at first; None: it has no monitor.
    """

    system: int = 1
    component: int = 1
    home: LatLon = DEFAULT_HOME
    heading_deg: float = 0.0
    mission: tuple[MissionItem, ...] = ()
    fence: tuple[MissionItem, ...] = ()
    rally: tuple[MissionItem, ...] = ()
    parameters: Mapping[str, float] = field(default_factory=dict)
    ready_after_s: float = 0.0
    streams: bool = True
    list_ids: bool = False
    autopilot: Autopilot = Autopilot.ARDUPILOTMEGA
    firmware: Firmware | None = None
    discs: tuple[MovingDisc, ...] = ()
    sensor_m: float = 0.0
    uid: bytes = b""
    battery: Battery | None = None
