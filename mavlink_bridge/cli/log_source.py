"""A situation from a recorded log, for commands that otherwise need no pymavlink."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from mavlink_bridge.cli.common import warn
from mavlink_bridge.cli.log_times import log_begin
from mavlink_bridge.errors import LogError
from mavlink_bridge.logbook.log_situation import situation_from_log
from missions.items import last_place
from missions.vehicle import known_ardupilot
from missions.words import counted, mission_items

if TYPE_CHECKING:
    from pathlib import Path

    from mavlink_bridge.cli.options.shared import LinkOptions
    from missions.request import Request
    from missions.situation import Known, Situation


def situation_of(log: Path, options: LinkOptions, *, drives_its_items: bool) -> Situation:
    """Return what a log tells of the vehicle that the options choose.

    Raises
    ------
    LogError
        The log cannot be used; or its own mission counts, and another autopilot than ArduPilot drives it: how was not measured.
    """
    situation = situation_from_log(
        log,
        options.system,
        any_vehicle=options.any_vehicle,
        on_damage=lambda damage: warn([f"{log}: {damage}"]),
    )
    if drives_its_items and situation.ardupilot is False:
        raise LogError(
            f"{log}: the autopilot of system {situation.system} is not ArduPilot: its mission in a log is not used; give it as a file (--mission)",
            file=str(log),
        )
    return situation


def taken_info(log: Path, situation: Situation, request: Request) -> list[str]:
    """Return which start, target or mission, and fence a plan takes from a log, from what and when; what options give is not said."""
    begin_s = log_begin(log).time_s

    def told(what: str, known: Known[Any]) -> str:
        at = f" at {known.time_s - begin_s:.1f} s" if known.time_s is not None else ""
        return f"{what} ({known.source}{at})"

    taken = []
    if request.start is None and situation.pose is not None:
        taken.append(told(f"start {situation.pose.value.position}", situation.pose))
    elif request.start is None and situation.home is not None:
        taken.append(told(f"start {situation.home.value}", situation.home))
    if request.repairs:
        if situation.mission is not None:
            has_home = known_ardupilot(situation) is not False
            count = situation.mission.value.item_count(has_home=has_home)
            taken.append(told(mission_items(count, has_home=has_home), situation.mission))
    elif not request.targets and situation.target is not None:
        taken.append(told(f"target {situation.target.value}", situation.target))
    elif not request.targets and situation.mission is not None:
        place = last_place(situation.mission.value.items)
        taken.append(told(f"target {place}, the end of the mission", situation.mission))
    if situation.fence is not None:
        zones = counted(len(situation.fence.value.zones), "zone")
        taken.append(told(f"fence of {zones}", situation.fence))
    return [f"taken from {log.name}: {', '.join(taken)}"] if taken else []
