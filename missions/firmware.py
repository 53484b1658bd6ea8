"""The autopilot's version, from AUTOPILOT_VERSION, from its banner, from a parameter file's remarks or from an option."""

from __future__ import annotations

import re
from dataclasses import dataclass

from missions.errors import VehicleError

OFFICIAL = 255
"""FIRMWARE_VERSION_TYPE_OFFICIAL; below it stand release candidates, betas, alphas and, from 0 on, development (MAVLink's common.xml)."""

_STAGES = {"dev": 0, "alpha": 64, "beta": 128, "rc": 192}
_VERSION = r"V?(\d{1,2})\.(\d{1,3})(?:\.(\d{1,3}))?(?:[- ]?(dev|alpha|beta|rc)(\d{0,2}))?"
_WHOLE = re.compile(rf"\s*{_VERSION}\s*", re.IGNORECASE)
_BANNER = re.compile(rf"(?:ArduRover|APMrover2|Rover) {_VERSION}")
_REMARK = re.compile(rf"#\s*(?:Version: ?|.*?\b(?:ArduRover|APMrover2|Rover) ){_VERSION}")


@dataclass(frozen=True, slots=True, order=True)
class Firmware:
    """An autopilot's version; development comes before the betas, and those before the release.

    Parameters
    ----------
    major, minor, patch : int
        Of a development version those that it is to become.
    stage : int
        FIRMWARE_VERSION_TYPE: 255 a release, 134 beta6, 0 development.
    """

    major: int
    minor: int
    patch: int = 0
    stage: int = OFFICIAL

    def __str__(self) -> str:
        number = f"{self.major}.{self.minor}.{self.patch}"
        if self.stage == OFFICIAL:
            return number
        name, first = max(
            (item for item in _STAGES.items() if item[1] <= self.stage), key=lambda item: item[1]
        )
        return f"{number}-{name}{self.stage - first or ''}"


def firmware_from_number(version: int) -> Firmware | None:
    """Return the version of AUTOPILOT_VERSION.flight_sw_version, a byte each from the top; None for 0."""
    return (
        Firmware(version >> 24 & 255, version >> 16 & 255, version >> 8 & 255, version & 255)
        if version
        else None
    )


def firmware_from_banner(text: str) -> Firmware | None:
    """Return the version that ArduPilot Rover reports when it starts, "ArduRover V4.5.7 (0358a9c2)"; None from another text."""
    return _firmware(_BANNER.match(text))


def firmware_from_remark(line: str) -> Firmware | None:
    """Return the version that a remark of a parameter file names ("# Version: 4.5.7" of QGroundControl); None where it names none."""
    return _firmware(_REMARK.match(line))


def read_firmware(text: str) -> Firmware:
    """Return the version that somebody typed: 4.5, 4.5.7, 4.7.0-dev.

    Raises
    ------
    VehicleError
        It is none.
    """
    firmware = _firmware(_WHOLE.fullmatch(text))
    if firmware is None:
        raise VehicleError(
            f"{text!r} is not a firmware version; expected one such as 4.5 or 4.6.3", firmware=text
        )
    return firmware


def _firmware(found: re.Match[str] | None) -> Firmware | None:
    if found is None:
        return None
    major, minor, patch, stage, number = found.groups()
    of_stage = _STAGES[stage.lower()] + int(number or 0) if stage else OFFICIAL
    return Firmware(int(major), int(minor), int(patch or 0), of_stage)
