"""``pbpp sim``: the embedded rover on a link of its own."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from mavlink_bridge.cli.common import JsonOption, QuietOption, print_json
from mavlink_bridge.cli.field_files import (
    IgnorePointsOption,
    MapOptions,
    OutermostOption,
    RoleOption,
    read_file,
    read_mission_file,
)
from mavlink_bridge.cli.terminal import echo
from mavlink_bridge.cli.values import MOST_FLOAT32, MOST_S, checked_number, position_from, within
from mavlink_bridge.errors import UsageError

if TYPE_CHECKING:
    from mavlink_bridge.simulator.config import SimulatorConfig
    from missions.geo import LatLon

MOST_SEED = 2**63 - 1
"""What fits everywhere a seed is kept."""


def sim(
    listen: Annotated[
        str,
        typer.Option(
            metavar="CONNECTION", help="tcpin:, udpin: or udpout:HOST:PORT; port 0 is any free one."
        ),
    ] = "tcpin:127.0.0.1:5760",
    home: Annotated[
        str, typer.Option(metavar="LAT,LON[,HEADING]", help="Where the rover stands and looks at first.")
    ] = "40.071374,-105.229930,0",
    fence: Annotated[Path | None, typer.Option(help="Fence file stored in the rover.")] = None,
    mission: Annotated[
        Path | None,
        typer.Option(help="Mission file stored in the rover; its home, if it has one, is not used."),
    ] = None,
    param: Annotated[
        list[str] | None, typer.Option(metavar="NAME=VALUE", help="A parameter that differs; repeatable.")
    ] = None,
    speedup: Annotated[
        float, typer.Option(metavar="X", parser=within(0.01, 1000.0), help="How many times faster than real.")
    ] = 1.0,
    loss: Annotated[
        float, typer.Option(metavar="P", parser=within(0.0, 1.0), help="Share of frames lost, each way.")
    ] = 0.0,
    duplicate: Annotated[
        float, typer.Option(metavar="P", parser=within(0.0, 1.0), help="Share of frames that come twice.")
    ] = 0.0,
    latency: Annotated[
        float,
        typer.Option(
            metavar="S", parser=within(0.0, MOST_S, "seconds"), help="Seconds each frame is late, each way."
        ),
    ] = 0.0,
    jitter: Annotated[
        float,
        typer.Option(
            metavar="S", parser=within(0.0, MOST_S, "seconds"), help="Up to so many seconds more, at random."
        ),
    ] = 0.0,
    seed: Annotated[int, typer.Option(min=-MOST_SEED, max=MOST_SEED, help="Seed of the link's faults.")] = 0,
    system: Annotated[int, typer.Option(min=1, max=255, help="MAVLink system id.")] = 1,
    role: RoleOption = None,
    outermost: OutermostOption = None,
    ignore_points: IgnorePointsOption = False,
    json_output: JsonOption = False,
    quiet: QuietOption = False,
) -> None:
    """Run a simulated rover until Ctrl-C.

    It answers MAVLink 2 as ArduPilot Rover does: missions, fences, rally points, parameters, modes, arming; it drives AUTO and GUIDED.
    Prints the connection string to open as soon as it listens.

    For example:

    `pbpp sim --fence field.plan --home 40.0713,-105.2299`

    `pbpp sim --listen udpout:127.0.0.1:14550 --loss 0.1 --latency 0.2`
    """
    del quiet  # one line is all there is to print
    import signal  # noqa: PLC0415 - with the other imports below: a usage error need not wait for them
    import threading  # noqa: PLC0415

    from mavlink_bridge.errors import LinkError  # noqa: PLC0415
    from mavlink_bridge.simulator.faults import Faults  # noqa: PLC0415
    from mavlink_bridge.simulator.shell import Simulator  # noqa: PLC0415

    maps = MapOptions(role, outermost, ignore_points)
    config = _config(home, fence, mission, param or [], system, maps)
    faults = Faults(loss=loss, duplicate=duplicate, latency_s=latency, jitter_s=jitter)
    stop = threading.Event()
    try:
        simulator = Simulator(config, listen, faults, speedup, seed)
    except LinkError as error:
        raise typer.BadParameter(str(error), param_hint="--listen") from None
    with simulator:
        for name in ("SIGINT", "SIGTERM", "SIGBREAK"):  # the last is Ctrl-Break on Windows
            if hasattr(signal, name):
                signal.signal(getattr(signal, name), lambda *_: stop.set())
        if json_output:
            print_json({"status": "ok", "command": "sim", "connection": simulator.connection})
        else:
            echo(simulator.connection)
        sys.stdout.flush()
        while not stop.wait(0.5) and simulator.is_running:
            pass


def _config(
    home: str,
    fence: Path | None,
    mission: Path | None,
    params: list[str],
    system: int,
    maps: MapOptions,
) -> SimulatorConfig:
    from mavlink_bridge.simulator.config import SimulatorConfig  # noqa: PLC0415
    from missions.fence import fence_to_items  # noqa: PLC0415
    from missions.formats import fence_of  # noqa: PLC0415

    position, heading_deg = _parse_home(home)
    return SimulatorConfig(
        system=system,
        home=position,
        heading_deg=heading_deg,
        fence=fence_to_items(fence_of(read_file(fence, maps), fence)) if fence else (),
        mission=read_mission_file(mission, maps.of_another_file()).items if mission else (),
        parameters=dict(_parse_parameter(text) for text in params),
    )


def _parse_home(text: str) -> tuple[LatLon, float]:
    lat, _, rest = text.partition(",")
    lon, _, heading = rest.partition(",")
    position = position_from("--home", f"{lat},{lon}")
    try:
        return position, checked_number(heading or 0.0, -360.0, 360.0, "a heading in degrees")
    except UsageError as error:
        raise UsageError(f"--home: {error}") from None


def _parse_parameter(text: str) -> tuple[str, float]:
    from mavlink_bridge.simulator.parameters import DEFAULTS  # noqa: PLC0415

    name, equals, value = text.partition("=")
    if not equals:
        raise typer.BadParameter(f"{text!r} is not NAME=VALUE", param_hint="--param")
    try:
        number = checked_number(value, -MOST_FLOAT32, MOST_FLOAT32)
    except UsageError as error:
        raise typer.BadParameter(f"{text!r} is not NAME=VALUE: {error}", param_hint="--param") from None
    name = name.strip().upper()
    if name not in DEFAULTS:
        raise typer.BadParameter(f"the simulated rover has no parameter {name}", param_hint="--param")
    return name, number
