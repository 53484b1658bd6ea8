"""STATUSTEXTs for the ground stations, at most one a second, the grave ones first."""

from __future__ import annotations

from mavlink_bridge.mavlink.messages import Statustext
from missions.words import harmless

_EVERY_S = 1.0  # 50 bytes a second are 1 % of a radio at 57600 baud; chosen, not measured
_MOST_WAITING = 8  # later than 8 s a text is no news; chosen, not measured
_MOST_CHARACTERS = 50  # STATUSTEXT.text


class Announcer:
    """Holds texts back so that they do not flood a radio."""

    def __init__(self) -> None:
        self._waiting: list[tuple[int, str]] = []
        self._free_s = 0.0

    @property
    def deadline_s(self) -> float | None:
        """When the next text may go."""
        return self._free_s if self._waiting else None

    def say(self, severity: int, text: str) -> None:
        """Take a text; of too many the oldest of the least grave ones is dropped."""
        self._waiting.append((severity, f"pbpp: {harmless(text)}"[:_MOST_CHARACTERS]))
        if len(self._waiting) > _MOST_WAITING:
            self._waiting.remove(max(self._waiting, key=lambda entry: entry[0]))

    def due(self, now_s: float) -> list[Statustext]:
        """Return the text that may go now."""
        if not self._waiting or now_s < self._free_s:
            return []
        gravest = min(self._waiting, key=lambda entry: entry[0])
        self._waiting.remove(gravest)
        self._free_s = now_s + _EVERY_S
        return [Statustext(*gravest)]
