"""The options of ``pbpp doctor``, and its help."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer

from mavlink_bridge.cli.options.shared import CommonOptions, FirmwareOption


@dataclass(frozen=True, slots=True, kw_only=True)
class DoctorOptions(CommonOptions):
    """Check this installation: versions, serial ports, options file, signing key, backups, and a plan with a known answer.

    Nothing is opened and nothing is sent. Exit 8 if something is wrong.

    For example:

    `pbpp doctor`

    `pbpp doctor --signing-key rover.key --json`

    `pbpp doctor --vehicle rover.parm --firmware 4.6`
    """

    signing_key: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Check this signing key and its permissions.")
    ] = None
    vehicle: Annotated[
        Path | None, typer.Option(metavar="FILE.parm", help="Check this vehicle's parameters too.")
    ] = None
    firmware: FirmwareOption = None
