"""Where a user's own files lie: the options and the backups."""

from __future__ import annotations

import os
from pathlib import Path

import platformdirs

_NAME = "pbpp-rover"


def config_folder() -> Path:
    """Return the folder of the user's options: below ``XDG_CONFIG_HOME`` if that is set, else where the system keeps such files."""
    return _below("XDG_CONFIG_HOME") or platformdirs.user_config_path(_NAME, appauthor=False)


def state_folder() -> Path:
    """Return the folder of what is kept between runs: below ``XDG_STATE_HOME`` if that is set, else where the system keeps such files."""
    return _below("XDG_STATE_HOME") or platformdirs.user_state_path(_NAME, appauthor=False)


def _below(variable: str) -> Path | None:
    """Return our folder below the one that a variable names: on Windows and macOS too, where nothing else uses that variable."""
    place = Path(os.environ.get(variable, "").strip())
    return place / _NAME if place.is_absolute() else None
