"""``pbpp check --connect``: mission, fence, rally points and parameters as the vehicle holds them."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from mavlink_bridge.cli.options_session import session_for
from mavlink_bridge.director.learning import Learning
from mavlink_bridge.fold import fold
from mavlink_bridge.mavlink.autopilot_facts import with_autopilot
from mavlink_bridge.protocol.undisturbed_read import UndisturbedRead
from missions.situation import ListKind, Situation

if TYPE_CHECKING:
    from mavlink_bridge.cli.options.shared import LinkOptions
    from mavlink_bridge.mavlink.messages import Frame

_TELEMETRY_PATIENCE_S = 5.0
"""A vehicle that reports its position does so at least once a second."""


def live_situation(options: LinkOptions, connection: str) -> tuple[Situation, list[str]]:
    """Read mission, fence, rally points and parameters from the vehicle; nothing is written to it. Return also what it did not report.

    Raises
    ------
    BridgeError
        The vehicle is not there, or does not give them.
    """
    with session_for(options, connection) as (session, _show):
        peer, link = session.vehicle, session.link
        # What a list means rests on whose it is: the next heartbeat may come after the lists.
        heard = with_autopilot(
            Situation(system=peer.system, component=peer.component), peer.autopilot.autopilot
        )

        def listen(frames: list[Frame]) -> None:
            nonlocal heard
            for frame in frames:
                heard = fold(heard, frame, link.now_s())

        session.listeners.append(listen)
        learning = Learning(
            peer,
            _TELEMETRY_PATIENCE_S,
            tuple(ListKind),
            UndisturbedRead,
            needs_position=False,
            names=peer.autopilot.parameters.checked,
        )
        session.run(learning, "reading parameters, mission, fence and rally points")
        if learning.trouble is not None:
            raise learning.trouble
        found = learning.merged(heard, link.now_s())
    unknown = [
        f"the vehicle sends positions as 32-bit floats: the {kind} is accurate to about 1 m only"
        for kind in learning.coarse
    ]
    if found.pose is None:
        unknown.append("no position from the vehicle; assuming it stands at home")
    has_fence = found.fence is not None and found.fence.value.zones
    return found if has_fence else replace(found, fence=None), unknown
