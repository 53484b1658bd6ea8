"""A situation from a recorded log, for commands that otherwise need no pymavlink."""

from __future__ import annotations

from typing import TYPE_CHECKING

from mavlink_bridge.cli.common import warn
from mavlink_bridge.errors import LogError
from mavlink_bridge.logbook.log_situation import situation_from_log
from mavlink_bridge.mavlink.vehicles import not_ardupilot

if TYPE_CHECKING:
    from pathlib import Path

    from mavlink_bridge.cli.options.shared import LinkOptions
    from missions.situation import Situation


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
        raise LogError(f"{log}: {not_ardupilot(situation.system, None)}", file=str(log))
    return situation
