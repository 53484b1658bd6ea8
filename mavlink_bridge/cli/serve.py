"""``pbpp serve``: the console. What serves it is an extra, and loaded only here."""

from __future__ import annotations

from importlib import import_module
from importlib.util import find_spec
from typing import TYPE_CHECKING

from mavlink_bridge.cli.permissions import check_permissions
from mavlink_bridge.errors import UsageError

if TYPE_CHECKING:
    from mavlink_bridge.cli.options.serve import ServeOptions

_LIBRARIES = ("msgspec", "segno", "starlette", "uvicorn", "websockets")


def serve(options: ServeOptions) -> None:
    """Serve the page until it is interrupted.

    Raises
    ------
    UsageError
        Options that do not go together, or the extra ``web`` is not installed.
    """
    check_permissions(upload=options.upload, drive=options.drive, arm=options.arm)
    given = [options.demo or None, options.connect, options.log, options.fence]
    if given.count(None) != len(given) - 1:
        raise UsageError("give one SOURCE: --demo, --connect CONNECTION, --log FILE.tlog or --fence FILE")
    has_vehicle = options.demo or options.connect is not None
    if options.upload and not has_vehicle:
        raise UsageError("--upload needs a vehicle: --connect CONNECTION, or --demo")
    if options.record is not None and not has_vehicle:
        raise UsageError("--record needs a vehicle: --connect CONNECTION, or --demo")
    if options.autopilot is not None and not options.demo:
        raise UsageError("--autopilot goes with --demo: any other source says which it is")
    if options.start is not None and options.fence is None:
        raise UsageError("--start goes with --fence: a vehicle reports its own position")
    if options.home is not None and has_vehicle:
        raise UsageError("--home goes with --fence and --log: a live vehicle reports its own home")
    missing = [name for name in _LIBRARIES if find_spec(name) is None]
    if missing:
        raise UsageError(
            f"pbpp serve needs {', '.join(missing)}", advice="install it: pip install 'pbpp-rover[web]'"
        )
    import_module("mavlink_bridge.cli.serving").serve(options)
