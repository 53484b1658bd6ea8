"""The options of ``pbpp plan``, and its help."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

from mavlink_bridge.cli.options.shared import (
    MANY_PANEL,
    OUTPUT_PANEL,
    VEHICLE_PANEL,
    AcceptLessOption,
    ClearanceOptions,
    ConnectOption,
    DescriptionOptions,
    HomeOption,
    LinkOptions,
    ManyOptions,
    MapOptions,
    PlaceOption,
    flag,
    metres,
    option,
)
from mavlink_bridge.cli.values import LEAST_MPS, MOST_MPS, within
from missions.request import End, Method, Order

METHODS, ORDERS, ENDS = tuple(Method), tuple(Order), tuple(End)
_DRIVE, _ROUTE = "Upload and drive", "Route"
_TOURS = "Several targets, and missions to repair"


@dataclass(frozen=True, kw_only=True)
class TourOptions:
    """How several targets are visited, or which mission is repaired."""

    order: Annotated[
        str, option("given: as listed; best: in the shortest order.", "|".join(ORDERS), panel=_TOURS)
    ] = "given"
    come_back: Annotated[
        bool, flag("--return", "Return home after the last target (to the start if home is unknown).", _TOURS)
    ] = False
    end: Annotated[
        str,
        option(
            "What to do at the end; rtl only if the straight line home is free.", "|".join(ENDS), panel=_TOURS
        ),
    ] = "hold"
    way_home_inside: Annotated[
        bool,
        flag(
            "--way-home-inside",
            "After the mission's end, add a way home for each leg; choose its item while the vehicle drives that leg.",
            _TOURS,
        ),
    ] = False
    via_mission: Annotated[
        str | None,
        option(
            "Repair this mission: replace the legs that do not keep the clearance; own: the mission in the SOURCE.",
            "FILE|own",
            panel=_TOURS,
        ),
    ] = None


@dataclass(frozen=True, kw_only=True)
class BesideFenceOptions:
    """What counts beside the fence: home, places to go home to, obstacles."""

    home: HomeOption = None
    place: PlaceOption = field(default_factory=list)
    obstacle: Annotated[
        list[str],
        option(
            "With --fence or --log: also plan around this circle, as the bridge does around reported obstacles; it is not written to a file or vehicle. Repeatable.",
            "LAT,LON,RADIUS",
        ),
    ] = field(default_factory=list)


@dataclass(frozen=True, slots=True, kw_only=True)
class PlanOptions(
    BesideFenceOptions,
    TourOptions,
    DescriptionOptions,
    MapOptions,
    ClearanceOptions,
    ManyOptions,
    LinkOptions,
):
    """Plan a mission around the fences of a SOURCE: `--fence FILE`, `--log FILE.tlog` or `--connect CONNECTION`.

    For example:

    `pbpp plan --log field.tlog -o mission.waypoints --plot mission.png`

    `pbpp plan --fence field.plan --start 40.0713,-105.2299 --target 40.0726,-105.2290 -o mission.plan`

    `pbpp plan --connect udpin:0.0.0.0:14550 --target 40.0726,-105.2290 --upload`

    `pbpp plan --batch plans.csv -o results.jsonl --jobs 4`
    """

    batch: Annotated[
        Path | None,
        option(
            "Make a plan for each row of a table (.csv, .jsonl, .parquet) with columns fence, start, target, vehicle, clearance, …; writes JSON lines, or -o FILE.jsonl, FILE.parquet.",
            "TABLE",
            panel=MANY_PANEL,
        ),
    ] = None
    fence: Annotated[Path | None, option("Fence file: .waypoints, .plan, .kml, …", "FILE")] = None
    log: Annotated[Path | None, option("Recorded telemetry log.", "FILE.tlog")] = None
    connect: ConnectOption = None
    start: Annotated[
        str | None,
        option("Start position. Default: the vehicle's position; for a file, its home.", "LAT,LON"),
    ] = None
    target: Annotated[
        list[str],
        option(
            "Target position; several are visited in order. Default: the newest target in the log or on the link.",
            "LAT,LON",
        ),
    ] = field(default_factory=list)
    clearance: Annotated[
        str | None,
        option(
            "Fence clearance to keep while driving; max: the widest route. Default: from FENCE_MARGIN.",
            "M|max",
        ),
    ] = None
    accept_less: AcceptLessOption = False
    output: Annotated[
        list[Path],
        option("Write the mission: .waypoints, .plan, .geojson, .kml, .gpx.", "FILE", "-o", "--output"),
    ] = field(default_factory=list)
    plot: Annotated[
        list[Path], option("Draw the plan: .png, .svg, .pdf, .html; - in the terminal.", "FILE")
    ] = field(default_factory=list)
    upload: Annotated[bool, flag("--upload", "Upload to the vehicle and verify.")] = False
    hold: Annotated[
        bool, flag("--hold", "With --upload: switch a vehicle that drives in AUTO to HOLD first.", _DRIVE)
    ] = False
    drive: Annotated[
        bool,
        flag(
            "--drive", "With --upload: then switch to AUTO, and to HOLD after arrival; does not arm.", _DRIVE
        ),
    ] = False
    snap: Annotated[
        float, metres("Move a blocked target to the nearest free place within M metres.", _ROUTE)
    ] = 0.0
    corner_allowance: Annotated[
        str,
        option(
            "Extra room for cut corners; 0 plans straight legs only, without a promise for the driven track.",
            "M|auto",
            panel=_ROUTE,
        ),
    ] = "auto"
    method: Annotated[
        str, option("Path search: optimal is the shortest.", "|".join(METHODS), panel=_ROUTE)
    ] = "optimal"
    escape: Annotated[
        bool,
        flag(
            "--escape",
            "Let a vehicle that stands inside an exclusion or outside the fence drive out.",
            _ROUTE,
        ),
    ] = False
    speed: Annotated[
        float | None,
        option(
            "Drive at this speed. Default: the vehicle's own.",
            "M/S",
            panel=VEHICLE_PANEL,
            parser=within(LEAST_MPS, MOST_MPS, "metres a second"),
        ),
    ] = None
    blocks: Annotated[bool, flag("--blocks", "Also draw the blocks of the free space.", OUTPUT_PANEL)] = False
