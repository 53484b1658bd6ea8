"""``pbpp plan --batch``: a plan for each row of a table, and what came of each as JSON lines or Parquet."""

from __future__ import annotations

import contextvars
import sys
import tempfile
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, TextIO

import typer

from mavlink_bridge.cli.batch_rows import options_of, read_rows
from mavlink_bridge.cli.drawing import progress_bar
from mavlink_bridge.cli.failing import ExitCode, begin_telling, error_line, error_name, exit_code_of
from mavlink_bridge.cli.kept_files import make_room, remember, write_kept
from mavlink_bridge.cli.plan_request import plan_request
from mavlink_bridge.cli.plan_results import plan_document
from mavlink_bridge.cli.plan_source import offline_situation
from mavlink_bridge.cli.task_files import as_asked, files_of
from mavlink_bridge.cli.terminal import echo, json_line, print_json, say
from mavlink_bridge.cli.timed_plan import timed_plan
from mavlink_bridge.dataset.plan_table import check_installed, write_parquet
from mavlink_bridge.errors import UsageError
from mavlink_bridge.many import Task, open_workers
from missions.errors import MissionFormatError
from missions.formats import check_writable_format
from missions.words import counted

if TYPE_CHECKING:
    from mavlink_bridge.cli.batch_rows import Row, RowError
    from mavlink_bridge.cli.options.plan import PlanOptions

_ALONE = (
    "log", "connect", "plot", "upload", "drive", "hold", "via_mission", "place", "json_output", "blocks",
)  # fmt: skip
"""Options that belong to one plan."""

_SUFFIXES = (".jsonl", ".parquet")


@dataclass(frozen=True, slots=True)
class AskedPlan:
    """What one row asks: the row (or why it asks nothing), the command's options, the table's folder, and the files that are read, as they are named there."""

    number: int
    row: Row | RowError
    options: PlanOptions
    folder: Path
    files: tuple[Path, ...]


@dataclass(frozen=True, slots=True)
class Planned:
    """A row's plan as a document, and the files of its mission, which are written where the command runs."""

    document: Mapping[str, object]
    outputs: tuple[tuple[Path, bytes], ...]


def plan_batch(options: PlanOptions, table: Path) -> None:
    """Make each row's plan; a row that has none stops no other.

    Raises
    ------
    UsageError
        An option does not go with a table, or the table has a column that rows do not have.
    MissionFormatError
        The table cannot be read, or the results not be written.
    """
    _check_options(options, table)
    codes: Counter[ExitCode] = Counter()
    with ExitStack() as stack:
        put = [stack.enter_context(_results_file(path)) for path in options.output] or [print_json]
        show = stack.enter_context(progress_bar(quiet=options.is_silent))
        for document in _documents(options, table, codes):
            show(str(document["name"] or f"row {document['row']}"), codes.total(), 0)
            for one in put:
                one(document)
            sys.stdout.flush()
    if not options.is_silent:
        tell = echo if options.output else say
        failed = codes.total() - codes[ExitCode.DONE]
        tell(
            f"{counted(codes.total(), 'row')}: {counted(codes[ExitCode.DONE], 'plan')}, {failed} without one"
        )
        for path in options.output:
            tell(f"Wrote {path}")
    raise typer.Exit(min((code for code in codes if code is not ExitCode.DONE), default=ExitCode.DONE))


def plan_task(task: Task[AskedPlan]) -> Planned:
    """Make one row's plan, on a worker: nothing is printed or written there."""
    asked = task.asked
    if isinstance(asked.row, Exception):
        raise asked.row
    places = dict(zip(asked.files, task.files, strict=True))
    options = options_of(asked.row, asked.options, asked.folder)
    if options.fence is None:
        raise UsageError("no fence: give one in the row, or --fence FILE for all rows")
    here = replace(
        options,
        fence=places[options.fence],
        vehicle=None if options.vehicle is None else places[options.vehicle],
    )
    document, outputs = contextvars.copy_context().run(_in_silence, here)
    return Planned(as_asked(document, places), outputs)


def _in_silence(options: PlanOptions) -> tuple[dict[str, object], tuple[tuple[Path, bytes], ...]]:
    begin_telling("plan", quiet=2)
    request = plan_request(options)
    situation, _ = offline_situation(options, request)
    planned, planning_s = timed_plan(situation, request)
    written: list[tuple[Path, bytes]] = []
    for path in options.output:
        check_writable_format(path)
        planned.write(path, situation, write=lambda at, data: written.append((at, data)))
    document = plan_document(planned)
    warnings = [*situation.remarks, *planned.warnings]
    return {**document, "warnings": warnings, "planning_s": round(planning_s, 6)}, tuple(written)


def _check_options(options: PlanOptions, table: Path) -> None:
    """Find what cannot work before any work is done."""
    for name in _ALONE:
        if getattr(options, name):
            option = {"json_output": "json"}.get(name, name).replace("_", "-")
            raise UsageError(f"--{option} does not go with --batch")
    for path in options.output:
        if path.suffix.lower() not in _SUFFIXES:
            raise UsageError(
                f"-o {path}: with --batch results are written to .jsonl or .parquet; missions by the column output"
            )
        if not path.parent.is_dir():
            raise MissionFormatError(
                f"{path} cannot be written: there is no folder {path.parent}", file=str(path)
            )
    for path in (table, *options.output):
        if path.suffix.lower() == ".parquet":
            check_installed(path)
    plan_request(options)


def _documents(options: PlanOptions, table: Path, codes: Counter[ExitCode]) -> Iterator[dict[str, object]]:
    """Return what comes of each row, in the table's order; count how they end."""
    tasks = (
        _task(number, row, options, table.parent) for number, row in enumerate(read_rows(table), start=1)
    )
    with open_workers(options.jobs, options.cluster) as workers:
        for done in workers.results(plan_task, tasks):
            asked = done.task.asked
            document: dict[str, object] = {
                "row": asked.number,
                "name": None if isinstance(asked.row, Exception) else asked.row.get("name"),
                "fence_file": _named(asked, "fence"),
                "vehicle_file": _named(asked, "vehicle"),
            }
            error = done.error
            if error is None:
                planned = done.result()
                try:
                    for path, data in planned.outputs:
                        write_kept(path, data)
                except MissionFormatError as unwritable:
                    error = unwritable
                document |= {
                    **planned.document,
                    "exit_code": 0,
                    "outputs": [str(path) for path, _ in planned.outputs],
                }
            if error is not None:
                code = exit_code_of(error)
                document |= {"status": "error", "error": error_name(error), "message": error_line(error)}
                document |= {"exit_code": int(code), "details": getattr(error, "details", {})}
            else:
                code = ExitCode.DONE
            codes[code] += 1
            yield document


def _named(asked: AskedPlan, column: str) -> str | None:
    said = None if isinstance(asked.row, Exception) else asked.row.get(column)
    value = said or getattr(asked.options, column)
    return None if value is None else str(value)


def _task(number: int, row: Row | RowError, options: PlanOptions, folder: Path) -> Task[AskedPlan]:
    files: tuple[Path, ...] = ()
    with suppress(UsageError):  # which the task itself will raise
        if not isinstance(row, Exception):
            mine = options_of(row, options, folder)
            files = files_of(mine.fence, mine.vehicle)
    return Task(AskedPlan(number, row, replace(options, output=[]), folder, files), files)


@contextmanager
def _results_file(path: Path) -> Iterator[Callable[[Mapping[str, object]], None]]:
    """Yield what puts a result into a file, which is there, whole, once all are: a run that ends early leaves none, and what was there before."""
    with tempfile.TemporaryDirectory(prefix=".pbpp-", dir=path.parent) as folder:
        lines = Path(folder) / "results.jsonl"
        with lines.open("w", encoding="ascii", newline="\n") as file:
            yield lambda document: _put(file, document)
        whole = lines
        if path.suffix.lower() == ".parquet":
            whole = Path(folder) / "results.parquet"
            write_parquet(lines, whole)
        make_room(path)
        whole.replace(path)
        remember(path)


def _put(file: TextIO, document: Mapping[str, object]) -> None:
    file.write(f"{json_line(document)}\n")
