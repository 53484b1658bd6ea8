"""``pbpp check`` of many missions, for people, for scripts, for code hosts (SARIF) and build servers (JUnit)."""

from __future__ import annotations

import contextvars
from collections import Counter
from collections.abc import Generator, Mapping
from contextlib import closing
from dataclasses import dataclass, field, replace
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from mavlink_bridge.cli.checked_mission import checked_of, document_of
from mavlink_bridge.cli.drawing import progress_bar
from mavlink_bridge.cli.failing import (
    ExitCode,
    Level,
    begin_telling,
    error_line,
    error_name,
    exit_code_of,
    telling,
)
from mavlink_bridge.cli.task_files import as_asked, files_of
from mavlink_bridge.cli.terminal import echo, print_json_list, print_text, say
from mavlink_bridge.cli.values import given_places
from mavlink_bridge.cli.vehicle_options import described_vehicle, with_vehicle
from mavlink_bridge.errors import UsageError
from mavlink_bridge.many import Task, open_workers
from missions.checking.findings import Report, Rule, report_of, report_of_error
from missions.checking.junit import junit_lines
from missions.checking.sarif import sarif_lines
from missions.formats.item_lines import item_lines
from missions.request import GoTo
from missions.words import counted

if TYPE_CHECKING:
    from mavlink_bridge.cli.checked_mission import CheckedMission
    from mavlink_bridge.cli.drawing import Shown
    from mavlink_bridge.cli.options.check import CheckOptions

_WORDS = {
    Rule.NOT_UNDERSTOOD: "not understood: ",
    Rule.DANGER: "DANGER: ",
    Rule.NOT_CONFIRMED: "NOT CONFIRMED: ",
    Rule.UNUSABLE: "error: ",
    Rule.REMARK: "warning: ",
    Rule.CROSSES: "FAIL: ",
    Rule.CLEARANCE: "FAIL: ",
    Rule.WAY_HOME: "FAIL: ",
}
_ONE = ("log", "connect", "start", "plot")
"""Options that belong to one mission."""


@dataclass(frozen=True, slots=True)
class AskedCheck:
    """What is asked of one mission: the command's options, and the files that it reads, as they are named there."""

    options: CheckOptions
    files: tuple[Path, ...]


@dataclass(frozen=True, slots=True)
class CheckedFile:
    """What came of one mission's file: its report, how the command ends by it, and its document where that is wanted."""

    report: Report
    code: ExitCode
    passed: str = ""
    document: Mapping[str, object] = field(default_factory=dict)


def check_many(options: CheckOptions) -> None:
    """Check each mission; one that cannot be read or checked stops no other."""
    missions = [*([options.mission] if options.mission is not None else []), *options.missions]
    _check_options(options, missions)
    codes: Counter[ExitCode] = Counter()
    quiet = options.is_silent or options.format is not None
    with progress_bar(quiet=quiet) as show, closing(_results(options, missions, codes, show)) as results:
        if options.format == "sarif":
            print_text(sarif_lines((one.report for one in results), version("pbpp-rover")))
        elif options.format == "junit":
            print_text(junit_lines(one.report for one in results))
        elif options.json_output:
            documents = (one.document for one in results)
            print_json_list({"command": "check"}, "missions", documents, lambda: _summary(codes))
        else:
            for one in results:
                _report(one, is_quiet=options.quiet > 0)
    if not quiet:
        _report_counts(codes)
    raise typer.Exit(_exit_code(codes))


def check_task(task: Task[AskedCheck]) -> CheckedFile:
    """Check one mission, on a worker: nothing is printed there."""
    places = dict(zip(task.asked.files, task.files, strict=True))
    asked = task.asked.options
    assert asked.mission is not None
    options = replace(
        asked,
        mission=places[asked.mission],
        fence=None if asked.fence is None else places[asked.fence],
        vehicle=None if asked.vehicle is None else places[asked.vehicle],
    )
    found = contextvars.copy_context().run(_in_silence, options)
    found = replace(found, warnings=as_asked(found.warnings, places))
    checked, file = found.checked, str(asked.mission)
    return CheckedFile(
        report_of(file, checked, found.warnings, item_lines(places[asked.mission])),
        ExitCode.DONE if checked.is_promised else ExitCode.CHECK,
        f"every leg keeps {checked.clearance_m:g} m while driving" if checked.is_promised else "",
        {"mission": file, **document_of(found)} if asked.json_output else {},
    )


def _in_silence(options: CheckOptions) -> CheckedMission:
    begin_telling("check", quiet=2)
    return checked_of(options)


def _check_options(options: CheckOptions, missions: list[Path]) -> None:
    """Find what would be wrong with each mission, before any is checked."""
    if not missions:
        raise UsageError("give missions: FILE..., or --mission FILE")
    for name in _ONE:
        if getattr(options, name):
            raise UsageError(
                f"--{name} is for one mission, without --format and --cluster: pbpp check --mission FILE"
            )
    if options.format not in (None, "sarif", "junit"):
        raise UsageError(f"--format {options.format!r}: expected one of sarif, junit")
    if options.json_output and options.format is not None:
        raise UsageError("--json and --format both write to standard output; give one of them")
    with_vehicle(GoTo(clearance_m=options.clearance), options)
    given_places(options.place)
    described_vehicle(options)


def _results(
    options: CheckOptions, missions: list[Path], codes: Counter[ExitCode], show: Shown
) -> Generator[CheckedFile, None, None]:
    """Return what comes of each mission, in the order given; count how they end."""
    tasks = (_task(replace(options, mission=mission, missions=[])) for mission in missions)
    with open_workers(options.jobs, options.cluster, most=len(missions)) as workers:
        for done in workers.results(check_task, tasks):
            mission = missions[done.number]
            show(mission.name, done.number + 1, len(missions))
            found = done.result() if done.error is None else _failed(mission, done.error)
            codes[found.code] += 1
            yield found


def _task(options: CheckOptions) -> Task[AskedCheck]:
    files = files_of(options.mission, options.fence, options.vehicle)
    return Task(AskedCheck(options, files), files)


def _failed(mission: Path, error: Exception) -> CheckedFile:
    report, code = report_of_error(str(mission), error_line(error), error), exit_code_of(error)
    document = {
        "mission": str(mission),
        "status": "error",
        "error": error_name(error),
        "message": error_line(error),
        "exit_code": int(code),
    }
    return CheckedFile(report, code, document=document)


def _report(one: CheckedFile, *, is_quiet: bool) -> None:
    report = one.report
    for finding in report.findings:
        line = f"{report.file}:{finding.line}: {_WORDS[finding.rule]}{finding.message}"
        if finding.fails:
            echo(line, typer.colors.RED)
        elif telling().prints(Level.WARNING):
            say(line, typer.colors.YELLOW)
    if one.passed and not is_quiet:
        echo(f"{report.file}: PASS: {one.passed}")


def _report_counts(codes: Counter[ExitCode]) -> None:
    count, passed, failed = codes.total(), codes[ExitCode.DONE], codes[ExitCode.CHECK]
    unusable = count - passed - failed
    rest = f", {unusable} could not be checked" if unusable else ""
    echo(f"{counted(count, 'mission')}: {passed} passed, {failed} failed{rest}")


def _summary(codes: Counter[ExitCode]) -> dict[str, object]:
    code = _exit_code(codes)
    return {
        "status": "ok" if code is ExitCode.DONE else "failed" if code is ExitCode.CHECK else "error",
        "exit_code": int(code),
        "passed": codes[ExitCode.DONE],
        "failed": codes[ExitCode.CHECK],
        "unusable": codes.total() - codes[ExitCode.DONE] - codes[ExitCode.CHECK],
    }


def _exit_code(codes: Counter[ExitCode]) -> ExitCode:
    """Return how the command ends: by a mission that fails, else by what hindered one from being checked."""
    if codes[ExitCode.CHECK]:
        return ExitCode.CHECK
    return min((code for code in codes if code is not ExitCode.DONE), default=ExitCode.DONE)
