"""What can go wrong between a message stream and a vehicle.

::

    BridgeError
    ├── UsageError               options that do not fit together
    ├── LogError                 a log cannot be used
    ├── DatasetError             a dataset of logs cannot be built or read
    ├── LinkError                no connection, no heartbeat, silence
    ├── ClusterError             no scheduler, no workers, or workers of another version
    ├── LostWorkerError          a worker died at a task, again and again
    ├── IdentityTakenError       somebody else had our system and component id before anything was written
    ├── VehicleNotFoundError     nobody there is the vehicle asked for
    ├── RefusedError             the vehicle refused
    │   └── VehicleInUseError    another pbpp on this computer is writing to it
    └── OutcomeError             what is on the vehicle is not what was wanted, or unknown
        ├── DefectError          a bug of ours, after something was written
        └── BackupError          the old list cannot be kept or read back: nothing is written
            └── OtherVehicleError    the backup is another vehicle's, or may be
"""

from __future__ import annotations


class BridgeError(Exception):
    """Root of the bridge's errors; ``details`` holds the numbers a person or a script needs."""

    def __init__(self, message: str, **details: object) -> None:
        super().__init__(message)
        self.details = details


class UsageError(BridgeError):
    """Options that do not fit together."""


class LogError(BridgeError):
    """A telemetry log is missing, empty, or not one."""


class DatasetError(BridgeError):
    """A dataset of logs cannot be built or read."""


class LinkError(BridgeError):
    """No connection, no heartbeat, or silence."""


class ClusterError(BridgeError):
    """No scheduler answers, it has no workers, or one of them has another version of pbpp-rover."""


class LostWorkerError(BridgeError):
    """The process or worker that did a task died, again and again: that task's error."""


class IdentityTakenError(LinkError):
    """Our own system and component id is already heard on the link."""


class VehicleNotFoundError(LinkError):
    """Nobody on the link or in the log is the vehicle asked for."""


class RefusedError(BridgeError):
    """The vehicle refused: its result by name, and the item it refused where there is one."""


class VehicleInUseError(RefusedError):
    """Another pbpp on this computer is writing to the vehicle: which process, and since when."""


class OutcomeError(BridgeError):
    """What is on the vehicle is not what was wanted, or it is unknown."""


class DefectError(OutcomeError):
    """A bug of this program ended a transfer after something was written; its cause is the bug."""


class BackupError(OutcomeError):
    """The vehicle's old list cannot be kept, or a kept one cannot be read."""


class OtherVehicleError(BackupError):
    """The backup is of another vehicle, or cannot be shown to be of this one: nothing is written."""
