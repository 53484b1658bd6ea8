"""Options for what a vehicle needs: speed, size, how well its position is known, a reserve of the owner's."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Annotated

import typer

from mavlink_bridge.cli.values import (
    LEAST_MPS,
    MOST_M,
    MOST_MPS,
    MOST_VEHICLE_M,
    checked_number,
    position_from,
    within,
)
from mavlink_bridge.errors import UsageError

if TYPE_CHECKING:
    from missions.request import Request
    from missions.situation import Situation

PANEL = "Vehicle"

SpeedOption = Annotated[
    float | None,
    typer.Option(
        metavar="M/S",
        parser=within(LEAST_MPS, MOST_MPS, "metres a second"),
        help="Drive at this speed. Default: the vehicle's own.",
        rich_help_panel=PANEL,
    ),
]
ReserveOption = Annotated[
    float,
    typer.Option(
        metavar="M",
        parser=within(0.0, MOST_M, "metres"),
        help="Added to the clearance, for wind and slip.",
        rich_help_panel=PANEL,
    ),
]
PositionErrorOption = Annotated[
    float | None,
    typer.Option(
        metavar="M",
        parser=within(0.0, MOST_M, "metres"),
        help="Error of the vehicle's position, added to the clearance. Default: from its fix type.",
        rich_help_panel=PANEL,
    ),
]
HomeOption = Annotated[
    str | None,
    typer.Option(
        metavar="LAT,LON",
        help="Home, if the source has none: start, return and centre of FENCE_RADIUS.",
    ),
]
EscapeOption = Annotated[
    bool,
    typer.Option(
        "--escape", help="Let a vehicle that stands on forbidden ground drive out.", rich_help_panel=PANEL
    ),
]
LengthOption = Annotated[
    float,
    typer.Option(
        metavar="M",
        parser=within(0.0, MOST_VEHICLE_M, "metres"),
        help="The vehicle's length, tools included.",
        rich_help_panel=PANEL,
    ),
]
WidthOption = Annotated[
    float,
    typer.Option(
        metavar="M",
        parser=within(0.0, MOST_VEHICLE_M, "metres"),
        help="The vehicle's width, tools included.",
        rich_help_panel=PANEL,
    ),
]
GpsOption = Annotated[
    str,
    typer.Option(
        metavar="FORWARD,RIGHT",
        help="The GPS antenna from the middle of the vehicle, metres.",
        rich_help_panel=PANEL,
    ),
]


def with_vehicle(
    request: Request,
    *,
    reserve: float,
    position_error: float | None,
    size: tuple[float, float, str],
    speed: float | None = None,
    escape: bool = False,
) -> Request:
    """Add what a vehicle needs to what is asked of a plan; ``size`` is its length, width and antenna.

    Raises
    ------
    UsageError
        An option is not what it has to be.
    """
    from missions.vehicle import Footprint  # noqa: PLC0415 - quick help

    length_m, width_m, antenna = size
    try:
        forward_m, right_m = (
            checked_number(part, -MOST_VEHICLE_M, MOST_VEHICLE_M, "metres") for part in antenna.split(",")
        )
    except ValueError:
        raise UsageError(f"--gps {antenna!r}: expected FORWARD,RIGHT in metres") from None
    except UsageError as error:
        raise UsageError(f"--gps {antenna!r}: expected FORWARD,RIGHT in metres; {error}") from None
    return replace(
        request,
        speed_mps=speed,
        reserve_m=reserve,
        position_error_m=position_error,
        footprint=Footprint(length_m, width_m, forward_m, right_m),
        escape=escape,
    )


def with_home_option(situation: Situation, home: str | None) -> Situation:
    """Set home to where the user wants it.

    Raises
    ------
    UsageError
        It is no position.
    """
    if home is None:
        return situation
    from missions.situation import Known  # noqa: PLC0415

    return replace(situation, home=Known(position_from("--home", home), None, "--home"))
