"""Setting a vehicle going on the mission that it holds, after an upload; and stopping one that still drives, before it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from mavlink_bridge.errors import BridgeError, OutcomeError, RefusedError
from mavlink_bridge.mavlink.drive_rules import FirstItem
from mavlink_bridge.mavlink.messages import MissionType
from mavlink_bridge.protocol.first_item import BeginAtFirstItem
from missions.items import Command

if TYPE_CHECKING:
    from collections.abc import Iterable

    from mavlink_bridge.cli.session import Session
    from missions.items import MissionItem

_STATE_PATIENCE_S = 2.0
"""MISSION_CURRENT comes at least once a second where it is streamed."""

_ADVICE = "arm it in HOLD, then run this again or switch it to AUTO yourself"


def make_ready(session: Session, *, hold: bool, replace_active: bool) -> None:
    """See to it that the vehicle does not drive what is about to be replaced.

    Raises
    ------
    RefusedError
        It drives its mission, and no option says what to do about that.
    OutcomeError
        It does not go to HOLD.
    """
    if (
        session.is_active
    ):  # a mission that is complete is not driven: the vehicle may not have reported it yet
        session.ask_telemetry()
        session.listen_until(lambda: session.is_active is False, _STATE_PATIENCE_S)
    if not session.is_active:
        return
    modes = session.autopilot.modes
    if hold:
        session.change_mode(modes.hold)
    elif not replace_active:
        raise RefusedError(
            f"the vehicle is armed and driving its mission in {modes.named(modes.mission)}; nothing was written",
            advice="add --hold to switch it to HOLD first, or --replace-active to write while it drives",
        )


def check_drivable(session: Session, missions: Iterable[Iterable[MissionItem]]) -> None:
    """Find in missions that are to be driven what the vehicle does otherwise than it looks.

    Raises
    ------
    RefusedError
        An RTL item leads out of the mission, straight home through any zone.
    """
    table = session.autopilot
    if not table.driving.leaves_mission_for_rtl:
        return
    for items in missions:
        for number, item in enumerate(items, 1):
            if item.command == Command.NAV_RETURN_TO_LAUNCH:
                raise RefusedError(
                    f"item {number} of the mission is RTL: {table.kind} leaves the mission for it and drives straight home, through any zone; nothing was written",
                    advice="plan the way home (pbpp plan --return), or upload the mission without --drive, look where RTL leads (pbpp check), and start it yourself",
                    item=number,
                )


def fence_warnings(session: Session, lists: Iterable[MissionType]) -> list[str]:
    """Return what to know of a new fence: an armed vehicle that stands outside may drive off."""
    if MissionType.FENCE not in lists:
        return []
    table = session.autopilot
    return [table.new_fence_armed] if table.new_fence_armed and session.doing.is_armed else []


def start_driving(session: Session) -> None:
    """Switch an armed vehicle to AUTO, and take it out again if it was disarmed meanwhile: arming it would drive off.

    Raises
    ------
    OutcomeError
        It is not armed, or reports nothing: its mode was not changed. Or it was disarmed meanwhile.
    RefusedError
        It refused AUTO.
    """
    if not session.hear_anew():
        raise OutcomeError(
            "everything is verified on the vehicle, but no heartbeat says whether it is armed: its mode was not changed",
            advice=_ADVICE,
        )
    doing = session.doing
    modes = session.autopilot.modes
    if not doing.is_armed:
        mode = modes.named(doing.mode or 0)
        drives_off = ": arming it makes it drive" if doing.mode == modes.mission else ""
        raise OutcomeError(
            f"everything is verified on the vehicle, which is not armed and does not drive: its mode was not changed ({mode}{drives_off})",
            advice=_ADVICE,
            mode=mode,
        )
    if session.autopilot.driving.first_item is FirstItem.BY_MESSAGE_BEFORE:
        session.run(BeginAtFirstItem(session.vehicle), "setting the first item")
    if doing.mode == modes.mission and doing.has_completed:
        session.change_mode(modes.hold)  # AUTO begins anew only out of another mode
    session.drives_by_us = True
    try:
        session.change_mode(modes.mission)
    finally:
        if session.doing.mode != modes.mission and session.doing.is_fresh:
            session.drives_by_us = False
    if not session.doing.is_armed:
        session.drives_by_us = False
        raise _put_back(session)


def _put_back(session: Session) -> OutcomeError:
    """Take a vehicle that is disarmed out of AUTO, and return what came of it."""
    what = "everything is verified on the vehicle, but it was disarmed when it went to AUTO"
    try:
        session.change_mode(session.autopilot.modes.hold)
    except BridgeError as error:
        return OutcomeError(
            f"{what}, and it is still in AUTO, where arming it makes it drive: {error}", advice=_ADVICE
        )
    return OutcomeError(f"{what}: it was switched back to HOLD and does not drive", advice=_ADVICE)
