"""What the vehicle makes of a fence that is uploaded: which zones it will leave out, and that the others count."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from mavlink_bridge.fold import fold
from mavlink_bridge.mavlink.autopilot_facts import with_autopilot
from mavlink_bridge.mavlink.messages import CommandLong
from mavlink_bridge.protocol.await_enforced import AwaitEnforced
from missions.fence import fence_from_items
from missions.ground.px4_fence import unenforced_zones
from missions.situation import Known, Situation

if TYPE_CHECKING:
    from collections.abc import Sequence

    from mavlink_bridge.cli.session import Session
    from mavlink_bridge.mavlink.messages import Frame
    from missions.items import MissionItem

_PATIENCE_S = 3.0
"""A vehicle that reports home and its position does so at least every two seconds."""


class Enforcement:
    """Foresees what of a fence is not enforced, and watches for it; there is nothing to watch for where a fence counts at once.

    Parameters
    ----------
    session : Session
        The vehicle.
    """

    def __init__(self, session: Session) -> None:
        peer = session.vehicle
        self._session = session
        heard = Situation(system=peer.system, component=peer.component, armed=session.doing.is_armed)
        self._heard = with_autopilot(heard, peer.autopilot.autopilot)
        session.listeners.append(self._listen)

    @staticmethod
    def is_needed(session: Session) -> bool:
        """Return whether the vehicle's autopilot may leave out zones, and takes its time."""
        return session.autopilot.fence.seconds_a_vertex > 0

    def foreseen(self, items: Sequence[MissionItem]) -> list[str]:
        """Return warnings of what will not be enforced of a fence, by where home and the vehicle are."""
        peer = self._session.vehicle
        command, param1 = peer.autopilot.driving.home_asked_by
        self._session.link.send_all([CommandLong(peer.system, peer.component, command, param1=param1)])
        self._session.listen_until(self._is_placed, _PATIENCE_S)
        warnings = [
            f"{peer.autopilot.kind} will not enforce {zone}: {who} is on its forbidden side"
            for zone, who in unenforced_zones(self._with(items))
        ]
        if self._heard.home is None:
            warnings.append(
                f"home unknown: {peer.autopilot.kind} does not enforce an inclusion that home is outside of, or an exclusion that it is in"
            )
        return warnings

    def awaited(self, items: Sequence[MissionItem]) -> list[str]:
        """Wait until a fence that was just written counts; return the zones that do not, as far as the vehicle's texts or its place tell."""
        machine = AwaitEnforced(self._session.vehicle, len(items))
        self._session.run(machine, "until the fence counts")
        found = unenforced_zones(self._with(items))
        zones = [zone for zone, _ in found]
        for reason, text in machine.texts.items():
            if reason not in {who for _, who in found}:
                zones.append(f'a zone that it does not name ("{text}")')
        return zones

    def _is_placed(self) -> bool:
        return self._heard.home is not None and self._heard.pose is not None

    def _with(self, items: Sequence[MissionItem]) -> Situation:
        return replace(self._heard, fence=Known(fence_from_items(items), None, "the upload"))

    def _listen(self, frames: list[Frame]) -> None:
        for frame in frames:
            self._heard = fold(self._heard, frame, self._session.link.now_s())
