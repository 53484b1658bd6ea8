"""Numbers in texts, short whatever they are: a vehicle or a file may report anything."""

from __future__ import annotations

_LONG_M = 1e7
"""Beyond the Earth's own size digits mean nothing."""


def metres(value_m: float) -> str:
    """Return a length in metres for people: to the centimetre, and short where it is no length on Earth."""
    return f"{value_m:.2f} m" if abs(value_m) < _LONG_M else f"{value_m:.3g} m"


def counted(count: int, name: str) -> str:
    """Return a number of things for people, such as "1 waypoint" and "2 waypoints"."""
    return f"{count} {name}" if count == 1 else f"{count} {name}s"
