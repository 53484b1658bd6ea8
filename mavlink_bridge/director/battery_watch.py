"""Whether a battery is low: by BATTERY_STATUS, by SYS_STATUS where no other tells, and by the autopilot's own text."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import TYPE_CHECKING

from mavlink_bridge.mavlink import messages as m

if TYPE_CHECKING:
    from mavlink_bridge.mavlink.messages import Message

LOW_FOR_S = 10.0
"""So long a battery has to be low: ArduPilot's own BATT_LOW_TIMER, for the voltage of one under load drops for a moment."""

_LEAST_MESSAGES = 3
"""And so many messages in a row have to tell it; chosen, not measured."""

_FALLBACK_S = 10.0
"""For so long after a BATTERY_STATUS, which ArduPilot sends every second or two, SYS_STATUS says nothing new."""

_UNKNOWN_MV, _UNKNOWN_PERCENT = 65_535, -1
_TEXT = re.compile(r"battery \d+ is (low|critical)", re.IGNORECASE)
"""AP_BattMonitor: "Battery 1 is low 10.20V used 1200 mAh"."""


@dataclass(slots=True)
class _Low:
    """Since when a battery is low, when that was told last, and how many messages have told it."""

    since_s: float = math.inf
    told_s: float = -math.inf
    count: int = 0


class BatteryWatch:
    """Tells once that a battery is low; again only after it was not.

    Parameters
    ----------
    percent, volts : float, optional
        At or below which it is; without either nothing is watched for.
    """

    def __init__(self, percent: float | None, volts: float | None) -> None:
        self._percent = percent
        self._volts = volts
        self._lows: dict[int | None, _Low] = {}
        self._told = False
        self._status_s = -math.inf

    @property
    def is_on(self) -> bool:
        """Whether anything is watched for."""
        return self._percent is not None or self._volts is not None

    def receive(self, message: Message, now_s: float) -> str:
        """Take a message of the vehicle; return what is low, in words, where that is news, else nothing."""
        if not self.is_on:
            return ""
        if isinstance(message, m.Statustext):
            text = message.text.strip()
            return self._tell(text) if _TEXT.match(text) else ""
        if isinstance(message, m.BatteryStatus):
            self._status_s = now_s
            self._lows.pop(None, None)  # what SYS_STATUS has told before
            whole_mv = message.whole_mv
            volts = math.nan if whole_mv is None else whole_mv / 1000
            return self._look(message.id, message.battery_remaining, volts, now_s)
        if isinstance(message, m.SysStatus) and now_s > self._status_s + _FALLBACK_S:
            millivolts = message.voltage_battery
            volts = math.nan if millivolts == _UNKNOWN_MV else millivolts / 1000
            return self._look(None, message.battery_remaining, volts, now_s)
        return ""

    def _look(self, battery: int | None, percent: int, volts: float, now_s: float) -> str:
        """Look at a battery's figures; both 0 where there is no monitor, and 0 V, as to ArduPilot, no reading."""
        volts = volts or math.nan
        if percent <= 0 and math.isnan(volts):
            return ""
        is_low = self._percent is not None and 0 <= percent <= self._percent
        is_weak = self._volts is not None and volts <= self._volts
        low = self._lows.setdefault(battery, _Low())
        if not (is_low or is_weak):
            self._lows[battery] = _Low()
            self._told = self._told and any(one.count for one in self._lows.values())
            return ""
        if now_s > low.told_s + _FALLBACK_S:  # nobody knows what it was meanwhile
            low.since_s, low.count = math.inf, 0
        low.told_s = now_s
        low.since_s, low.count = min(low.since_s, now_s), low.count + 1
        if low.count < _LEAST_MESSAGES or now_s < low.since_s + LOW_FOR_S:
            return ""
        figures = [f"{percent} %"] if percent >= 0 else []
        figures += [] if math.isnan(volts) else [f"{volts:.1f} V"]
        return self._tell(
            f"battery {'' if battery is None else battery + 1} at {', '.join(figures)}".replace("  ", " ")
        )

    def _tell(self, words: str) -> str:
        words, self._told = ("" if self._told else words), True
        return words
