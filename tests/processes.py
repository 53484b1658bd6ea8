"""Programs that tests start and end as a person or a service does, on every system."""

from __future__ import annotations

import os
import signal
import subprocess
from typing import Any

_IS_WINDOWS = os.name == "nt"
APART: dict[str, Any] = (
    {"creationflags": subprocess.CREATE_NEW_PROCESS_GROUP} if _IS_WINDOWS else {}  # type: ignore[attr-defined]
)
"""How to start what `end` is to end: on Windows a Ctrl-Break goes to a whole group."""


def end(process: subprocess.Popen) -> None:
    """Ask a program to end: by SIGTERM, on Windows by Ctrl-Break."""
    process.send_signal(signal.CTRL_BREAK_EVENT if _IS_WINDOWS else signal.SIGTERM)  # type: ignore[attr-defined]
