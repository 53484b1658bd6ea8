"""What an autopilot reports about itself, put into a situation: whose it is, its version, how it encodes parameters, and those."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from types import MappingProxyType
from typing import TYPE_CHECKING

from mavlink_bridge.mavlink.messages import Autopilot, Capability

if TYPE_CHECKING:
    from mavlink_bridge.mavlink.messages import AutopilotVersion
    from missions.situation import Situation

_BANNER = re.compile(r"(?:ArduRover|APMrover2|Rover) V(\d{1,2})\.(\d{1,2})(?:\.(\d{1,2}))?")


def with_parameter(situation: Situation, name: str, value: float) -> Situation:
    """Return the situation with a parameter that was reported.

    A value that is not a number is not taken: what was known before stands, and what came is noted.
    """
    if not math.isfinite(value):
        if situation.no_numbers.get(name) == str(value):
            return situation
        return replace(situation, no_numbers=MappingProxyType({**situation.no_numbers, name: str(value)}))
    if situation.parameters.get(name) == value and name not in situation.no_numbers:
        return situation
    return replace(
        situation,
        parameters=MappingProxyType({**situation.parameters, name: value}),
        no_numbers=MappingProxyType({key: came for key, came in situation.no_numbers.items() if key != name}),
    )


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
    return replace(situation, ardupilot=ardupilot, bytewise=bytewise)


def with_version(situation: Situation, message: AutopilotVersion) -> Situation:
    """Return the situation with what AUTOPILOT_VERSION reports."""
    bytewise = situation.bytewise
    if bytewise is None:
        bytewise = bool(message.capabilities & Capability.PARAM_ENCODE_BYTEWISE)
    version = message.flight_sw_version
    firmware = (version >> 24 & 255, version >> 16 & 255, version >> 8 & 255) if version else None
    return replace(situation, bytewise=bytewise, firmware=firmware or situation.firmware)


def with_banner(situation: Situation, text: str) -> Situation:
    """Return the situation with the version that ArduPilot's banner reports, "ArduRover V4.5.7 (0358a9c2)"."""
    found = _BANNER.match(text)
    if found is None:
        return situation
    return replace(situation, firmware=(int(found[1]), int(found[2]), int(found[3] or 0)))
