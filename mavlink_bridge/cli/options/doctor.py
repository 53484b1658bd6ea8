"""The options of ``pbpp doctor``, and its help."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from mavlink_bridge.cli.options.shared import CommonOptions, FirmwareOption, option


@dataclass(frozen=True, slots=True, kw_only=True)
class DoctorOptions(CommonOptions):
    """Check this installation: versions, serial ports, options file, signing key, backups, and a plan with a known answer.

    Nothing is opened and nothing is sent. Exit 8 if something is wrong.

    For example:

    `pbpp doctor`

    `pbpp doctor --signing-key rover.key --json`

    `pbpp doctor --vehicle rover.parm --firmware 4.6`
    """

    signing_key: Annotated[Path | None, option("Check this signing key and its permissions.", "FILE")] = None
    vehicle: Annotated[Path | None, option("Check this vehicle's parameters too.", "FILE.parm")] = None
    firmware: FirmwareOption = None
