"""Between MAVLink streams and missions: fold, protocol machines, director, links, logs, the simulated rover, the command line.

The names below are stable; they are loaded when they are first asked for, so that importing this package costs nothing.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from mavlink_bridge.director import Director, Orders
    from mavlink_bridge.errors import BridgeError
    from mavlink_bridge.link import Link, open_link
    from mavlink_bridge.logbook.log_situation import situation_from_log
    from mavlink_bridge.mavlink.messages import Frame
    from mavlink_bridge.simulator import Simulator, SimulatorConfig
    from mavlink_bridge.tlog import TlogReader, TlogWriter

__all__ = [
    "BridgeError",
    "Director",
    "Frame",
    "Link",
    "Orders",
    "Simulator",
    "SimulatorConfig",
    "TlogReader",
    "TlogWriter",
    "open_link",
    "situation_from_log",
]

_HOMES = {
    name: home
    for home, names in {
        "director": ("Director", "Orders"),
        "errors": ("BridgeError",),
        "link": ("Link", "open_link"),
        "logbook.log_situation": ("situation_from_log",),
        "mavlink.messages": ("Frame",),
        "simulator": ("Simulator", "SimulatorConfig"),
        "tlog": ("TlogReader", "TlogWriter"),
    }.items()
    for name in names
}


def __getattr__(name: str) -> object:
    home = _HOMES.get(name)
    if home is None:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{home}"), name)
