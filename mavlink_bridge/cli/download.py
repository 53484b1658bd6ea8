"""``pbpp download``: missions, fences, rally points and parameters from the vehicle."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from mavlink_bridge.backup.store import BackupStore
from mavlink_bridge.cli.common import warn
from mavlink_bridge.cli.kept_files import write_kept
from mavlink_bridge.cli.options.download import KINDS
from mavlink_bridge.cli.options_session import session_for
from mavlink_bridge.cli.restoring import reader_warnings
from mavlink_bridge.cli.terminal import echo, echo_lines, print_json
from mavlink_bridge.errors import BridgeError, LinkError, UsageError
from mavlink_bridge.mavlink.messages import MissionType
from mavlink_bridge.protocol.outcomes import list_read
from mavlink_bridge.protocol.parameters import ParametersOutcome, ReadParameters
from mavlink_bridge.protocol.undisturbed_read import UndisturbedRead
from missions.fence import fence_from_items
from missions.formats import write_mission
from missions.formats.numbers import has_place, xy_for_file
from missions.formats.parameters import is_parameter_name, origin_remarks, qgc_text, value_text
from missions.formats.waypoints import format_items
from missions.items import Command, without_home
from missions.rally import rally_from_items
from missions.situation import Known, Mission

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence
    from pathlib import Path

    from mavlink_bridge.cli.options.download import DownloadOptions
    from mavlink_bridge.cli.session import Session
    from missions.items import MissionItem
    from missions.situation import Situation

_ITEM_SUFFIXES = (".waypoints", ".txt")
_PARAMETER_SUFFIXES = (".parm", ".param", ".params")


def download(options: DownloadOptions) -> None:
    """Read what is asked for, write it to files, and report it."""
    what = options.what
    _check(what, options.connect, options.output)
    items: tuple[MissionItem, ...] = ()
    parameters = ParametersOutcome()
    with session_for(options, options.connect) as (session, _show):
        store = BackupStore()
        if what == "parameters" or store.notes():  # else nothing needs to be distinguished
            warn(reader_warnings(store, session.which_vehicle()))
        if what == "parameters":
            parameters = _read_parameters(session)
        else:
            items = read_list(session, what)
    has_home = what == "mission" and session.autopilot.lists.form.has_home_item
    for path in options.output:
        if what == "mission" and not has_home and path.suffix.lower() in _ITEM_SUFFIXES:
            raise UsageError(
                f"{path}: the first row of such a file is home, which a mission of {session.autopilot.kind} does not hold; nothing was written",
                advice="write it to a .plan",
            )
        if path.suffix.lower() == ".plan":
            _write_plan(path, what, items, session.heard, has_home=has_home)
        elif what == "parameters":
            _write_parameters(path, parameters, session.heard)
        else:
            write_kept(path, format_items(items).encode())
    document: dict[str, Any] = {
        "status": "ok",
        "command": "download",
        "system": session.vehicle.system,
        "what": what,
        "outputs": [str(path) for path in options.output],
    }
    if options.json_output:
        print_json({**document, **_details(what, items, parameters.values)})
    elif not options.quiet:
        number = (
            f"{len(parameters.values)} parameters" if what == "parameters" else f"{what}: {len(items)} items"
        )
        echo(number + "".join(f"; written to {path}" for path in options.output))
        if not options.output:
            echo_lines(_lines(items, dict(sorted(parameters.values.items()))))


def _lines(items: Sequence[MissionItem], parameters: Mapping[str, float]) -> Iterator[str]:
    """Return what was read, a line an item or parameter, in 80 columns as far as its parameters allow."""
    for seq, item in enumerate(items):
        known = item.command in list(Command)
        name = Command(item.command).name if known else f"MAV_CMD {item.command}"
        lat, lon = xy_for_file(item)
        place = str(item.position) if has_place(item.command, item.frame) else f"{lat:g}, {lon:g}"
        params = " ".join(f"p{i}={value:g}" for i, value in enumerate(item.params, 1) if value)
        yield f"{seq:>4}  {name:<30}  {place:<23}  {params}".rstrip()
    for name, value in parameters.items():
        yield f"{name:<16}  {value_text(value)}"


def _check(what: str, connect: str, outputs: list[Path]) -> None:
    if what not in KINDS:
        raise UsageError(f"download {what!r}: expected one of {', '.join(KINDS)}")
    if not connect:
        raise UsageError("download needs --connect CONNECTION")
    suffixes = _PARAMETER_SUFFIXES if what == "parameters" else (*_ITEM_SUFFIXES, ".plan")
    for path in outputs:
        if path.suffix.lower() not in suffixes:
            raise UsageError(
                f"{path}: {what} cannot be written as {path.suffix!r}; expected one of {', '.join(suffixes)}"
            )


def read_list(session: Session, what: str) -> tuple[MissionItem, ...]:
    """Read a list of the vehicle: ``mission``, ``fence`` or ``rally``.

    Raises
    ------
    RefusedError
        The vehicle refused to give it, or another station keeps writing it.
    LinkError
        It fell silent.
    """
    machine = UndisturbedRead(session.vehicle, MissionType[what.upper()])
    session.run(machine, f"reading the {what}")
    items = list_read(machine, what)
    if isinstance(items, BridgeError):
        raise items
    if machine.outcome is not None and machine.outcome.is_coarse:
        warn([f"the vehicle sends positions as 32-bit floats: the {what} is accurate to about 1 m only"])
    return items


def _read_parameters(session: Session) -> ParametersOutcome:
    machine = ReadParameters(session.vehicle)
    session.run(machine, "reading parameters")
    outcome = machine.outcome
    assert outcome is not None
    if not outcome.is_complete:
        raise LinkError(
            f"only {len(outcome.values)} parameters received, {len(outcome.missing)} missing; nothing was written",
            received=len(outcome.values),
            missing=len(outcome.missing),
        )
    warn(
        [f"{name} was received as {came}, not a number: ignored" for name, came in outcome.no_numbers.items()]
    )
    return outcome


def _write_parameters(path: Path, read: ParametersOutcome, vehicle: Situation) -> None:
    """Write parameters as the ground station that the suffix is of reads them: .params QGroundControl, the others Mission Planner and MAVProxy."""
    odd = [name for name in read.values if not is_parameter_name(name)]  # it may hold a line break
    if odd:
        warn([f"{path}: left out, not valid parameter names: {', '.join(map(repr, odd))}"])
    named = {name: value for name, value in sorted(read.values.items()) if name not in odd}
    if path.suffix.lower() == ".params":
        text = qgc_text(replace(vehicle, parameters=named), read.types)
    else:
        separator = " " if path.suffix.lower() == ".parm" else ","
        rows = (f"{name}{separator}{value_text(value)}\n" for name, value in named.items())
        text = "".join((*origin_remarks(vehicle), *rows))
    write_kept(path, text.encode())


def _write_plan(
    path: Path, what: str, items: tuple[MissionItem, ...], vehicle: Situation, *, has_home: bool
) -> None:
    source = "read from the vehicle"
    if what == "mission":
        home = items[0].position if items and has_home else None
        own = without_home(items) if has_home else items
        situation = replace(vehicle, mission=Known(Mission(own, home), None, source))
    elif what == "fence":
        situation = replace(vehicle, fence=Known(fence_from_items(items), None, source))
    else:
        situation = replace(vehicle, rally=Known(rally_from_items(items), None, source))
    write_mission(situation, path, write=write_kept)


def _details(what: str, items: tuple[MissionItem, ...], parameters: Mapping[str, float]) -> dict[str, Any]:
    if what == "parameters":
        return {"parameters": dict(parameters)}
    return {
        "items": [
            {
                "seq": seq,
                "command": int(item.command),
                "frame": int(item.frame),
                "params": [_number(value) for value in item.params],
                **dict(zip(("lat", "lon"), xy_for_file(item), strict=True)),
                "alt_m": _number(item.alt_m),
            }
            for seq, item in enumerate(items)
        ]
    }


def _number(value: float) -> float | None:
    """Return a number as JSON can hold it."""
    return value if math.isfinite(value) else None
