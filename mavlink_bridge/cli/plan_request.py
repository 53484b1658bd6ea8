"""What is asked of a plan, read from a command's options."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from mavlink_bridge.cli.field_files import read_mission_file
from mavlink_bridge.cli.options.plan import ENDS, METHODS, ORDERS
from mavlink_bridge.cli.values import given_places, metres_or, position_from
from mavlink_bridge.cli.vehicle_options import with_vehicle
from mavlink_bridge.errors import UsageError
from missions.request import RepairMission, Request, conditions, request_of

if TYPE_CHECKING:
    from mavlink_bridge.cli.options.plan import PlanOptions

_OWN = "own"


def request_from_options(
    start: str | None, targets: list[str], clearance: str | None, allowance: str, snap: float, method: str
) -> Request:
    """Read what is asked of plans from a command's options.

    Raises
    ------
    UsageError
        An option is not what it has to be.
    """
    if method not in METHODS:
        raise UsageError(f"--method {method!r}: expected one of {', '.join(METHODS)}")
    return request_of(
        start=position_from("--start", start) if start is not None else None,
        targets=tuple(position_from("--target", target) for target in targets),
        clearance_m=metres_or("--clearance", clearance, "max"),
        widest=clearance == "max",
        corner_allowance_m=metres_or("--corner-allowance", allowance, "auto"),
        snap_m=snap,
        method=method,
    )


def plan_request(options: PlanOptions) -> Request:
    """Read from the options of ``pbpp plan`` what is asked.

    Raises
    ------
    UsageError
        An option is not what it has to be, or does not go with another.
    """
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


def with_tour(request: Request, options: PlanOptions) -> Request:
    """Add order, way home, end or a mission to repair.

    Raises
    ------
    UsageError
        An option is not what it has to be, or does not go with another.
    """
    order, end, via, comes_back = options.order, options.end, options.via_mission, options.come_back
    for option, value, known in (("--order", order, ORDERS), ("--end", end, ENDS)):
        if value not in known:
            raise UsageError(f"{option} {value!r}: expected one of {', '.join(known)}")
    if via is None:
        if options.way_home_inside and end != "hold":
            raise UsageError(
                f"--way-home-inside ends the mission in hold; it cannot be combined with --end {end}"
            )
        words: dict[str, object] = {"order": order, "comes_back": comes_back, "end": end}
        if options.way_home_inside:
            words |= {"way_home_inside": True, "places": tuple(given_places(options.place).items())}
        return request_of(**{**request.words(), **words})
    if request.targets or comes_back or options.way_home_inside or (order, end) != ("given", "hold"):
        raise UsageError(
            "--via-mission keeps the mission's own places, order and end; it cannot be combined with --target, --order, --return, --end, "
            "--way-home-inside"
        )
    if request.widest:
        raise UsageError("--via-mission needs a clearance in metres, not max")
    if request.accepts_less:
        raise UsageError(
            "--via-mission repairs a mission to the clearance asked for; it does not go with --accept-less"
        )
    if request.speed_mps is not None or request.corner_allowance_m is not None or request.escape:
        raise UsageError(
            "--via-mission keeps the mission's own speeds and relies on the drive model; it cannot be combined with --speed, "
            "--corner-allowance, --escape"
        )
    mission = None if via == _OWN else read_mission_file(Path(via), options)
    return RepairMission(**conditions(request), mission=mission)
