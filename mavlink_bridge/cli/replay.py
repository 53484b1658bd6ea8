"""``pbpp replay``: the bridge's director over recorded logs, and its events compared with what was expected."""

from __future__ import annotations

import difflib
import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from mavlink_bridge.cli.common import (
    AnyVehicleOption,
    ExitCode,
    JsonOption,
    QuietOption,
    SystemOption,
    print_json,
)
from mavlink_bridge.cli.plan import request_from_options
from mavlink_bridge.errors import LogError

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from mavlink_bridge.director import Event, Orders

_TIME_TOLERANCE_S = 1e-3


def replay(
    logs: Annotated[list[Path], typer.Argument(metavar="LOG...", help="Recorded telemetry logs (.tlog).")],
    expect: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE", help="JSON lines of the events that are expected; exit 8 if others come."
        ),
    ] = None,
    clearance: Annotated[str | None, typer.Option(metavar="M|max", help="As for plan.")] = None,
    corner_allowance: Annotated[str, typer.Option(metavar="M|auto", help="As for plan.")] = "auto",
    system: SystemOption = None,
    any_vehicle: AnyVehicleOption = False,
    json_output: JsonOption = False,
    quiet: QuietOption = False,
) -> None:
    """Run the bridge's director over recorded logs, in their own time: what it saw, what it would have planned.

    A log that `pbpp bridge --log` recorded is replayed with its journal: the same decisions come again. Over other logs the director only listens.

    Examples:
    `pbpp replay sitl_logs/guided-maze.tlog`

    `pbpp replay run.tlog --json > run.events; pbpp replay run.tlog --expect run.events`
    """
    from mavlink_bridge.director import Orders, TargetSource  # noqa: PLC0415 - quick help

    sources = frozenset(TargetSource) - {TargetSource.ECHO, TargetSource.RALLY}
    orders = Orders(
        system=system,
        any_vehicle=any_vehicle,
        request=request_from_options(None, [], clearance, corner_allowance, 0.0, "optimal"),
        target_sources=sources,
    )
    told = []
    for log in logs:
        for event in events_of(log, orders):
            document = {"log": log.name, **event.as_json()}
            told.append(document)
            if json_output:
                print_json(document)
            elif not quiet:
                prefix = f"{log.name}: " if len(logs) > 1 else ""
                typer.echo(f"{prefix}{event.time_s:.2f} {event.name}: {event.text}")
    if expect is not None:
        differences = _differences(_expected(expect), told)
        for line in differences:
            typer.secho(line, err=True)
        if differences:
            raise typer.Exit(ExitCode.CHECK)


def events_of(log: Path, orders: Orders) -> Iterator[Event]:
    """Give the director's events over a log; with its journal where there is one."""
    from mavlink_bridge.journal import journal_path, read_journal  # noqa: PLC0415 - quick help
    from mavlink_bridge.replay import replay_foreign, replay_recorded  # noqa: PLC0415
    from mavlink_bridge.tlog import TlogReader  # noqa: PLC0415

    journal = journal_path(log)
    if journal.exists():
        return replay_recorded(TlogReader(log), read_journal(journal))
    return replay_foreign(TlogReader(log), orders)


def _expected(path: Path) -> list[dict[str, Any]]:
    try:
        return [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines() if line.strip()]
    except OSError as error:
        raise LogError(f"{path} cannot be read: {error.strerror}") from None
    except ValueError as error:
        raise LogError(f"{path}: not JSON lines: {error}") from None


def _differences(expected: Sequence[dict[str, Any]], told: Sequence[dict[str, Any]]) -> list[str]:
    """Compare events; times may differ by a millisecond."""
    before, after = _lines(expected, told), _lines(told, expected)
    return list(difflib.unified_diff(before, after, "expected", "told", lineterm="", n=1))


def _lines(events: Sequence[dict[str, Any]], others: Sequence[dict[str, Any]]) -> list[str]:
    """Give each event as a line, its time as the other side's where the two are as good as the same."""
    lines = []
    for index, event in enumerate(events):
        times_s = [event.get("time_s"), others[index].get("time_s") if index < len(others) else None]
        numbers = [time_s for time_s in times_s if isinstance(time_s, (int, float))]
        is_near = len(numbers) == 2 and abs(numbers[0] - numbers[1]) <= _TIME_TOLERANCE_S + 1e-9
        lines.append(json.dumps({**event, "time_s": min(numbers) if is_near else times_s[0]}, sort_keys=True))
    return lines
