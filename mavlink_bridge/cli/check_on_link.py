"""``pbpp check --connect``: mission, fence, rally points and parameters as the vehicle holds them."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from mavlink_bridge.cli.download import read_list
from mavlink_bridge.cli.options_session import session_for
from mavlink_bridge.errors import LinkError
from mavlink_bridge.fold import fold
from mavlink_bridge.link import now_s
from mavlink_bridge.protocol.parameters import ReadParameters
from missions.checking.mission_end import PARAMETER_NAMES as END_NAMES
from missions.fence import fence_from_items
from missions.items import without_home
from missions.rally import rally_from_items
from missions.situation import Known, Mission, Situation
from missions.vehicle import PARAMETER_NAMES

if TYPE_CHECKING:
    from mavlink_bridge.cli.options.check import CheckOptions
    from mavlink_bridge.mavlink.messages import Frame

_TELEMETRY_PATIENCE_S = 5.0
"""A vehicle that reports its position does so at least once a second."""


def live_situation(options: CheckOptions) -> tuple[Situation, list[str]]:
    """Read mission, fence, rally points and parameters from the vehicle; nothing is written to it. Return also what it did not report.

    Raises
    ------
    BridgeError
        The vehicle is not there, or does not give them.
    """
    assert options.connect is not None
    with session_for(options, options.connect) as (session, _show):
        peer = session.vehicle
        heard = Situation(system=peer.system, component=peer.component)

        def listen(frames: list[Frame]) -> None:
            nonlocal heard
            for frame in frames:
                heard = fold(heard, frame, now_s())

        session.listeners.append(listen)
        session.ask_telemetry()
        items, fence, rally = (read_list(session, what) for what in ("mission", "fence", "rally"))
        machine = ReadParameters(session.vehicle, (*PARAMETER_NAMES, *END_NAMES, "BRD_SD_MISSION"))
        session.run(machine, "reading parameters")
        # What is promised rests on the fix: whether it is known must not be a matter of luck.
        session.listen_until(lambda: heard.pose is not None and heard.fix is not None, _TELEMETRY_PATIENCE_S)
    if machine.outcome is None or machine.outcome.is_silent:
        raise LinkError("the vehicle does not answer when asked for its parameters")
    source = "the vehicle"
    home = items[0].position if items and (items[0].lat_e7, items[0].lon_e7) != (0, 0) else None
    unknown = []
    if heard.pose is None:
        unknown.append("the vehicle did not tell its position: it is taken to stand at its home")
    found = replace(
        heard,
        fence=Known(fence_from_items(fence), None, source) if fence else None,
        mission=Known(Mission(without_home(items), home), None, source),
        rally=Known(rally_from_items(rally), None, source) if rally else None,
        home=Known(home, None, source) if home else heard.home,
        parameters={**heard.parameters, **machine.outcome.values},
    )
    return found, unknown
