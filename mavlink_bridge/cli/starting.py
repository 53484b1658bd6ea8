"""Setting a vehicle going on the mission that it holds, after an upload; and stopping one that still drives, before it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from mavlink_bridge.errors import BridgeError, OutcomeError, RefusedError
from mavlink_bridge.mavlink.messages import MissionType
from mavlink_bridge.mavlink.rover import Mode, plain_mode_name

if TYPE_CHECKING:
    from collections.abc import Iterable

    from mavlink_bridge.cli.session import Session

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
    if hold:
        session.change_mode(Mode.HOLD)
    elif not replace_active:
        raise RefusedError(
            "the vehicle is armed and driving its mission in AUTO; nothing was written",
            advice="add --hold to switch it to HOLD first, or --replace-active to write while it drives",
        )


def fence_warnings(session: Session, lists: Iterable[MissionType]) -> list[str]:
    """Return what an armed vehicle may do once a new fence is on it: if it stands outside, it may drive off."""
    if MissionType.FENCE not in lists or not session.doing.is_armed:
        return []
    text = (
        "the vehicle is armed, and a new fence takes effect at once: if it stands outside and FENCE_ENABLE is 1, it does what "
        "FENCE_ACTION says (1: RTL, it drives straight home)"
    )
    return [text]


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
    if not doing.is_armed:
        mode = plain_mode_name(doing.mode or Mode.MANUAL)
        drives_off = ": arming it makes it drive" if doing.mode == Mode.AUTO else ""
        raise OutcomeError(
            f"everything is verified on the vehicle, which is not armed and does not drive: its mode was not changed ({mode}{drives_off})",
            advice=_ADVICE,
            mode=mode,
        )
    if doing.mode == Mode.AUTO and doing.has_completed:
        session.change_mode(Mode.HOLD)  # AUTO begins anew only out of another mode
    session.drives_by_us = True
    try:
        session.change_mode(Mode.AUTO)
    finally:
        if session.doing.mode != Mode.AUTO and session.doing.is_fresh:
            session.drives_by_us = False
    if not session.doing.is_armed:
        session.drives_by_us = False
        raise _put_back(session)


def _put_back(session: Session) -> OutcomeError:
    """Take a vehicle that is disarmed out of AUTO, and return what came of it."""
    what = "everything is verified on the vehicle, but it was disarmed when it went to AUTO"
    try:
        session.change_mode(Mode.HOLD)
    except BridgeError as error:
        return OutcomeError(
            f"{what}, and it is still in AUTO, where arming it makes it drive: {error}", advice=_ADVICE
        )
    return OutcomeError(f"{what}: it was switched back to HOLD and does not drive", advice=_ADVICE)
