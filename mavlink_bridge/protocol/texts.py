"""The vehicle's reasons: the STATUSTEXTs that have to do with a refusal, separated from all else that it sends meanwhile."""

from __future__ import annotations

import math
import re
from functools import cache
from typing import TYPE_CHECKING

from mavlink_bridge.mavlink.messages import Statustext

if TYPE_CHECKING:
    from mavlink_bridge.mavlink.messages import Frame
    from mavlink_bridge.protocol.peer import Peer

MOST_TEXTS = 8  # chosen, not measured: bounds the message

_MOST_SEVERITY = 5
"""MAV_SEVERITY_NOTICE: ArduPilot gives reasons as notices ("No Mission. Can't set AUTO.") and graver; lighter texts report success."""

_LATE_S = 1.0
"""ArduPilot queues its texts, so that a reason may come after the answer; it empties the queue several times a second."""


@cache
def _pattern(text: str) -> re.Pattern[str]:
    return re.compile(text, re.IGNORECASE)


class Reasons:
    """The texts that may explain why a request was refused, from the request until shortly after its answer.

    Parameters
    ----------
    peer : Peer
        The vehicle; texts of others are not its reasons.
    is_about_list : bool
        Whether a mission, fence or rally list is asked for: then the vehicle's own state (arming, battery, EKF) is no reason either.
    """

    def __init__(self, peer: Peer, *, is_about_list: bool = False) -> None:
        self._peer = peer
        self._is_about_list = is_about_list
        self._texts: list[str] = []
        self._until_s = -math.inf

    @property
    def texts(self) -> tuple[str, ...]:
        """The texts, each once, in order."""
        return tuple(self._texts)

    def ask(self) -> None:
        """Note a request: texts before it are not about it."""
        self._texts.clear()
        self._until_s = math.inf

    def answered(self, now_s: float) -> None:
        """Note its answer: only texts shortly afterwards are still about it."""
        self._until_s = min(self._until_s, now_s + _LATE_S)

    def take(self, frame: Frame, now_s: float) -> None:
        """Take a frame."""
        message = frame.message
        if not isinstance(message, Statustext) or not self._peer.accepts(frame) or now_s > self._until_s:
            return
        is_news = message.text not in self._texts and len(self._texts) < MOST_TEXTS
        if is_news and self._may_be_reason(message):
            self._texts.append(message.text)

    def _may_be_reason(self, message: Statustext) -> bool:
        texts, text = self._peer.autopilot.texts, message.text
        if message.severity > _MOST_SEVERITY or not text.strip() or _pattern(texts.noise).match(text):
            return False
        return not (self._is_about_list and _pattern(texts.own_state).match(text))
