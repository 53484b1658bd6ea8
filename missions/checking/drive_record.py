"""What has to be kept of a plan so that another process can watch its drive: what was planned for, and what was found.

The predicted corridor is not kept: it is predicted again, from the same items, fence, parameters and heading, by the check that judges any mission.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from missions.checking.check import check_mission, plan_of
from missions.errors import SituationError
from missions.ground.seams import with_seams
from missions.planned import Clearances, Plan
from missions.request import GoTo
from missions.situation import Known, Mission, Pose, Situation

if TYPE_CHECKING:
    from collections.abc import Mapping

    from missions.fence import Fence
    from missions.firmware import Firmware
    from missions.geo import LatLon
    from missions.items import MissionItem
    from missions.situation import Calibration

_SOURCE = "the note of the drive"


@dataclass(frozen=True, slots=True, kw_only=True)
class DriveRecord:
    """What is kept of a plan and of what it was made for; the fields are those of `Plan` and `Situation`.

    Parameters
    ----------
    heading_deg : float or None
        Where the vehicle faced at the start, clockwise from north.
    ardupilot : bool
        Whether its autopilot is ArduPilot.
    """

    items: tuple[MissionItem, ...]
    path: tuple[LatLon, ...]
    targets: tuple[LatLon, ...]
    asked_targets: tuple[LatLon, ...]
    method: str
    clearance_m: float | None
    asked_m: float
    drawn_clearance_m: float
    driven_clearance_m: float
    home: LatLon | None
    fence: Fence
    heading_deg: float | None
    parameters: Mapping[str, float]
    vehicle_type: int | None
    firmware: Firmware | None
    ardupilot: bool = True
    calibration: Calibration | None = None


def record_of(plan: Plan, situation: Situation) -> DriveRecord:
    """Return what is kept of a plan that begins where the vehicle stands.

    Parameters
    ----------
    plan : Plan
        The plan.
    situation : Situation
        What is known just before it is driven.
    """
    return DriveRecord(
        items=plan.items,
        path=plan.path,
        targets=plan.targets,
        asked_targets=plan.asked_targets or plan.targets,
        method=str(plan.method),
        clearance_m=plan.clearance_m,
        asked_m=plan.asked_m,
        drawn_clearance_m=plan.drawn_clearance_m,
        driven_clearance_m=plan.driven_clearance_m,
        home=plan.home,
        fence=plan.fence,
        heading_deg=situation.pose.value.heading_deg if situation.pose is not None else None,
        parameters=dict(situation.parameters),
        vehicle_type=situation.vehicle_type,
        firmware=situation.firmware,
        ardupilot=situation.ardupilot is not False,
        calibration=situation.calibration,
    )


def situation_of(record: DriveRecord) -> Situation:
    """Return the situation that a record's plan was made in, as far as its drive depends on it."""
    return Situation(
        ardupilot=record.ardupilot,
        firmware=record.firmware,
        vehicle_type=record.vehicle_type,
        fence=Known(record.fence, None, _SOURCE),
        home=Known(record.home, None, _SOURCE) if record.home is not None else None,
        pose=Known(Pose(record.path[0], record.heading_deg), None, _SOURCE),
        parameters=record.parameters,
        calibration=record.calibration,
    )


def plan_again(record: DriveRecord) -> Plan:
    """Return the plan of a record, its drive predicted again.

    Raises
    ------
    MissionError
        It cannot be followed any more: this version of pbpp reads something in it another way.
    """
    situation = situation_of(record)
    request = GoTo(start=record.path[0], clearance_m=record.clearance_m, position_error_m=0.0)
    plan = plan_of(
        check_mission(Mission(record.items, record.home), situation, request), situation, method=record.method
    )
    if plan.path != record.path:
        raise SituationError("its items lead another way than was planned")
    return replace(
        plan,
        targets=record.targets,
        asked_targets=record.asked_targets,
        ground=with_seams(plan.ground, plan.vehicle),
        keeps=Clearances(
            record.clearance_m, record.asked_m, record.drawn_clearance_m, record.driven_clearance_m
        ),
    )
