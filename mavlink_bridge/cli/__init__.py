"""The command line: ``pbpp``. One module a command; what is heavy is imported inside the commands, so that help is quick."""

from __future__ import annotations

from mavlink_bridge.cli.app import main

__all__ = ["main"]
