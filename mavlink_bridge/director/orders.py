"""What the director may do and whom it looks for."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum
from typing import TYPE_CHECKING

from missions.request import Request, Tour

if TYPE_CHECKING:
    from collections.abc import Mapping

    from missions.geo import LatLon


class TargetSource(StrEnum):
    """Where targets may come from (``--target-from``)."""

    TYPED = "typed"
    REPOSITION = "reposition"
    POSITION_TARGET = "position-target"
    GUIDED_ITEM = "guided-item"
    MISSION = "mission"
    RALLY = "rally"
    ECHO = "echo"
    HOME = "home"  # called home by RTL, a failsafe or a breach; no choice of --target-from


class ObstacleSource(StrEnum):
    """Where obstacles may be reported from (``--obstacles-from``)."""

    OBSTACLE_DISTANCE = "OBSTACLE_DISTANCE"
    KEYBOARD = "keyboard"


OBSTACLE_GROWTH_MPS, OBSTACLE_KEEP_S = 1.0, 10.0
"""How fast an obstacle may move until it was watched, and how long it is kept after it was seen last; chosen: a slow walk, and twice the time that a rover takes to stop."""

DEFAULT_SOURCES = frozenset(
    {TargetSource.TYPED, TargetSource.REPOSITION, TargetSource.POSITION_TARGET, TargetSource.GUIDED_ITEM}
)

PATH_PLANNER_COMPONENT = 195
"""MAV_COMP_ID_PATHPLANNER, which the bridge speaks as, with the vehicle's own system id."""


@dataclass(frozen=True, slots=True)
class Homing:
    """What the director knows of ways home, and when it drives one.

    Parameters
    ----------
    is_kept : bool
        Keep the way home from where the vehicle is up to date, and tell it.
    places : mapping of str to LatLon
        Places to go home to, beside home and the rally points.
    by_route : bool
        Answer RTL with HOLD, a verified way home and AUTO; a vehicle that breaches its fence on a drive of ours is held.
    battery_percent, battery_volts : float, optional
        Answer a battery at or below this so too, and the autopilot's own text of a low battery.
    gcs_timeout_s : float, optional
        Answer the silence of all ground stations so too, once one was heard.
    """

    is_kept: bool = False
    places: Mapping[str, LatLon] = field(default_factory=dict)
    by_route: bool = False
    battery_percent: float | None = None
    battery_volts: float | None = None
    gcs_timeout_s: float | None = None


@dataclass(frozen=True, slots=True)
class Orders:
    """What the director may do and whom it looks for.

    Parameters
    ----------
    identity : tuple of int, optional
        Our system and component id. Default: the vehicle's system id and ``own_component``.
    own_component : int
        Our component id beside the vehicle's own system id.
    system : int, optional
        The vehicle's system id; needed where several vehicles are heard.
    any_vehicle : bool
        Take vehicles that are neither rover nor boat.
    request : Request
        What is asked of every plan; its targets are the first ones.
    upload : bool
        Write missions to the vehicle.
    drive : bool
        Switch modes: HOLD before a new route and after arrival, AUTO for a verified one.
    arm : bool
        Arm before AUTO.
    hold : bool
        Switch a vehicle that drives its mission to HOLD before another mission is written, also without ``drive``.
    confirm : bool
        Upload a plan only after `Director.confirm`.
    starts_on_word : bool
        Drive a verified mission only after `Director.start_drive`; a way home at once.
    once : bool
        End after one job: plan, upload, drive, as far as the orders go.
    announce : bool
        Tell decisions to the ground stations as STATUSTEXT.
    passive : bool
        Ask nobody anything: learn from what others transfer, as in a replay.
    target_sources : frozenset of TargetSource
        Where targets may come from.
    obstacle_sources : frozenset of ObstacleSource
        Where obstacles may be reported from.
    obstacle_growth_mps : float
        How fast a reported obstacle may move, until it was watched for long enough.
    obstacle_keep_s : float
        How long a reported obstacle is kept after it was seen last.
    patience_s : float
        How long a single job waits for the first heartbeat, and anybody for the position.
    homing : Homing
        What it knows of ways home, and when it drives one.
    """

    identity: tuple[int, int] | None = None
    own_component: int = PATH_PLANNER_COMPONENT
    system: int | None = None
    any_vehicle: bool = False
    request: Request = field(default_factory=Tour)
    upload: bool = False
    drive: bool = False
    arm: bool = False
    hold: bool = False
    confirm: bool = False
    starts_on_word: bool = False
    once: bool = False
    announce: bool = False
    passive: bool = False
    target_sources: frozenset[TargetSource] = DEFAULT_SOURCES
    obstacle_sources: frozenset[ObstacleSource] = frozenset()
    obstacle_growth_mps: float = OBSTACLE_GROWTH_MPS
    obstacle_keep_s: float = OBSTACLE_KEEP_S
    patience_s: float = 30.0
    homing: Homing = field(default_factory=Homing)

    @property
    def reads_rally(self) -> bool:
        """Whether the vehicle's rally points are read: they may be targets, or places to go home to."""
        return self.homing.is_kept or self.needs_rally

    @property
    def needs_rally(self) -> bool:
        """Whether nothing is done without them."""
        return TargetSource.RALLY in self.target_sources
