"""What the director may do and whom it looks for."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum

from missions.request import Request, Tour


class TargetSource(StrEnum):
    """Where targets may come from (``--target-from``)."""

    TYPED = "typed"
    REPOSITION = "reposition"
    POSITION_TARGET = "position-target"
    GUIDED_ITEM = "guided-item"
    MISSION = "mission"
    RALLY = "rally"
    ECHO = "echo"


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
    once: bool = False
    announce: bool = False
    passive: bool = False
    target_sources: frozenset[TargetSource] = DEFAULT_SOURCES
    obstacle_sources: frozenset[ObstacleSource] = frozenset()
    obstacle_growth_mps: float = OBSTACLE_GROWTH_MPS
    obstacle_keep_s: float = OBSTACLE_KEEP_S
    patience_s: float = 30.0
