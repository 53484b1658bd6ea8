"""``pbpp demo``: the whole loop on a simulated rover, with a picture and a report at the end."""

from __future__ import annotations

import re
import secrets
import time
from contextlib import ExitStack
from dataclasses import dataclass, field
from importlib.resources import as_file, files
from typing import TYPE_CHECKING

import typer
from shapely import LineString

from mavlink_bridge.cli.common import inform, warn
from mavlink_bridge.cli.failing import ExitCode
from mavlink_bridge.cli.kept_files import make_room, remember, write_kept
from mavlink_bridge.cli.live import conduct
from mavlink_bridge.cli.plan_results import write_outputs
from mavlink_bridge.cli.terminal import echo, print_json
from mavlink_bridge.director import Orders
from mavlink_bridge.link import Link
from mavlink_bridge.mavlink.autopilots import autopilot_table
from mavlink_bridge.mavlink.messages import Autopilot, FenceStatus, GlobalPositionInt, MissionType, Statustext
from mavlink_bridge.simulator import Simulator, SimulatorConfig, SteppedRover
from mavlink_bridge.simulator.any_vehicle import AUTOPILOTS, vehicle_of
from mavlink_bridge.tlog import TlogWriter
from missions.fence import fence_to_items
from missions.formats import read_fence
from missions.geo import LatLon, from_e7
from missions.picture import draw_plan
from missions.request import GoTo

if TYPE_CHECKING:
    from mavlink_bridge.cli.options.demo import DemoOptions
    from mavlink_bridge.mavlink.incident_rules import IncidentRules
    from mavlink_bridge.mavlink.messages import Frame
    from missions.fence import Fence
    from missions.firmware import Firmware
    from missions.planned import Plan

# The maze of the recorded logs: its start, a target in it and a clearance that leaves a route.
_HOME = (40.071374, -105.229930)
_TARGET = (40.0726316, -105.2290497)
_CLEARANCE_M = 2.5
_PARAMETERS = {
    Autopilot.ARDUPILOTMEGA: {"FENCE_ENABLE": 1.0, "WP_RADIUS": 2.0, "WP_SPEED": 4.0},
    Autopilot.PX4: {},  # its airframe's own, 3 m/s: so it was measured
}
_AUTOPILOT, _CRITICAL = 1, 2  # MAV_COMP_ID_AUTOPILOT1, MAV_SEVERITY_CRITICAL
_ANY_PORT = "tcpin:127.0.0.1:0"
_IDENTITY = (245, 190)  # the one-shot commands' own, `link.ONE_SHOT_IDENTITY`


@dataclass(slots=True)
class _Heard:
    """What was heard while driving; PX4 tells of breaches by text alone."""

    incidents: IncidentRules
    track: list[LatLon] = field(default_factory=list)
    breaches: int = 0


def demo(options: DemoOptions) -> None:
    """Drive the demo's mission; write its picture, files and report."""
    out = options.out
    out.mkdir(parents=True, exist_ok=True)
    make_room(out / "demo.tlog")
    table = autopilot_table(AUTOPILOTS[options.autopilot], options.firmware)
    assert table is not None
    drive = _Heard(table.incidents)
    begun_s = time.monotonic()
    with ExitStack() as stack:
        recorder = stack.enter_context(TlogWriter(out / "demo.tlog"))
        rover = _rover(options)
        link = stack.enter_context(Link(rover, _IDENTITY, recorder, clock=rover.now_s))
        request = GoTo(target=LatLon(*_TARGET), clearance_m=_CLEARANCE_M)
        orders = Orders(identity=_IDENTITY, request=request, upload=True, drive=True, arm=True)
        result = conduct(
            link,
            orders,
            quiet=options.is_silent,
            on_frames=lambda frames: _observe(drive, frames),
            is_real=False,
        )
    remember(out / "demo.tlog")
    inform(result.plan.info)
    warn(result.plan.warnings)
    written = write_outputs(
        result.plan, result.situation, [out / "mission.waypoints", out / "mission.plan"], []
    )
    draw_plan(result.plan, out / "plan.png", track=drive.track, write=write_kept)
    driven_m, length_m = _driven(result.plan, drive.track)
    document = {
        "status": "ok",
        "command": "demo",
        "arrived": True,
        "breaches": drive.breaches,
        "length_m": round(result.plan.length_m, 2),
        "driven_length_m": round(length_m, 2),
        "clearance_m": result.plan.clearance_m,
        "driven_clearance_m": round(driven_m, 2),
        "verified": result.verified,
        "time_s": round(time.monotonic() - begun_s, 1),
        "outputs": [str(path) for path in (out / "plan.png", *written, out / "demo.tlog")],
    }
    if options.json_output:
        print_json(document)
    elif not options.quiet:
        _report(document, result.plan)
    if drive.breaches:
        raise typer.Exit(ExitCode.CHECK)


def demo_rover(autopilot: str, firmware: Firmware | None, speedup: float) -> Simulator:
    """Return a rover in the maze on a link of its own, for who wants to see it drive."""
    return Simulator(_config(AUTOPILOTS[autopilot], firmware), _ANY_PORT, speedup=speedup)


def _rover(options: DemoOptions) -> SteppedRover:
    """Return a rover in the maze, on a link that no slow computer breaks."""
    config = _config(AUTOPILOTS[options.autopilot], options.firmware)
    return SteppedRover(vehicle_of(config), options.speedup)


def _config(autopilot: Autopilot, firmware: Firmware | None) -> SimulatorConfig:
    table = autopilot_table(autopilot, firmware)
    assert table is not None
    return SimulatorConfig(
        home=LatLon(*_HOME),
        fence=table.lists.form.prepared(fence_to_items(_maze()), MissionType.FENCE),
        parameters=_PARAMETERS[autopilot],
        autopilot=autopilot,
        firmware=firmware,
        uid=secrets.token_bytes(12),  # each demo is a new rover: an interrupted one does not bear on the next
    )


def _maze() -> Fence:
    with as_file(files("mavlink_bridge.cli") / "data" / "maze-fence.waypoints") as path:
        return read_fence(path)


def _observe(drive: _Heard, frames: list[Frame]) -> None:
    """Keep the track and the breaches that the vehicle reports."""
    for frame in frames:
        if isinstance(frame.message, GlobalPositionInt):
            drive.track.append(from_e7(frame.message.lat, frame.message.lon))
        elif isinstance(frame.message, FenceStatus):
            drive.breaches = max(drive.breaches, frame.message.breach_count)
        elif isinstance(frame.message, Statustext) and frame.component == _AUTOPILOT:
            rules = drive.incidents
            is_breach = re.match(rules.breach_text, frame.message.text, re.IGNORECASE) is not None
            drive.breaches += is_breach and not rules.counts_breaches and frame.message.severity <= _CRITICAL


def _driven(plan: Plan, track: list[LatLon]) -> tuple[float, float]:
    """Return the driven track's least clearance and its length, in metres."""
    line = LineString(plan.ground.frame.to_local_array(track))
    return plan.ground.clearance_m(line), float(line.length)


def _report(document: dict[str, object], plan: Plan) -> None:
    echo(
        f"Arrived after {document['driven_length_m']} m (planned route {document['length_m']} m, {sum(item.is_placed for item in plan.items)} waypoints)"
    )
    echo(
        f"Fence clearance: at least {document['clearance_m']} m promised, {document['driven_clearance_m']} m kept; "
        f"fence breaches: {document['breaches']}"
    )
    echo(f"The mission was verified on the vehicle; total time {document['time_s']} s")
    outputs = document["outputs"]
    assert isinstance(outputs, list)
    for path in outputs:
        echo(f"Wrote {path}")
    echo("Drive it yourself, on a page: pbpp serve --demo --open")
