"""``pbpp plan``: plan a mission from a fence file, a log or a live vehicle; write it, draw it, upload it."""

from __future__ import annotations

from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

from mavlink_bridge.cli.common import is_same_file
from mavlink_bridge.cli.mission_source import source_kind
from mavlink_bridge.cli.permissions import check_permissions
from mavlink_bridge.cli.pictures import check_plots
from mavlink_bridge.cli.plan_request import plan_request
from mavlink_bridge.cli.plan_results import Told, arrival_document, report_end
from mavlink_bridge.cli.plan_source import offline_situation
from mavlink_bridge.cli.planning_progress import planning_shown
from mavlink_bridge.cli.terminal import print_json
from mavlink_bridge.cli.timed_plan import timed_plan
from mavlink_bridge.cli.values import given_places
from mavlink_bridge.errors import UsageError
from missions.errors import MissionFormatError
from missions.formats import check_writable_format

if TYPE_CHECKING:
    from mavlink_bridge.cli.options.plan import PlanOptions


def plan(options: PlanOptions) -> None:
    """Plan, and do with the plan what the options ask for."""
    if options.batch is not None:
        import_module("mavlink_bridge.cli.plan_batch").plan_batch(
            options, options.batch
        )  # one plan needs it not
        return
    if options.jobs is not None or options.cluster is not None:
        raise UsageError("--jobs and --cluster go with --batch: one plan is made here")
    check_permissions(upload=options.upload, drive=options.drive, hold=options.hold)
    request = plan_request(options)
    _check_options(options)
    told = Told(
        options.output,
        options.plot,
        given_places(options.place) if options.json_output or options.plot or options.place else None,
        asked=(request, source_kind(options)),
        blocks=options.blocks,
        is_silent=options.is_silent,
        drives=options.drive,
    )
    verified, arrival, backup = False, None, None
    if options.connect is not None:
        from mavlink_bridge.cli.plan_on_link import plan_on_link  # noqa: PLC0415 - pymavlink only with a link

        result = plan_on_link(options, request, told)
        situation, verified, arrival = result.situation, result.verified, result.arrival
        backup = result.backup
    else:
        situation, taken = offline_situation(options, request)
        with planning_shown(request, quiet=options.is_silent) as should_stop:
            made = timed_plan(situation, request, should_stop=should_stop)
        told.tell(*made, situation, taken)
    document = {
        **told.document(),
        "source": options.connect or Path(str(options.fence or options.log)).name,
        "system": situation.system,
        "uploaded": verified,
        "verified": verified,
        "backup": str(backup) if backup else None,
        **arrival_document(arrival),
    }
    if options.json_output:
        print_json(document)
    elif not options.quiet:
        report_end(arrival, backup, verified=verified)


def _check_options(options: PlanOptions) -> None:
    """Find what cannot work before any work is done."""
    fence, outputs, plots = options.fence, options.output, options.plot
    if [fence, options.log, options.connect].count(None) != 2:
        raise UsageError("give one SOURCE: --fence FILE, --log FILE.tlog or --connect CONNECTION")
    if options.upload and options.connect is None:
        raise UsageError("--upload needs a live link: --connect CONNECTION")
    for path in outputs:
        check_writable_format(path)
        if path.suffix.lower() != ".plan" and fence is not None and is_same_file(path, fence):
            raise UsageError(f"-o {path} would overwrite the fence with a mission")
    for path in (*outputs, *plots):
        if not path.parent.is_dir():
            raise MissionFormatError(
                f"{path} cannot be written: there is no folder {path.parent}",
                advice=f"create {path.parent} first, or choose another folder",
            )
    if options.obstacle and options.connect is not None:
        raise UsageError(
            "--obstacle goes with --fence and --log: on a link pbpp bridge --obstacles-from plans round obstacles"
        )
    if options.home is not None and options.connect is not None:
        raise UsageError("--home goes with --fence and --log: a live vehicle reports its own home")
    check_plots(plots, json_output=options.json_output)
