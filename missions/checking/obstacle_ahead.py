"""A reported obstacle across what is left of a route: when a driving vehicle has to be held."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import shapely

from missions.checking.holding import TAKES_S
from missions.checking.recheck import Recheck
from missions.drive_model.hold_loop import ending_of
from missions.errors import MissionError
from missions.promise import known_vehicle

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from missions.fence import Obstacle, Obstacles
    from missions.planned import Plan
    from missions.request import Request
    from missions.situation import Situation

_TOLERANCE_M = 0.02  # as a recheck's: more than rounding to degE7 moves a line
_NEAREST_M = 0.1  # nearer than this to an obstacle's circle nothing leads away from it; chosen
_STANDS_S = 5.0  # of a vehicle that is not known: more than the 4.6 s that the measured stops of steered rovers come to at 2 m/s


def stands_after_s(situation: Situation, request: Request) -> float:
    """Return how long after a HOLD that is sent now the vehicle stands, from its usual speed.

    Parameters
    ----------
    situation : Situation
        What is known of it.
    request : Request
        What is asked of routes.
    """
    try:
        vehicle = known_vehicle(situation, request)
    except MissionError:
        return _STANDS_S
    return TAKES_S + ending_of(vehicle, situation.stops).rest_s(vehicle.speed_mps)


class Across(NamedTuple):
    """An obstacle that is too near to a route, and what the route still keeps."""

    obstacle: Obstacle
    kept: Recheck


def obstacle_across(plan: Plan, situation: Situation, item: int) -> Across | None:
    """Return the obstacle that comes nearest to what is left of a route, where one comes too near; else None.

    One that is still within the circle that the route was planned around is none. Where the vehicle is nearer than the route has to keep, the line that it
    is on has to come no nearer.

    Parameters
    ----------
    plan : Plan
        What is driven.
    situation : Situation
        The obstacles, and where the vehicle is.
    item : int
        The mission item that it is on its way to.
    """
    obstacles = situation.obstacles
    new = [number for number, _ in enumerate(obstacles.known)]
    if not new:
        return None
    pose = situation.pose
    here = pose.value.position if pose is not None else plan.start
    centres, radii_m = _circles(plan, obstacles)
    known, known_m = _circles(plan, plan.ground.obstacles)
    if len(known):
        apart_m = np.hypot(*(centres[:, None] - known[None]).transpose(2, 0, 1))
        new = list(np.flatnonzero((apart_m + radii_m[:, None] > known_m[None]).all(axis=1)))
        if not new:
            return None
    rest = np.vstack((plan.ground.frame.to_local(here), plan.points[plan.path_index(item) :]))
    legs = np.asarray(shapely.linestrings(np.stack((rest[:-1], rest[1:]), axis=1)))
    kept_m = (
        shapely.distance(np.asarray(shapely.points(centres[new]))[:, None], legs[None]) - radii_m[new, None]
    )
    here_m = np.hypot(*(centres[new] - rest[0]).T) - radii_m[new]
    asked_m = np.full(kept_m.shape, plan.asked_m)
    asked_m[:, 0] = np.where(here_m > 0, np.clip(here_m, _NEAREST_M, plan.asked_m), plan.asked_m)
    worst, leg = np.unravel_index(int((kept_m - asked_m).argmin()), kept_m.shape)
    if kept_m[worst, leg] >= asked_m[worst, leg] - _TOLERANCE_M:
        return None
    obstacle = obstacles.known[new[worst]]
    kept = Recheck(max(0.0, float(kept_m[worst, leg])), float(asked_m[worst, leg]), obstacle.name)
    return Across(obstacle, kept)


def _circles(plan: Plan, obstacles: Obstacles) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    centres = plan.ground.frame.to_local_array([one.position for one in obstacles.known])
    return centres, np.array([obstacles.radius_m(one) for one in obstacles.known])
