"""What tests have workers do, here and in other processes."""

from __future__ import annotations

import os
import threading
import time
from pathlib import Path

from mavlink_bridge.errors import LogError


def square(task):
    return task.asked**2


def square_or_raise(task):
    if task.asked % 5 == 3:
        raise ValueError(f"{task.asked} is not liked")
    return task.asked**2


def square_or_die(task):
    if task.asked == 3:
        os._exit(9)
    return task.asked**2


def raise_what_nobody_can_pickle(task):
    error = ValueError("held by a lock")
    error.lock = threading.Lock()
    raise error


def slow(task):
    """Note that it was done, after a while."""
    seconds, folder = task.asked
    time.sleep(seconds)
    (Path(folder) / f"{os.getpid()}-{time.monotonic_ns()}").touch()
    return os.getpid()


def read(task):
    if not task.files[0].read_bytes():
        raise ValueError(f"{task.files[0]} is empty")
    return [file.read_text() for file in task.files], [file.name for file in task.files]


def refuse(task):
    raise LogError("not liked", file=str(task.files[0]), line=3)
