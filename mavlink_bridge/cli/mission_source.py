"""Where a mission and its field come from: files, a log or a live vehicle, alike for commands that look at a mission as it is."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from mavlink_bridge.cli.field_files import read_fence_file, read_file, with_mission_home
from mavlink_bridge.cli.values import position_from
from mavlink_bridge.cli.vehicle_options import described_vehicle, with_description, with_home_option
from mavlink_bridge.errors import UsageError
from missions.formats import mission_of
from missions.situation import Situation

if TYPE_CHECKING:
    from mavlink_bridge.cli.options.check import CheckOptions
    from mavlink_bridge.cli.options.plan import PlanOptions
    from mavlink_bridge.cli.options.rally import RallyOptions
    from mavlink_bridge.console.view.fields import Where
    from missions.geo import LatLon

    MissionOptions = CheckOptions | RallyOptions


def check_source(options: MissionOptions) -> None:
    """Find what cannot work before any work is done.

    Raises
    ------
    UsageError
        No mission is named, or two sources are.
    """
    if options.mission is None and options.log is None and options.connect is None:
        raise UsageError("give a mission: --mission FILE, --log FILE.tlog or --connect CONNECTION")
    if options.log is not None and options.connect is not None:
        raise UsageError("give one of --log and --connect")
    if options.home is not None and options.connect is not None:
        raise UsageError("--home goes with files and logs: a live vehicle reports its own home")


def source_kind(options: MissionOptions | PlanOptions) -> Where:
    """Return where the field comes from."""
    return "vehicle" if options.connect is not None else "log" if options.log is not None else "file"


def mission_situation(options: MissionOptions) -> tuple[Situation, list[str]]:
    """Return what is known from files, a log or a link, a mission included, and what the vehicle did not report.

    Raises
    ------
    UsageError
        There is no mission.
    MissionError, BridgeError
        What cannot be read.
    """
    situation: Situation | None = None
    unknown: list[str] = []
    if options.log is not None:
        from mavlink_bridge.cli.log_source import situation_of  # noqa: PLC0415 - pymavlink only for logs

        situation = situation_of(options.log, options, drives_its_items=True)
    elif options.connect is not None:
        from mavlink_bridge.cli.check_on_link import live_situation  # noqa: PLC0415 - and for links

        situation, unknown = live_situation(options, options.connect)
    situation = _with_files(situation, options)
    situation = with_description(situation, described_vehicle(options))
    if situation.mission is None:
        raise UsageError(f"{options.log or options.connect} contains no mission; give one (--mission FILE)")
    return with_home_option(situation, options.home), unknown


def start_of(options: MissionOptions, situation: Situation) -> LatLon | None:
    """Return where the mission is to begin; None leaves it to what is known of the vehicle."""
    if options.start is not None:
        return position_from("--start", options.start)
    if options.log is not None and situation.home is not None:
        return situation.home.value  # at a log's end the vehicle may stand anywhere on its way
    return None


def _with_files(source: Situation | None, options: MissionOptions) -> Situation:
    """Put what files hold in the place of what the log or the link reported."""
    found = source or Situation()
    if options.fence is not None:
        told = read_fence_file(options.fence, options)
        found = replace(
            found,
            fence=told.fence,
            home=found.home or told.home,
            reading=replace(
                found.reading,
                fence_trouble=None,
                transfers={},
                remarks=told.remarks,
                made_for=told.reading.made_for,
            ),
        )
    if options.mission is not None:
        told = read_file(options.mission, options, by_name=options.fence is None)
        drawn = mission_of(told, options.mission)
        found = replace(
            found,
            mission=told.mission,
            fence=told.fence if options.fence is None and told.fence else found.fence,
            rally=found.rally or told.rally,
            reading=replace(
                found.reading,
                remarks=(*found.remarks, *told.remarks),
                made_for=told.reading.made_for
                or found.reading.made_for,  # the mission's file says what drives it
            ),
        )
        if source is None:
            found = with_mission_home(found, drawn, str(options.mission))
    return found
