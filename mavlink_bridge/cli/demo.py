"""``pbpp demo``: the whole loop on a simulated rover, with a picture and a report at the end."""

from __future__ import annotations

import time
from contextlib import ExitStack
from dataclasses import dataclass, field
from importlib.resources import as_file, files
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from mavlink_bridge.cli.common import JsonOption, QuietOption, print_json, warn
from mavlink_bridge.cli.terminal import echo
from mavlink_bridge.cli.values import within

if TYPE_CHECKING:
    from mavlink_bridge.mavlink.messages import Frame
    from mavlink_bridge.simulator import SteppedRover
    from missions.fence import Fence
    from missions.geo import LatLon
    from missions.planned import Plan

# The maze of the recorded logs: its start, a target in it and a clearance that leaves a route.
_HOME = (40.071374, -105.229930)
_TARGET = (40.0726316, -105.2290497)
_CLEARANCE_M = 2.5
_IDENTITY = (245, 190)  # the one-shot commands' own, `link.ONE_SHOT_IDENTITY`


@dataclass(slots=True)
class _Heard:
    """What was heard while driving."""

    track: list[LatLon] = field(default_factory=list)
    breaches: int = 0


def demo(
    out: Annotated[
        Path, typer.Option(metavar="DIR", help="Where the picture, the mission and the log go.")
    ] = Path("demo-out"),
    speedup: Annotated[
        float,
        typer.Option(
            metavar="X",
            parser=within(1.0, 20.0),
            help="Simulated time runs so much faster, where the computer keeps up.",
        ),
    ] = 4.0,
    json_output: JsonOption = False,
    quiet: QuietOption = False,
) -> None:
    """Show the whole loop: simulated rover, fence, target, plan, upload, verify, drive, picture, report."""
    from mavlink_bridge.cli.kept_files import make_room, remember, write_kept  # noqa: PLC0415 - quick help
    from mavlink_bridge.cli.live import LiveResult, conduct  # noqa: PLC0415
    from mavlink_bridge.cli.plan_results import write_outputs  # noqa: PLC0415
    from mavlink_bridge.director import Orders  # noqa: PLC0415
    from mavlink_bridge.link import Link  # noqa: PLC0415
    from mavlink_bridge.tlog import TlogWriter  # noqa: PLC0415
    from missions.geo import LatLon  # noqa: PLC0415
    from missions.picture import draw_plan  # noqa: PLC0415
    from missions.request import GoTo  # noqa: PLC0415

    out.mkdir(parents=True, exist_ok=True)
    make_room(out / "demo.tlog")
    drive = _Heard()
    begun_s = time.monotonic()
    with ExitStack() as stack:
        recorder = stack.enter_context(TlogWriter(out / "demo.tlog"))
        rover = _rover(speedup)
        link = stack.enter_context(Link(rover, _IDENTITY, recorder, clock=rover.now_s))
        request = GoTo(target=LatLon(*_TARGET), clearance_m=_CLEARANCE_M)
        orders = Orders(identity=_IDENTITY, request=request, upload=True, drive=True, arm=True)
        result: LiveResult = conduct(
            link,
            orders,
            quiet=quiet or json_output,
            on_frames=lambda frames: _observe(drive, frames),
            is_real=False,
        )
    remember(out / "demo.tlog")
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
    if json_output:
        print_json(document)
    elif not quiet:
        _report(document, result.plan)
    if drive.breaches:
        raise typer.Exit(8)


def _rover(speedup: float) -> SteppedRover:
    """Return a rover in the maze, on a link that no slow computer breaks."""
    import secrets  # noqa: PLC0415 - quick help

    from mavlink_bridge.simulator import SimulatedVehicle, SimulatorConfig, SteppedRover  # noqa: PLC0415 - quick help
    from missions.fence import fence_to_items  # noqa: PLC0415
    from missions.geo import LatLon  # noqa: PLC0415

    config = SimulatorConfig(
        home=LatLon(*_HOME),
        fence=fence_to_items(_maze()),
        parameters={"FENCE_ENABLE": 1.0, "WP_RADIUS": 2.0, "WP_SPEED": 4.0},
        uid=secrets.token_bytes(12),  # each demo is a new rover: an interrupted one does not bear on the next
    )
    return SteppedRover(SimulatedVehicle(config), speedup)


def _maze() -> Fence:
    from missions.formats import read_fence  # noqa: PLC0415 - quick help

    with as_file(files("mavlink_bridge.cli") / "data" / "maze-fence.waypoints") as path:
        return read_fence(path)


def _observe(drive: _Heard, frames: list[Frame]) -> None:
    """Keep the track and the breaches that the vehicle reports."""
    from mavlink_bridge.mavlink.messages import FenceStatus, GlobalPositionInt  # noqa: PLC0415 - quick help
    from missions.geo import from_e7  # noqa: PLC0415

    for frame in frames:
        if isinstance(frame.message, GlobalPositionInt):
            drive.track.append(from_e7(frame.message.lat, frame.message.lon))
        elif isinstance(frame.message, FenceStatus):
            drive.breaches = max(drive.breaches, frame.message.breach_count)


def _driven(plan: Plan, track: list[LatLon]) -> tuple[float, float]:
    """Return the driven track's least clearance and its length, in metres."""
    from shapely import LineString  # noqa: PLC0415 - quick help

    line = LineString(plan.ground.frame.to_local_array(track))
    return plan.ground.clearance_m(line), float(line.length)


def _report(document: dict[str, object], plan: Plan) -> None:
    echo(
        f"Arrived after {document['driven_length_m']} m (drawn {document['length_m']} m, {len(plan.items)} waypoints)"
    )
    echo(
        f"Clearance: {document['clearance_m']} m promised, {document['driven_clearance_m']} m driven; "
        f"breaches {document['breaches']}"
    )
    echo(f"The mission was verified on the vehicle; all of it took {document['time_s']} s")
    outputs = document["outputs"]
    assert isinstance(outputs, list)
    for path in outputs:
        echo(f"Wrote {path}")
