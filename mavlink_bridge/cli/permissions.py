"""What a command may do to a vehicle: each permission is given by a word of its own, and rests on the one before it."""

from __future__ import annotations

from mavlink_bridge.errors import UsageError


def check_permissions(*, upload: bool, drive: bool, arm: bool = False, hold: bool = False) -> None:
    """Refuse permissions without those that they rest on, before anything is opened.

    Raises
    ------
    UsageError
        ``--drive`` or ``--hold`` without ``--upload``, or ``--arm`` without ``--drive``.
    """
    if drive and not upload:
        raise UsageError(
            "--drive needs --upload: it drives the mission that was uploaded and verified. Nothing is written without --upload"
        )
    if arm and not drive:
        raise UsageError("--arm needs --upload --drive: it arms the vehicle to drive the uploaded mission")
    if hold and not upload:
        raise UsageError("--hold needs --upload: it stops the vehicle so that its mission can be replaced")
