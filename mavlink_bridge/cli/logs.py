"""``pbpp logs``: tables of many logs, questions to them, and one rover's calibration."""

from __future__ import annotations

import csv
import datetime as dt
import io
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.box import SIMPLE_HEAD
from rich.table import Table

from mavlink_bridge.cli.common import warn
from mavlink_bridge.cli.drawing import build_bar, cell, console
from mavlink_bridge.cli.kept_files import write_kept
from mavlink_bridge.cli.options.logs import ACTIONS
from mavlink_bridge.cli.terminal import echo, print_json
from mavlink_bridge.dataset.build import Progress, build, log_files
from mavlink_bridge.dataset.calibrate import calibrate, calibration_text
from mavlink_bridge.dataset.questions import QUESTIONS, AnswerRows, as_json, ask, ask_sql, chart
from mavlink_bridge.dataset.store import Dataset
from mavlink_bridge.errors import UsageError
from mavlink_bridge.many import open_workers
from missions.picture.charts import check_chart_formats
from missions.words import counted

if TYPE_CHECKING:
    from collections.abc import Iterator

    from mavlink_bridge.cli.options.logs import LogsOptions

_MOST_ROWS = 60  # of an answer on a terminal; chosen
_MOST_BAD = 20  # bad logs named one by one; chosen


def logs(options: LogsOptions) -> None:
    """Build a dataset, ask it, or calibrate a rover."""
    if options.action not in ACTIONS:
        raise UsageError(f"{options.action!r} is not an action; expected one of {', '.join(ACTIONS)}")
    _check_options(options)
    {"build": _build, "ask": _ask, "calibrate": _calibrate}[options.action](options)


_OPTIONS_OF = {
    "jobs": "build",
    "cluster": "build",
    "sql": "ask",
    "promise": "ask",
    "csv": "ask",
    "plot": "ask",
    "system": "calibrate",
}


def _check_options(options: LogsOptions) -> None:
    for name, action in _OPTIONS_OF.items():
        if getattr(options, name) not in (None, []) and action != options.action:
            raise UsageError(f"--{name} is for `pbpp logs {action}`, not for `pbpp logs {options.action}`")
    if options.action == "ask":
        if options.output is not None:
            raise UsageError("-o is for `pbpp logs build` and `calibrate`; `ask` writes with --csv or --plot")
    elif options.output is None:
        what = "-o DATASET" if options.action == "build" else "-o FILE.toml"
        raise UsageError(f"`pbpp logs {options.action}` needs {what}")


# Build


def _build(options: LogsOptions) -> None:
    assert options.output is not None
    dataset = Dataset(options.output)
    paths = log_files(map(Path, options.words))
    with (
        open_workers(options.jobs, options.cluster, most=len(paths)) as workers,
        build_bar(quiet=options.is_silent) as show,
    ):
        progress = build(dataset, paths, workers, show)
    if options.json_output:
        print_json(
            {
                "status": "ok",
                "command": "logs",
                "dataset": str(options.output),
                "files": progress.files,
                "known": progress.known,
                "read": progress.read,
                "bad": [{"file": path, "reason": reason} for path, reason in progress.bad],
            }
        )
        return
    warn(_bad_lines(progress))
    if not progress.files:
        warn(
            ("no log was found: folders are searched for .tlog, .raw and .bin; name other files one by one",)
        )
    if not options.quiet:
        echo(
            f"{options.output}: {counted(progress.files, 'file')}, {progress.read} read now, {progress.known} known before, "
            f"{len(progress.bad)} unusable"
        )


def _bad_lines(progress: Progress) -> Iterator[str]:
    for path, reason in progress.bad[:_MOST_BAD]:
        yield reason if reason.startswith(path) else f"{path}: {reason}"
    if len(progress.bad) > _MOST_BAD:
        yield f"and {len(progress.bad) - _MOST_BAD} more unusable logs: see the table `logs`, or --json"


# Ask


def _ask(options: LogsOptions) -> None:
    folder, *names = options.words
    if bool(names) == (options.sql is not None) or len(names) > 1:
        raise UsageError(f"ask one question ({', '.join(QUESTIONS)}) or give --sql")
    if names and names[0] not in QUESTIONS:
        raise UsageError(f"{names[0]!r} is not a question; expected one of {', '.join(QUESTIONS)}, or --sql")
    if options.plot and not names:
        raise UsageError("--plot draws the answer to a ready question, not to --sql")
    if options.promise is not None and names != ["promise"]:
        raise UsageError("--promise belongs to the question `promise`")
    check_chart_formats(options.plot)
    dataset = Dataset(Path(folder))
    question = QUESTIONS[names[0]] if names else None
    if question is not None:
        answer = ask(dataset, question, options.promise)
    else:
        answer = ask_sql(dataset, options.sql or "")
    if options.csv is not None:
        write_kept(options.csv, _as_csv(answer))
    if question is not None and options.plot:
        image = import_module("missions.picture.chart_figure").chart_image
        for path in options.plot:
            write_kept(path, image(chart(question, answer), path.suffix))
    if options.json_output:
        print_json(
            {
                "status": "ok",
                "command": "logs",
                "question": names[0] if names else None,
                "columns": list(answer.columns),
                "rows": as_json(answer),
            }
        )
    elif not options.quiet:
        _print(answer, question.about if question else "")


def _as_csv(answer: AnswerRows) -> bytes:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(answer.columns)
    for row in as_json(answer):
        writer.writerow(["" if value is None else value for value in row.values()])
    return text.getvalue().encode()


def _print(answer: AnswerRows, title: str) -> None:
    table = Table(title=title or None, title_justify="left", box=SIMPLE_HEAD, pad_edge=False)
    rows = as_json(answer)
    for name in answer.columns:
        is_number = any(isinstance(row[name], (int, float)) for row in rows)
        heading = cell(name.replace("_", " "))  # so that a narrow terminal breaks it between words
        table.add_column(heading, justify="right" if is_number else "left", overflow="fold")
    for row in answer.rows[:_MOST_ROWS]:
        table.add_row(*map(cell, map(_shown, row)))
    if len(rows) > _MOST_ROWS:
        table.caption = f"the first {_MOST_ROWS} of {len(rows)}; all with --json or --csv"
    console().print(table)


def _shown(value: Any) -> str:  # noqa: ANN401 - whatever a database holds
    if value is None:
        return ""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, dt.datetime):
        return f"{value.isoformat(' ', 'seconds')}{'' if value.tzinfo else 'Z'}"
    return f"{value:.6g}" if isinstance(value, float) else str(value)


# Calibrate


def _calibrate(options: LogsOptions) -> None:
    assert options.output is not None
    if len(options.words) != 1:
        raise UsageError("calibrate takes one DATASET")
    found = calibrate(Dataset(Path(options.words[0])), options.system)
    text = calibration_text(found)
    write_kept(options.output, text.encode())
    calibration = found.calibration
    if options.json_output:
        print_json(
            {
                "status": "ok",
                "command": "logs",
                "file": str(options.output),
                "drives": calibration.drives,
                "corners": sum(one.corners for one in calibration.corners),
                "legs": sum(one.legs for one in calibration.legs),
                "remarks": list(found.remarks),
            }
        )
        return
    warn(found.remarks)
    if not options.quiet:
        echo(
            f"Wrote {options.output}: vehicle {found.system}, {counted(calibration.drives, 'drive')}, "
            f"{counted(sum(one.corners for one in calibration.corners), 'corner')}"
        )
