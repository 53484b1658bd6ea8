"""``pbpp log``: what a recorded log holds."""

from __future__ import annotations

from functools import partial
from itertools import groupby
from typing import TYPE_CHECKING, TypeVar

import typer
from rich.box import SIMPLE_HEAD
from rich.table import Table

from mavlink_bridge.cli.drawing import cell, console, progress_bar
from mavlink_bridge.cli.failing import ExitCode
from mavlink_bridge.cli.log_times import date_text
from mavlink_bridge.cli.log_verdict import findings, names_of_stretches, verdict
from mavlink_bridge.cli.pictures import check_plots, draw
from mavlink_bridge.cli.terminal import echo, print_json, say
from mavlink_bridge.errors import LogError, UsageError
from mavlink_bridge.logbook import read_logbook
from mavlink_bridge.logbook.document import as_document
from mavlink_bridge.mavlink.autopilots import autopilot_of
from mavlink_bridge.mavlink.messages import MissionType
from missions.errors import VehicleError
from missions.picture.drives import drive_scene
from missions.vehicle import bits
from missions.words import counted

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence
    from pathlib import Path

    from mavlink_bridge.cli.options.log import LogOptions
    from mavlink_bridge.console.one_file import StillPage
    from mavlink_bridge.logbook import Logbook, VehicleLog
    from missions.picture.scene import PictureScene

Row = TypeVar("Row")
_MOST_ROWS = 40  # of a table, so that it fits a terminal's screen; chosen
_UNION_BIT = 2
"""FENCE_OPTIONS: inside one inclusion is enough."""


def log(options: LogOptions) -> None:
    """Print what each log holds, or draw one."""
    plots = options.plot
    if plots and len(options.files) > 1:
        raise UsageError("--plot draws one log: give one FILE")
    check_plots(plots, json_output=options.json_output)
    documents: list[dict[str, object]] = []
    is_unusable = False
    with progress_bar(quiet=options.is_silent or len(options.files) == 1) as show:
        for number, path in enumerate(options.files):
            show(path.name, number, len(options.files))
            try:
                book = read_logbook(path, options.system)
            except LogError as error:
                if len(options.files) == 1:
                    raise
                is_unusable = True
                documents.append({"log": path.name, "error": "LogError", "message": str(error)})
                say(f"error: {error}", typer.colors.RED)
                continue
            drawn = draw(partial(_scene, book), partial(_page, book, path), plots)
            if options.json_output:
                documents.append(as_document(book))
            elif not options.quiet:
                for picture in drawn:
                    echo(f"Wrote {picture}")
                _print(book, messages=options.messages)
    if options.json_output:
        status = "error" if is_unusable else "ok"
        code = {"exit_code": int(ExitCode.INPUT)} if is_unusable else {}
        print_json({"status": status, "command": "log", **code, "logs": documents})
    if is_unusable:
        raise typer.Exit(ExitCode.INPUT)


def _scene(book: Logbook) -> PictureScene:
    if not book.vehicles:
        raise LogError(f"{book.name}: no vehicle was heard, so there is nothing to draw")
    vehicle = book.vehicles[0]
    if len(book.vehicles) > 1:
        names = ", ".join(str(other.system) for other in book.vehicles)
        raise UsageError(f"{book.name} holds vehicles {names}; choose one to draw with --system N")
    mission = vehicle.situation.mission
    first = autopilot_of(ardupilot=vehicle.situation.ardupilot).lists.form.first_compared(MissionType.MISSION)
    items = enumerate(mission.value.items if mission else (), start=first)
    return drive_scene(
        (f"{book.name}: {vehicle.driven_m:.1f} m driven", verdict(vehicle)[0]),
        vehicle.fences[-1][1] if vehicle.fences else None,
        list(zip(names_of_stretches(vehicle), (part.positions for part in vehicle.track), strict=True)),
        union=_is_union(vehicle),
        mission=[(number, item.position) for number, item in items if item.is_placed],
        targets=[target.position for target in vehicle.targets],
        breaches=[
            (f"breach {number}", one.begun_at) for number, one in enumerate(vehicle.intrusions, start=1)
        ],
    )


def _page(book: Logbook, log: Path, scene: PictureScene) -> StillPage:
    """Return the director's run over the log, with what the logbook found in it."""
    from mavlink_bridge.console.log_page import log_page  # noqa: PLC0415 - the director, for a page alone

    vehicle = book.vehicles[0]
    breaches = [(f"breach {number}", one.begun_at) for number, one in enumerate(vehicle.intrusions, start=1)]
    targets = [target.position for target in vehicle.targets]
    return log_page(log, vehicle.system, scene.title, list(findings(vehicle)), breaches, targets)


def _is_union(vehicle: VehicleLog) -> bool:
    """Return whether one inclusion is enough; the notes name an impossible FENCE_OPTIONS."""
    try:
        return bool(bits(vehicle.parameters.values, "FENCE_OPTIONS", 0) & _UNION_BIT)
    except VehicleError:
        return False


# Tables for people


def _print(book: Logbook, *, messages: bool) -> None:
    out = console()

    def show(line: str, title: str = "", style: str = "bold") -> None:
        out.print(
            cell("").append_text(cell(title, style)).append_text(cell(line)), soft_wrap=not out.is_terminal
        )

    show(f": {_length(book)}", title=book.name)
    if not book.damage.is_clean:
        show(f"Damage skipped: {book.damage}")
    if book.clock_jumps:
        show(
            f"The log's clock was set {counted(book.clock_jumps, 'time')} while it was written: rates are not accurate"
        )
    if book.clock_trouble:
        show(f"{book.clock_trouble}: times, rates and speeds below cannot be trusted")
    out.print(_senders(book))
    if messages:
        out.print(_messages(book))
    for vehicle in book.vehicles:
        out.print()
        show(f": {vehicle.driven_m:.1f} m driven", title=f"Vehicle {vehicle.system}")
        for table in _vehicle_tables(vehicle):
            out.print(table)
        for line in findings(vehicle):
            show(line)
        told, is_good = verdict(vehicle)
        show(
            f": {told}", title=f"Verdict on vehicle {vehicle.system}", style="bold" if is_good else "bold red"
        )


def _length(book: Logbook) -> str:
    begin = f" from {date_text(book.begins_s)}" if book.has_timestamps else ", raw (no timestamps)"
    return f"{_duration(book.duration_s)}{begin}, {book.damage.frames} messages"


def _senders(book: Logbook) -> Table:
    table = _table("Senders", "system", "component", "what", "types", "messages")
    vehicles = {(vehicle.system, vehicle.component): vehicle.mav_type for vehicle in book.vehicles}
    for sender, group in groupby(book.traffic, key=lambda traffic: (traffic.system, traffic.component)):
        rows = list(group)
        mav_type = vehicles.get(sender)
        what = "" if mav_type is None else _TYPES.get(mav_type, f"MAV_TYPE {mav_type}")
        _add(table, *map(str, sender), what, str(len(rows)), str(sum(row.count for row in rows)))
    return table


def _messages(book: Logbook) -> Table:
    table = _table("Messages", "system", "component", "type", "count", "rate (Hz)")
    for traffic in book.traffic:
        _add(
            table,
            str(traffic.system),
            str(traffic.component),
            traffic.name,
            str(traffic.count),
            f"{traffic.rate_hz:.2f}" if traffic.rate_hz else "",
        )
    return table


def _vehicle_tables(vehicle: VehicleLog) -> Iterable[Table]:
    if vehicle.transfers:
        table = _table("Lists transferred", "at (s)", "list", "way", "by", "items", "outcome")
        for transfer in _rows(table, vehicle.transfers):
            station = "?" if transfer.station is None else "/".join(map(str, transfer.station))
            announced = "?" if transfer.announced is None else transfer.announced
            result = f" ({transfer.result})" if transfer.result not in (None, "ACCEPTED") else ""
            _add(
                table,
                f"{transfer.begun_s:.1f}",
                str(transfer.kind),
                str(transfer.way),
                station,
                f"{transfer.seen} of {announced}",
                f"{transfer.ending}{result}",
            )
        yield table
    if vehicle.targets:
        table = _table(f"Targets ({vehicle.targets_seen})", "at (s)", "position", "by", "from")
        for target in _rows(table, vehicle.targets):
            source = target.source if target.said == 1 else f"{target.source}, {target.said} times"
            _add(
                table,
                f"{target.time_s:.1f}",
                str(target.position),
                source,
                "/".join(map(str, target.station)),
            )
        yield table
    if vehicle.modes:
        table = _table("Modes", "from (s)", "to (s)", "mode", "armed", "moved (m)")
        for span in _rows(table, vehicle.modes):
            armed = "yes" if span.armed else "no"
            _add(
                table, f"{span.begun_s:.1f}", f"{span.ended_s:.1f}", span.name, armed, f"{span.driven_m:.1f}"
            )
        yield table
    if vehicle.parameters.values:
        table = _table(
            f"Parameters that affect the drive (of {vehicle.parameters.seen})", "name", "value", "was"
        )
        before: dict[str, list[str]] = {}
        for change in vehicle.parameters.changes:
            before.setdefault(change.name, []).append(f"{change.before:g} until {change.time_s:.1f} s")
        for name, value in vehicle.parameters.values.items():
            _add(table, name, f"{value:g}", ", ".join(before.get(name, [])[-3:]))
        yield table


def _rows(table: Table, rows: Sequence[Row]) -> Sequence[Row]:
    """Return the rows of a table, the last ones where they are too many."""
    if len(rows) > _MOST_ROWS:
        table.caption = f"the last {_MOST_ROWS} of {len(rows)}; all with --json"
    return rows[-_MOST_ROWS:]


def _add(table: Table, *values: str) -> None:
    table.add_row(*map(cell, values))


def _table(title: str, *columns: str) -> Table:
    table = Table(title=title, title_justify="left", box=SIMPLE_HEAD, pad_edge=False)
    for column in columns:
        is_number = column.endswith(")") or column in ("count", "types", "messages", "system", "component")
        table.add_column(column, justify="right" if is_number else "left", overflow="fold")
    return table


def _duration(duration_s: float) -> str:
    if duration_s < 120:
        return f"{duration_s:.1f} s"
    minutes, seconds = divmod(round(duration_s), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours} h {minutes:02} min {seconds:02} s" if hours else f"{minutes} min {seconds:02} s"


_TYPES = {
    1: "fixed wing",
    2: "quadrotor",
    10: "rover",
    11: "boat",
    12: "submarine",
}
