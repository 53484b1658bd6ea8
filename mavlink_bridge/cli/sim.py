"""``pbpp sim``: the embedded rover on a link of its own."""

from __future__ import annotations

import signal
import sys
import threading
from typing import TYPE_CHECKING

import typer

from mavlink_bridge.cli.field_files import read_file, read_mission_file
from mavlink_bridge.cli.terminal import echo, print_json
from mavlink_bridge.cli.values import MOST_FLOAT32, MOST_MPS, MOST_VEHICLE_M, checked_number, position_from
from mavlink_bridge.errors import LinkError, UsageError
from mavlink_bridge.mavlink.autopilots import autopilot_table
from mavlink_bridge.mavlink.messages import Autopilot, MissionType
from mavlink_bridge.simulator.any_vehicle import AUTOPILOTS
from mavlink_bridge.simulator.config import MovingDisc, SimulatorConfig
from mavlink_bridge.simulator.faults import Faults
from mavlink_bridge.simulator.parameters import DEFAULTS
from mavlink_bridge.simulator.shell import Simulator
from missions.errors import InvalidPositionError
from missions.fence import fence_to_items
from missions.formats import fence_of
from missions.geo import parse_lat_lon

if TYPE_CHECKING:
    from mavlink_bridge.cli.options.sim import SimOptions
    from missions.geo import LatLon

_SEES_M = 15.0
"""How far the distance sensor sees; chosen, as usual ones see outdoors."""


def sim(options: SimOptions) -> None:
    """Run the rover until a signal; the one line that is printed, its connection, stands with ``-q`` too."""
    config = _config(options)
    faults = Faults(
        loss=options.loss, duplicate=options.duplicate, latency_s=options.latency, jitter_s=options.jitter
    )
    stop = threading.Event()
    try:
        simulator = Simulator(config, options.listen, faults, options.speedup, options.seed)
    except LinkError as error:
        raise typer.BadParameter(str(error), param_hint="--listen") from None
    with simulator:
        for name in ("SIGINT", "SIGTERM", "SIGBREAK"):  # the last is Ctrl-Break on Windows
            if hasattr(signal, name):
                signal.signal(getattr(signal, name), lambda *_: stop.set())
        if options.json_output:
            print_json({"status": "ok", "command": "sim", "connection": simulator.connection})
        else:
            echo(simulator.connection)
        sys.stdout.flush()
        while not stop.wait(0.5) and simulator.is_running:
            pass


def _config(options: SimOptions) -> SimulatorConfig:
    position, heading_deg = _parse_home(options.home)
    autopilot = AUTOPILOTS[options.autopilot]
    if options.disc and autopilot is Autopilot.PX4:
        raise UsageError("--disc: the simulated PX4 rover has no distance sensor; use --autopilot ardupilot")
    table = autopilot_table(autopilot, options.firmware)
    assert table is not None
    form = table.lists.form
    return SimulatorConfig(
        system=options.system,
        home=position,
        heading_deg=heading_deg,
        fence=form.prepared(
            fence_to_items(fence_of(read_file(options.fence, options), options.fence)), MissionType.FENCE
        )
        if options.fence
        else (),
        mission=form.prepared(read_mission_file(options.mission, options).items, MissionType.MISSION)
        if options.mission
        else (),
        parameters=dict(_parse_parameter(text, autopilot) for text in options.param),
        autopilot=autopilot,
        firmware=options.firmware,
        discs=tuple(map(_parse_disc, options.disc)),
        sensor_m=_SEES_M if options.disc else 0.0,
    )


def _parse_disc(text: str) -> MovingDisc:
    parts = text.split(",")
    speed, heading = parts[3:] if len(parts) == 5 else ("0", "0")
    if len(parts) not in (3, 5):
        raise UsageError(f"--disc {text!r}: expected LAT,LON,RADIUS[,SPEED,HEADING]")
    try:
        return MovingDisc(
            parse_lat_lon(",".join(parts[:2])),
            checked_number(parts[2], 0.0, MOST_VEHICLE_M, "metres", above=True),
            checked_number(speed, 0.0, MOST_MPS, "metres a second"),
            checked_number(heading, -360.0, 360.0, "degrees"),
        )
    except (UsageError, InvalidPositionError) as error:
        raise UsageError(f"--disc {text!r}: expected LAT,LON,RADIUS[,SPEED,HEADING]; {error}") from None


def _parse_home(text: str) -> tuple[LatLon, float]:
    lat, _, rest = text.partition(",")
    lon, _, heading = rest.partition(",")
    position = position_from("--home", f"{lat},{lon}")
    try:
        return position, checked_number(heading or 0.0, -360.0, 360.0, "a heading in degrees")
    except UsageError as error:
        raise UsageError(f"--home: {error}") from None


def _parse_parameter(text: str, autopilot: Autopilot) -> tuple[str, float]:
    name, equals, value = text.partition("=")
    if not equals:
        raise typer.BadParameter(f"{text!r} is not NAME=VALUE", param_hint="--param")
    try:
        number = checked_number(value, -MOST_FLOAT32, MOST_FLOAT32)
    except UsageError as error:
        raise typer.BadParameter(f"{text!r} is not NAME=VALUE: {error}", param_hint="--param") from None
    name = name.strip().upper()
    if autopilot is Autopilot.ARDUPILOTMEGA and name not in DEFAULTS:
        raise typer.BadParameter(f"the simulated rover has no parameter {name}", param_hint="--param")
    return name, number
