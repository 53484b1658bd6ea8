"""What options add to a request and a situation: the vehicle's size, how well its position is known, where its home is."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from mavlink_bridge.cli.common import warn
from mavlink_bridge.cli.field_files import read_vehicle_file
from mavlink_bridge.cli.values import MOST_VEHICLE_M, checked_number, position_from
from mavlink_bridge.errors import UsageError
from missions.situation import Known, Situation
from missions.stops import Stops
from missions.vehicle import Autopilot, Footprint, known_ardupilot

if TYPE_CHECKING:
    from mavlink_bridge.cli.options.shared import ClearanceOptions, DescriptionOptions
    from missions.request import Request


def with_vehicle(request: Request, options: ClearanceOptions) -> Request:
    """Add to what is asked of a plan what the vehicle needs: its size, how well its position is known, a reserve.

    Raises
    ------
    UsageError
        An option is not what it has to be.
    """
    antenna = options.gps
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
        reserve_m=options.reserve,
        position_error_m=options.position_error,
        footprint=Footprint(options.length, options.width, forward_m, right_m),
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
    return replace(situation, home=Known(position_from("--home", home), None, "--home"))


def described_vehicle(options: DescriptionOptions) -> Situation:
    """Return what the user says of the vehicle: a parameter file, the firmware's version (else the one that the file names), how far it rolls on."""
    described = read_vehicle_file(options.vehicle) if options.vehicle else Situation()
    firmware = options.firmware or described.firmware
    return replace(described, firmware=firmware, stops=Stops(given=tuple(options.stopping)))


def with_description(situation: Situation, described: Situation) -> Situation:
    """Return the situation with what the user says of its vehicle; what the vehicle itself reported counts more, and a contradiction is told."""
    heard, said = situation.ardupilot, known_ardupilot(described)
    if heard is not None and said is not None and heard != said:
        name, own = (Autopilot.ARDUPILOT if one else Autopilot.PX4 for one in (said, heard))
        warn([f"--vehicle holds {name}'s parameters, but the vehicle is {own}, to which they mean nothing"])
    return replace(
        situation,
        parameters={**described.parameters, **situation.parameters},
        firmware=situation.firmware or described.firmware,
        stops=replace(situation.stops, given=described.stops.given),
        calibration=described.calibration,
    )
