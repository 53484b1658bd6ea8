"""What an autopilot reports about itself, put into a situation: whose it is, its version, how it encodes parameters, and those."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import TYPE_CHECKING

from mavlink_bridge.mavlink.messages import Autopilot, Capability
from missions.firmware import firmware_from_banner, firmware_from_number

if TYPE_CHECKING:
    from collections.abc import Iterator

    from mavlink_bridge.mavlink.messages import AutopilotVersion
    from missions.situation import Situation

_MOST_NEWEST = 32  # about the root of a thousand parameters: then both kinds of copy cost the same


def with_parameter(situation: Situation, name: str, value: float) -> Situation:
    """Return the situation with a parameter that was reported.

    A value that is not a number is not taken: what was known before stands, and what came is noted.
    """
    if not math.isfinite(value):
        if situation.no_numbers.get(name) == str(value):
            return situation
        no_numbers = MappingProxyType({**situation.no_numbers, name: str(value)})
        return replace(situation, reading=replace(situation.reading, no_numbers=no_numbers))
    parameters, reading = situation.parameters, situation.reading
    if name in reading.no_numbers:
        others = {key: came for key, came in reading.no_numbers.items() if key != name}
        reading = replace(reading, no_numbers=MappingProxyType(others))
    elif parameters.get(name) == value:
        return situation
    known = parameters if isinstance(parameters, Parameters) else Parameters(parameters)
    return replace(situation, parameters=known.with_one(name, value), reading=reading)


class Parameters(Mapping[str, float]):
    """Parameters as they come, one by one.

    What `with_one` returns shares all but the newest few with what it was made of, which stays as it is: to copy a thousand of them for each one that
    comes took more than half of the time in which a log is folded.

    Parameters
    ----------
    older : mapping of str to float
        Not changed any more by anybody.
    newest : mapping of str to float, optional
        Those that came since; they count before the older ones.
    """

    __slots__ = ("_newest", "_older")

    def __init__(self, older: Mapping[str, float], newest: Mapping[str, float] | None = None) -> None:
        self._older = older
        self._newest = newest or {}

    def with_one(self, name: str, value: float) -> Parameters:
        """Return these and one more, or one with another value."""
        newest = {**self._newest, name: value}
        if len(newest) < _MOST_NEWEST:
            return Parameters(self._older, newest)
        return Parameters({**self._older, **newest})

    def __getitem__(self, name: str) -> float:
        """Return a parameter's value."""
        return self._newest[name] if name in self._newest else self._older[name]

    def __iter__(self) -> Iterator[str]:
        """Return the names, in the order in which they first came."""
        yield from self._older
        yield from (name for name in self._newest if name not in self._older)

    def __len__(self) -> int:
        """Return how many there are."""
        return sum(1 for _ in self)


def with_autopilot(situation: Situation, autopilot: int) -> Situation:
    """Return the situation with what a HEARTBEAT's MAV_AUTOPILOT reports: whose it is, and how that one encodes parameters.

    ArduPilot always casts whole numbers and PX4 never does, whatever their AUTOPILOT_VERSION claims; for others that one counts.
    """
    ardupilot = autopilot == Autopilot.ARDUPILOTMEGA
    bytewise = situation.bytewise
    if autopilot in (Autopilot.ARDUPILOTMEGA, Autopilot.PX4):
        bytewise = autopilot == Autopilot.PX4
    if (ardupilot, bytewise) == (situation.ardupilot, situation.bytewise):
        return situation
    return replace(situation, ardupilot=ardupilot, reading=replace(situation.reading, bytewise=bytewise))


def with_version(situation: Situation, message: AutopilotVersion) -> Situation:
    """Return the situation with what AUTOPILOT_VERSION reports."""
    bytewise = situation.bytewise
    if bytewise is None:
        bytewise = bool(message.capabilities & Capability.PARAM_ENCODE_BYTEWISE)
    firmware = firmware_from_number(message.flight_sw_version)
    reading = replace(situation.reading, bytewise=bytewise)
    return replace(situation, reading=reading, firmware=firmware or situation.firmware)


def with_banner(situation: Situation, text: str) -> Situation:
    """Return the situation with the version that ArduPilot's banner reports, "ArduRover V4.5.7 (0358a9c2)"."""
    firmware = firmware_from_banner(text)
    return situation if firmware is None else replace(situation, firmware=firmware)
