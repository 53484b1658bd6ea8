"""``pbpp plan``: plan a mission from a fence file, a log or a live vehicle; write it, draw it, upload it."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from mavlink_bridge.cli.common import is_same_file
from mavlink_bridge.cli.field_files import read_fence_file, with_mission_home
from mavlink_bridge.cli.mission_source import source_kind
from mavlink_bridge.cli.permissions import check_permissions
from mavlink_bridge.cli.pictures import check_plots
from mavlink_bridge.cli.plan_request import request_from_options, with_tour
from mavlink_bridge.cli.plan_results import Told, arrival_document, report_end
from mavlink_bridge.cli.planning_progress import planning_shown
from mavlink_bridge.cli.terminal import print_json
from mavlink_bridge.cli.timed_plan import timed_plan
from mavlink_bridge.cli.values import MOST_VEHICLE_M, checked_number, given_places
from mavlink_bridge.cli.vehicle_options import (
    described_vehicle,
    with_description,
    with_home_option,
    with_vehicle,
)
from mavlink_bridge.errors import UsageError
from missions.errors import InvalidPositionError, MissionFormatError
from missions.fence import Obstacle, Obstacles
from missions.formats import check_writable_format
from missions.geo import parse_lat_lon
from missions.request import RepairMission

if TYPE_CHECKING:
    from mavlink_bridge.cli.options.plan import PlanOptions
    from missions.request import Request
    from missions.situation import Situation

_OBSTACLE_ADVICE = "write latitude, longitude and a radius in metres, such as 40.0718,-105.2295,2.5"


def plan(options: PlanOptions) -> None:
    """Plan, and do with the plan what the options ask for."""
    check_permissions(upload=options.upload, drive=options.drive, hold=options.hold)
    request = _request(options)
    _check_options(options)
    told = Told(
        options.output,
        options.plot,
        given_places(options.place) if options.json_output or options.plot or options.place else None,
        asked=(request, source_kind(options)),
        blocks=options.blocks,
        is_silent=options.is_silent,
        drives=options.drive,
    )
    verified, arrival, backup = False, None, None
    if options.connect is not None:
        from mavlink_bridge.cli.plan_on_link import plan_on_link  # noqa: PLC0415 - pymavlink only with a link

        result = plan_on_link(options, request, told)
        situation, verified, arrival = result.situation, result.verified, result.arrival
        backup = result.backup
    else:
        situation, taken = _offline_situation(options, request)
        with planning_shown(request, quiet=options.is_silent) as should_stop:
            made = timed_plan(situation, request, should_stop=should_stop)
        told.tell(*made, situation, taken)
    document = {
        **told.document(),
        "source": options.connect or Path(str(options.fence or options.log)).name,
        "system": situation.system,
        "uploaded": verified,
        "verified": verified,
        "backup": str(backup) if backup else None,
        **arrival_document(arrival),
    }
    if options.json_output:
        print_json(document)
    elif not options.quiet:
        report_end(arrival, backup, verified=verified)


def _request(options: PlanOptions) -> Request:
    request = request_from_options(
        options.start,
        options.target,
        options.clearance,
        options.corner_allowance,
        options.snap,
        options.method,
    )
    request = replace(
        with_vehicle(request, options),
        speed_mps=options.speed,
        escape=options.escape,
        trusts_model=options.trust_model,
        accepts_less=options.accept_less,
    )
    return with_tour(request, options)


def _check_options(options: PlanOptions) -> None:
    """Find what cannot work before any work is done."""
    fence, outputs, plots = options.fence, options.output, options.plot
    if [fence, options.log, options.connect].count(None) != 2:
        raise UsageError("give one SOURCE: --fence FILE, --log FILE.tlog or --connect CONNECTION")
    if options.upload and options.connect is None:
        raise UsageError("--upload needs a live link: --connect CONNECTION")
    for path in outputs:
        check_writable_format(path)
        if path.suffix.lower() != ".plan" and fence is not None and is_same_file(path, fence):
            raise UsageError(f"-o {path} would overwrite the fence with a mission")
    for path in (*outputs, *plots):
        if not path.parent.is_dir():
            raise MissionFormatError(
                f"{path} cannot be written: there is no folder {path.parent}",
                advice=f"create {path.parent} first, or choose another folder",
            )
    if options.obstacle and options.connect is not None:
        raise UsageError(
            "--obstacle goes with --fence and --log: on a link pbpp bridge --obstacles-from plans round obstacles"
        )
    if options.home is not None and options.connect is not None:
        raise UsageError("--home goes with --fence and --log: a live vehicle reports its own home")
    check_plots(plots, json_output=options.json_output)


def _offline_situation(options: PlanOptions, request: Request) -> tuple[Situation, list[str]]:
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
