"""Options that several commands have, each written once."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer

from mavlink_bridge.cli.options_file import take_options
from mavlink_bridge.cli.values import MOST_M, MOST_S, MOST_VEHICLE_M, stop_from, within
from missions.errors import VehicleError
from missions.firmware import Firmware, read_firmware
from missions.stops import Stop

LINK_PANEL, OUTPUT_PANEL, VEHICLE_PANEL = "Link", "Output", "Vehicle"
_MAP_PANEL = "Map files: what each zone is"
"""How help groups what many commands have."""

ConnectOption = Annotated[
    str | None,
    typer.Option(
        "--connect",
        metavar="CONNECTION",
        help="A live link: udpin:0.0.0.0:14550, udpout:HOST:PORT, tcp:HOST:PORT, tcpin:…, /dev/ttyACM0[,BAUD], COM7[,BAUD].",
    ),
]
SystemOption = Annotated[
    int | None,
    typer.Option(
        "--system",
        metavar="N",
        min=1,
        max=255,
        help="Which vehicle, when several are heard.",
        rich_help_panel=LINK_PANEL,
    ),
]
TimeoutOption = Annotated[
    float,
    typer.Option(
        metavar="S",
        parser=within(0.1, MOST_S, "seconds"),
        help="How long to wait for the vehicle.",
        rich_help_panel=LINK_PANEL,
    ),
]
AnyVehicleOption = Annotated[
    bool,
    typer.Option(
        "--any-vehicle", help="Accept vehicles other than rovers and boats.", rich_help_panel=LINK_PANEL
    ),
]
RequiredConnectOption = Annotated[
    str,
    typer.Option(
        "--connect",
        metavar="CONNECTION",
        help="udpin:0.0.0.0:14550, udpout:HOST:PORT, tcp:HOST:PORT, tcpin:…, /dev/ttyACM0[,BAUD], COM7[,BAUD].",
    ),
]
SigningKeyOption = Annotated[
    Path | None,
    typer.Option(
        metavar="FILE",
        help="Sign with this key: 32 bytes, hex, base64, or a passphrase.",
        rich_help_panel=LINK_PANEL,
    ),
]
ReserveOption = Annotated[
    float,
    typer.Option(
        metavar="M",
        parser=within(0.0, MOST_M, "metres"),
        help="Extra clearance, for wind and wheel slip.",
        rich_help_panel=VEHICLE_PANEL,
    ),
]
PositionErrorOption = Annotated[
    float | None,
    typer.Option(
        metavar="M",
        parser=within(0.0, MOST_M, "metres"),
        help="Position error to add to the clearance. Default: from the GPS fix type.",
        rich_help_panel=VEHICLE_PANEL,
    ),
]
HomeOption = Annotated[
    str | None,
    typer.Option(
        metavar="LAT,LON",
        help="Home, if the source has none: start, return and centre of FENCE_RADIUS.",
    ),
]
LengthOption = Annotated[
    float,
    typer.Option(
        metavar="M",
        parser=within(0.0, MOST_VEHICLE_M, "metres"),
        help="The vehicle's length, tools included.",
        rich_help_panel=VEHICLE_PANEL,
    ),
]
WidthOption = Annotated[
    float,
    typer.Option(
        metavar="M",
        parser=within(0.0, MOST_VEHICLE_M, "metres"),
        help="The vehicle's width, tools included.",
        rich_help_panel=VEHICLE_PANEL,
    ),
]
GpsOption = Annotated[
    str,
    typer.Option(
        metavar="FORWARD,RIGHT",
        help="Offset of the GPS antenna from the vehicle's centre, metres.",
        rich_help_panel=VEHICLE_PANEL,
    ),
]
RoleOption = Annotated[
    list[str],
    typer.Option(
        metavar="NAME=inclusion|exclusion|route|ignore",
        help="What the named feature is, in KML, GeoJSON and other maps. Repeatable.",
        rich_help_panel=_MAP_PANEL,
    ),
]
OutermostOption = Annotated[
    str | None,
    typer.Option(
        metavar="inclusion",
        help="The zone around all others is the inclusion, the others are exclusions.",
        rich_help_panel=_MAP_PANEL,
    ),
]
IgnorePointsOption = Annotated[
    bool,
    typer.Option(
        "--ignore-points", help="Ignore points whose role the file does not say.", rich_help_panel=_MAP_PANEL
    ),
]


def _firmware(text: str) -> Firmware:
    try:
        return read_firmware(text)
    except VehicleError as error:
        raise typer.BadParameter(str(error)) from None


FirmwareOption = Annotated[
    Firmware | None,
    typer.Option(
        metavar="VERSION",
        parser=_firmware,
        help="Firmware version (4.5, 4.6.3), if the source does not report it.",
        rich_help_panel=VEHICLE_PANEL,
    ),
]
StoppingOption = Annotated[
    list[Stop],
    typer.Option(
        metavar="M@MPS",
        parser=stop_from,
        help="How far your rover rolls on after HOLD: 6@3 is 6 m from 3 m/s. Repeatable. Default: its own stops, where it was seen to stop; else those of "
        "ArduPilot's simulation.",
        rich_help_panel=VEHICLE_PANEL,
    ),
]
TrustOption = Annotated[
    bool,
    typer.Option(
        "--trust-model",
        help="Promise a clearance even outside the measured range.",
        rich_help_panel=VEHICLE_PANEL,
    ),
]


@dataclass(frozen=True, slots=True, kw_only=True)
class CommonOptions:
    """What every command has."""

    json_output: Annotated[
        bool, typer.Option("--json", help="One JSON document on stdout.", rich_help_panel=OUTPUT_PANEL)
    ] = False
    quiet: Annotated[
        int,
        typer.Option(
            "--quiet",
            "-q",
            count=True,
            metavar="",
            show_default=False,
            help="Print only warnings and errors; -qq: only errors.",
            rich_help_panel=OUTPUT_PANEL,
        ),
    ] = 0
    config: Annotated[
        Path | None,
        typer.Option(
            "--config",
            metavar="FILE.toml",
            is_eager=True,
            callback=take_options,
            help="Options from a file; options given here override it. See `pbpp config`.",
            rich_help_panel=OUTPUT_PANEL,
        ),
    ] = None
    verbose: Annotated[
        bool,
        typer.Option(
            "--verbose",
            "-v",
            help="Show more: details of errors, progress without a terminal.",
            rich_help_panel=OUTPUT_PANEL,
        ),
    ] = False

    @property
    def is_silent(self) -> bool:
        """Whether neither progress nor a report is printed."""
        return self.json_output or self.quiet > 0


@dataclass(frozen=True, slots=True, kw_only=True)
class LinkOptions(CommonOptions):
    """What commands have that speak to one vehicle, once."""

    system: SystemOption = None
    any_vehicle: AnyVehicleOption = False
    source_system: Annotated[
        int,
        typer.Option(
            metavar="N", min=1, max=255, help="System id that pbpp uses.", rich_help_panel=LINK_PANEL
        ),
    ] = 245
    source_component: Annotated[
        int,
        typer.Option(
            metavar="N", min=1, max=255, help="Component id that pbpp uses.", rich_help_panel=LINK_PANEL
        ),
    ] = 190
    signing_key: SigningKeyOption = None
    timeout: TimeoutOption = 30.0

    @property
    def identity(self) -> tuple[int, int]:
        """The system and component id that we speak as."""
        return self.source_system, self.source_component
