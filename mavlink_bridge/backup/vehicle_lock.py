"""One writer to a vehicle at a time, among the processes of this computer.

Two uploads to one vehicle would take each other's half-written list for what was there before. The operating system's own file locks are
used: they are freed when a process ends, however it does. A vehicle is locked under its uid and under the way it is connected, so that two
processes meet that know the same vehicle by different marks.
"""

from __future__ import annotations

import contextlib
import json
import os
import sys
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from typing import IO, TYPE_CHECKING

from mavlink_bridge.errors import BackupError, VehicleInUseError
from mavlink_bridge.user_folders import state_folder

if TYPE_CHECKING:
    from pathlib import Path

    from mavlink_bridge.backup.vehicle_mark import VehicleMark

_LOCKED_BYTE = 1 << 30
"""Windows lets nobody read what is locked: a byte beyond the holder's name."""


@dataclass(frozen=True, slots=True)
class Holder:
    """Who writes to a vehicle.

    Parameters
    ----------
    process : int, optional
        Its process id; None where it has not written it yet.
    since : str
        Since when, UTC.
    """

    process: int | None
    since: str

    def __str__(self) -> str:
        if self.process is None:
            return "another pbpp"
        return f"another pbpp (process {self.process}, since {self.since} UTC)"

    def error(self, vehicle: VehicleMark) -> VehicleInUseError:
        """Return the error of who wanted to write meanwhile."""
        return VehicleInUseError(
            f"{self} on this computer is writing to {vehicle}; nothing was written by this command",
            process=self.process,
            since=self.since,
            advice="wait for it to finish, or stop it",
        )


class VehicleLock:
    """The right to write to one vehicle.

    Parameters
    ----------
    vehicle : VehicleMark
        Which vehicle.
    folder : Path, optional
        Where the lock files lie; in the user's state folder if not given.
    """

    def __init__(self, vehicle: VehicleMark, folder: Path | None = None) -> None:
        self.vehicle = vehicle
        self._folder = folder or state_folder() / "locks"
        keys = {vehicle.key, replace(vehicle, uid="").key}
        self._paths = [self._folder / f"vehicle-{key}.lock" for key in sorted(keys)]
        self._files: list[IO[bytes]] = []

    @property
    def is_held(self) -> bool:
        """Whether it is ours."""
        return bool(self._files)

    def take(self) -> Holder | None:
        """Take the lock; return who has it if somebody else does.

        Raises
        ------
        BackupError
            There can be no lock file.
        """
        if self.is_held:
            return None
        files: list[IO[bytes]] = []
        try:
            self._folder.mkdir(parents=True, exist_ok=True)
            for path in self._paths:
                file: IO[bytes] = path.open("a+b")
                files.append(file)
                if not lock_file(file):
                    holder = _holder(file)
                    _close(files)
                    return holder
        except OSError as error:
            _close(files)
            raise BackupError(
                f"{self._folder}: cannot write the vehicle's lock file there: {error.strerror or error}; nothing was written to the vehicle",
                path=str(self._folder),
                advice="free some disk space, or set XDG_STATE_HOME to a writable folder",
            ) from None
        for file in files:
            with contextlib.suppress(OSError):  # only the name for others
                _sign(file)
        self._files = files
        return None

    def free(self) -> None:
        """Release the lock; harmless if it is not ours."""
        _close(self._files)
        self._files = []


def _close(files: list[IO[bytes]]) -> None:
    for file in files:
        with contextlib.suppress(OSError):
            file.close()


def _sign(file: IO[bytes]) -> None:
    file.truncate(0)
    file.write(
        json.dumps({"process": os.getpid(), "since": f"{datetime.now(UTC):%Y-%m-%d %H:%M:%S}"}).encode()
    )
    file.flush()


def _holder(file: IO[bytes]) -> Holder:
    try:
        file.seek(0)
        content = json.loads(file.read(4096))
        return Holder(int(content["process"]), str(content["since"]))
    except (OSError, ValueError, KeyError, TypeError):
        return Holder(None, "")


if sys.platform == "win32":
    import msvcrt

    def lock_file(file: IO[bytes]) -> bool:
        """Lock a file; False if somebody else has."""
        file.seek(_LOCKED_BYTE)
        try:
            msvcrt.locking(file.fileno(), msvcrt.LK_NBLCK, 1)
        except OSError:
            return False
        return True

else:
    import fcntl

    def lock_file(file: IO[bytes]) -> bool:
        """Lock a file; False if somebody else has."""
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            return False
        return True
