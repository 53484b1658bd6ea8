"""The options of ``pbpp config``, and its help."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from mavlink_bridge.cli.options.shared import CommonOptions, flag


@dataclass(frozen=True, slots=True, kw_only=True)
class ConfigOptions(CommonOptions):
    """Show where your options file is, what it sets, and which environment variables apply.

    In order of precedence: the command line, `--config FILE`, your own file, the defaults in `--help`.

    For example:

    `pbpp config`

    `pbpp config --config bridge.toml --json`

    `pbpp config --template`
    """

    template: Annotated[bool, flag("--template", "Print an example options file.")] = False
