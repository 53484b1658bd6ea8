"""What a plan is made from without a link: a fence file or a log, and what other options add."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

from mavlink_bridge.cli.field_files import read_fence_file, with_mission_home
from mavlink_bridge.cli.values import MOST_VEHICLE_M, checked_number
from mavlink_bridge.cli.vehicle_options import described_vehicle, with_description, with_home_option
from mavlink_bridge.errors import UsageError
from missions.errors import InvalidPositionError
from missions.fence import Obstacle, Obstacles
from missions.geo import parse_lat_lon
from missions.request import RepairMission

if TYPE_CHECKING:
    from mavlink_bridge.cli.options.plan import PlanOptions
    from missions.request import Request
    from missions.situation import Situation

_OBSTACLE_ADVICE = "write latitude, longitude and a radius in metres, such as 40.0718,-105.2295,2.5"


def offline_situation(options: PlanOptions, request: Request) -> tuple[Situation, list[str]]:
    """Return what the file or the log holds, with what other options add; and what a log gave to the plan."""
    taken = []
    if options.log is not None:
        from mavlink_bridge.cli import log_source  # noqa: PLC0415 - pymavlink only for logs

        situation = log_source.situation_of(options.log, options, drives_its_items=request.repairs)
        taken = log_source.taken_info(options.log, situation, request)
    else:
        assert options.fence is not None
        situation = read_fence_file(options.fence, options)
        if isinstance(request, RepairMission) and request.mission is not None:
            situation = with_mission_home(situation, request.mission, str(options.via_mission))
    situation = replace(situation, obstacles=Obstacles(tuple(map(_obstacle, options.obstacle))))
    described = with_home_option(
        with_description(situation, described_vehicle(options)),
        options.home,
    )
    return described, taken


def _obstacle(text: str) -> Obstacle:
    """Return the obstacle that ``--obstacle`` is.

    Raises
    ------
    UsageError
        It is not LAT,LON,RADIUS.
    """
    place, comma, radius = text.rpartition(",")
    if not comma:
        raise UsageError(f"--obstacle {text!r}: expected LAT,LON,RADIUS", advice=_OBSTACLE_ADVICE)
    try:
        position = parse_lat_lon(place)
        radius_m = checked_number(radius, 0.0, MOST_VEHICLE_M, "metres", above=True)
    except (UsageError, InvalidPositionError) as error:
        raise UsageError(f"--obstacle {text!r}: {error}", advice=_OBSTACLE_ADVICE) from None
    return Obstacle(position, radius_m, 0.0, 0.0, math.inf, "--obstacle", None)
