"""The options of ``pbpp serve``, and its help."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

from mavlink_bridge.cli.options.shared import (
    AcceptLessOption,
    ClearanceOptions,
    ConnectOption,
    DescriptionOptions,
    HomeOption,
    MapOptions,
    VehicleLinkOptions,
    flag,
    option,
)
from mavlink_bridge.cli.values import autopilot_from, within

_SERVER, _SOURCE = "Server", "Source"


@dataclass(frozen=True, kw_only=True)
class ServerOptions:
    """Where the page is served, and to whom."""

    listen: Annotated[
        str,
        option(
            "Where to listen. For other devices (0.0.0.0:8080) the printed link holds a token. Default: a free port from 8080 on.",
            "HOST:PORT",
            panel=_SERVER,
        ),
    ] = "127.0.0.1"
    open_browser: Annotated[bool, option("Open the page in the browser.", None, "--open", panel=_SERVER)] = (
        False
    )
    map: Annotated[
        str | None,
        option(
            "Raster map as background: a PMTiles file, or the URL of one. Default: a grid in metres.",
            "FILE.pmtiles|URL",
            panel=_SERVER,
        ),
    ] = None
    tls: Annotated[
        str | None,
        option("Speak HTTPS with this certificate and key (PEM files).", "CERT,KEY", panel=_SERVER),
    ] = None


@dataclass(frozen=True, slots=True, kw_only=True)
class ServeOptions(ServerOptions, DescriptionOptions, MapOptions, ClearanceOptions, VehicleLinkOptions):
    """Serve the console: one page with fence, plan, rover and verdict, for a SOURCE: `--demo`, `--connect CONNECTION`, `--log FILE.tlog` or `--fence FILE`.

    Without `--upload` the page plans and checks, and writes nothing; without `--drive` it moves nothing; without `--arm` it arms nothing.

    For example:

    `pbpp serve --demo --open`

    `pbpp serve --connect udpin:0.0.0.0:14550 --upload --drive`
    """

    demo: Annotated[
        bool, flag("--demo", "A simulated rover in a maze; upload, drive and arm are allowed.", _SOURCE)
    ] = False
    speedup: Annotated[
        float,
        option(
            "With --demo: how many times faster than real time the rover runs, if the computer keeps up.",
            "X",
            panel=_SOURCE,
            parser=within(1.0, 20.0),
        ),
    ] = 1.0
    autopilot: Annotated[
        str | None,
        option(
            "With --demo: the autopilot to simulate, ardupilot (the default) or px4; --firmware sets its version.",
            "AUTOPILOT",
            panel=_SOURCE,
            parser=autopilot_from,
        ),
    ] = None
    connect: ConnectOption = None
    log: Annotated[Path | None, option("Replay this log, with a timeline.", "FILE.tlog", panel=_SOURCE)] = (
        None
    )
    fence: Annotated[
        Path | None, option("Plan around this fence, without a vehicle.", "FILE", panel=_SOURCE)
    ] = None
    start: Annotated[
        str | None, option("With --fence: where the vehicle starts. Default: home.", "LAT,LON")
    ] = None
    home: HomeOption = None
    clearance: Annotated[
        str | None, option("Clearance to keep while driving. Default: from FENCE_MARGIN.", "M|max")
    ] = None
    accept_less: AcceptLessOption = False
    upload: Annotated[bool, flag("--upload", "Let the page write missions and fences to the vehicle.")] = (
        False
    )
    drive: Annotated[
        bool, flag("--drive", "With --upload: let the page start drives and hold the vehicle.")
    ] = False
    arm: Annotated[bool, flag("--arm", "With --drive: let the page arm the vehicle to start a drive.")] = (
        False
    )
    escape: Annotated[
        bool,
        flag("--escape", "Let a vehicle that stands inside an exclusion or outside the fence drive out."),
    ] = False
    target_from: Annotated[
        list[str],
        option(
            "Where targets may come from, besides the page: reposition, position-target, guided-item, mission, rally, echo; repeatable.",
            "SOURCE",
        ),
    ] = field(default_factory=list)
    record: Annotated[
        Path | None,
        option("With --connect or --demo: record both directions, with a journal next to it.", "FILE.tlog"),
    ] = None
