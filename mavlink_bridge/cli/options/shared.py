"""Options that several commands have, each written once."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any

import typer

from mavlink_bridge.cli.options_file import take_options
from mavlink_bridge.cli.values import MOST_M, MOST_S, MOST_VEHICLE_M, autopilot_from, stop_from, within
from missions.errors import VehicleError
from missions.firmware import Firmware, read_firmware
from missions.stops import Stop

LINK_PANEL, OUTPUT_PANEL, VEHICLE_PANEL = "Link", "Output", "Vehicle"
_MAP_PANEL = "Map files: what each zone is"
"""How help groups what many commands have."""


def option(text: str, metavar: str | None = None, *names: str, panel: str | None = None, **more: Any) -> Any:  # noqa: ANN401 - typer's own
    """Return an option: its help, what help shows for its value, and its names if they are not the field's."""
    return typer.Option(*names, metavar=metavar, help=text, rich_help_panel=panel, **more)


def flag(name: str, text: str, panel: str | None = None) -> Any:  # noqa: ANN401 - as above
    """Return an option that takes no value, and has no opposite."""
    return option(text, None, name, panel=panel)


def metres(text: str, panel: str | None = None, most_m: float = MOST_M) -> Any:  # noqa: ANN401 - as above
    """Return an option that takes metres, none of them negative."""
    return option(text, "M", panel=panel, parser=within(0.0, most_m, "metres"))


ConnectOption = Annotated[
    str | None,
    option(
        "A live link: udpin:0.0.0.0:14550, udpout:HOST:PORT, tcp:HOST:PORT, tcpin:…, /dev/ttyACM0[,BAUD], COM7[,BAUD].",
        "CONNECTION",
        "--connect",
    ),
]
SystemOption = Annotated[
    int | None,
    option("Which vehicle, when several are heard.", "N", "--system", panel=LINK_PANEL, min=1, max=255),
]
AnyVehicleOption = Annotated[
    bool, flag("--any-vehicle", "Accept vehicles other than rovers and boats.", LINK_PANEL)
]
RequiredConnectOption = Annotated[
    str,
    option(
        "udpin:0.0.0.0:14550, udpout:HOST:PORT, tcp:HOST:PORT, tcpin:…, /dev/ttyACM0[,BAUD], COM7[,BAUD].",
        "CONNECTION",
        "--connect",
    ),
]
HomeOption = Annotated[
    str | None, option("Home, if the source has none: start, return and centre of FENCE_RADIUS.", "LAT,LON")
]


def firmware_option(text: str) -> Firmware:
    """Return the version that an option names; another text is wrong usage."""
    try:
        return read_firmware(text)
    except VehicleError as error:
        raise typer.BadParameter(str(error)) from None


def cluster_option(text: str) -> str:
    """Return the address of a scheduler that an option names; another text is wrong usage."""
    if re.fullmatch(r"(tcp|tls)://[^/\s]+:\d+", text) is None:
        raise typer.BadParameter(
            f"{text!r} is not the address of a dask scheduler, such as tcp://192.168.1.10:8786"
        )
    return text


FirmwareOption = Annotated[
    Firmware | None,
    option(
        "Firmware version (4.5, 4.6.3), if the source does not report it.",
        "VERSION",
        panel=VEHICLE_PANEL,
        parser=firmware_option,
    ),
]
SimulatedAutopilotOption = Annotated[
    str, option("The autopilot to simulate: ardupilot or px4.", "AUTOPILOT", parser=autopilot_from)
]
SimulatedFirmwareOption = Annotated[
    Firmware | None,
    option(
        "Firmware version (4.5, 4.6.3) that the simulated rover reports, and drives like. Default: 4.7.0-dev of October 2025; for PX4 1.18.0-dev.",
        "VERSION",
        parser=firmware_option,
    ),
]
PlaceOption = Annotated[
    list[str],
    option(
        "A place to go home to, besides home and the rally points; repeatable. The ways home are in --json and pictures.",
        "NAME=LAT,LON",
    ),
]
MOST_JOBS = 1024  # chosen: more processes than any computer has cores are a mistake in typing
MANY_PANEL = "Many at once"
JobsOption = Annotated[
    int | None,
    option(
        "How many processes work at the same time. Default: one per processor.",
        "N",
        panel=MANY_PANEL,
        min=1,
        max=MOST_JOBS,
    ),
]
ClusterOption = Annotated[
    str | None,
    option(
        "Use the workers of this dask scheduler instead (extra cluster).",
        "tcp://HOST:PORT",
        panel=MANY_PANEL,
        parser=cluster_option,
    ),
]
AcceptLessOption = Annotated[
    bool,
    flag(
        "--accept-less",
        "If no route keeps the clearance, take the widest route instead of ending with an error.",
    ),
]


@dataclass(frozen=True, kw_only=True)
class MapOptions:
    """What is said beside a map file."""

    role: Annotated[
        list[str],
        option(
            "What the named feature is, in KML, GeoJSON and other maps. Repeatable.",
            "NAME=inclusion|exclusion|route|ignore",
            panel=_MAP_PANEL,
        ),
    ] = field(default_factory=list)
    outermost: Annotated[
        str | None,
        option(
            "The zone around all others is the inclusion, the others are exclusions.",
            "inclusion",
            panel=_MAP_PANEL,
        ),
    ] = None
    ignore_points: Annotated[
        bool, flag("--ignore-points", "Ignore points whose role the file does not say.", _MAP_PANEL)
    ] = False


@dataclass(frozen=True, kw_only=True)
class ClearanceOptions:
    """What the vehicle adds to a clearance: its size, how well its position is known, a reserve."""

    reserve: Annotated[float, metres("Extra clearance, for wind and wheel slip.", VEHICLE_PANEL)] = 0.0
    position_error: Annotated[
        float | None,
        metres("Position error to add to the clearance. Default: from the GPS fix type.", VEHICLE_PANEL),
    ] = None
    length: Annotated[
        float, metres("The vehicle's length, tools included.", VEHICLE_PANEL, most_m=MOST_VEHICLE_M)
    ] = 0.0
    width: Annotated[
        float, metres("The vehicle's width, tools included.", VEHICLE_PANEL, most_m=MOST_VEHICLE_M)
    ] = 0.0
    gps: Annotated[
        str,
        option(
            "Offset of the GPS antenna from the vehicle's centre, metres.",
            "FORWARD,RIGHT",
            panel=VEHICLE_PANEL,
        ),
    ] = "0,0"


@dataclass(frozen=True, kw_only=True)
class DescriptionOptions:
    """What is said of the vehicle itself, and whether its drive is believed beyond what was measured."""

    vehicle: Annotated[
        Path | None,
        option(
            "Parameter file, for what the source does not report; or a rover's calibration (`pbpp logs calibrate`).",
            "FILE.parm|FILE.toml",
            panel=VEHICLE_PANEL,
        ),
    ] = None
    firmware: FirmwareOption = None
    stopping: Annotated[
        list[Stop],
        option(
            "How far your rover rolls on after HOLD: 6@3 is 6 m from 3 m/s. Repeatable. Default: its own stops, where it was seen to stop; else those of "
            "ArduPilot's simulation.",
            "M@MPS",
            panel=VEHICLE_PANEL,
            parser=stop_from,
        ),
    ] = field(default_factory=list)
    trust_model: Annotated[
        bool,
        flag(
            "--trust-model",
            "Promise a clearance even where the drive model was not measured; without this option no such plan is uploaded.",
            VEHICLE_PANEL,
        ),
    ] = False


@dataclass(frozen=True, slots=True, kw_only=True)
class CommonOptions:
    """What every command has."""

    json_output: Annotated[bool, flag("--json", "One JSON document on stdout.", OUTPUT_PANEL)] = False
    quiet: Annotated[
        int,
        option(
            "Print only warnings and errors; -qq: only errors.",
            "",
            "--quiet",
            "-q",
            panel=OUTPUT_PANEL,
            count=True,
            show_default=False,
        ),
    ] = 0
    config: Annotated[
        Path | None,
        option(
            "Options from a file; options given here override it. See `pbpp config`.",
            "FILE.toml",
            "--config",
            panel=OUTPUT_PANEL,
            is_eager=True,
            callback=take_options,
        ),
    ] = None
    verbose: Annotated[
        bool,
        option(
            "Show more: details of errors, progress without a terminal.",
            None,
            "--verbose",
            "-v",
            panel=OUTPUT_PANEL,
        ),
    ] = False

    @property
    def is_silent(self) -> bool:
        """Whether neither progress nor a report is printed."""
        return self.json_output or self.quiet > 0


@dataclass(frozen=True, slots=True, kw_only=True)
class VehicleLinkOptions(CommonOptions):
    """What commands have that speak to one vehicle."""

    system: SystemOption = None
    any_vehicle: AnyVehicleOption = False
    signing_key: Annotated[
        Path | None,
        option("Sign with this key: 32 bytes, hex, base64, or a passphrase.", "FILE", panel=LINK_PANEL),
    ] = None
    timeout: Annotated[
        float,
        option(
            "How long to wait for the vehicle.", "S", panel=LINK_PANEL, parser=within(0.1, MOST_S, "seconds")
        ),
    ] = 30.0


@dataclass(frozen=True, slots=True, kw_only=True)
class LinkOptions(VehicleLinkOptions):
    """What commands have that speak to one vehicle, once."""

    source_system: Annotated[
        int, option("System id that pbpp uses.", "N", panel=LINK_PANEL, min=1, max=255)
    ] = 245
    source_component: Annotated[
        int, option("Component id that pbpp uses.", "N", panel=LINK_PANEL, min=1, max=255)
    ] = 190

    @property
    def identity(self) -> tuple[int, int]:
        """The system and component id that we speak as."""
        return self.source_system, self.source_component


@dataclass(frozen=True, kw_only=True)
class ManyOptions:
    """Who does many at once."""

    jobs: JobsOption = None
    cluster: ClusterOption = None
