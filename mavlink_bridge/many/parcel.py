"""A task on its way to another machine: with the files it reads, if that machine does not see them itself."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from dataclasses import dataclass, replace
from importlib.metadata import version
from pathlib import Path
from typing import Any

from mavlink_bridge.many.task import Outcome, Task, outcome_of

PACKAGE = "pbpp-rover"


@dataclass(frozen=True, slots=True)
class SentFile:
    """A file as its sender sees it, and what is in it where that is sent too."""

    path: Path
    mark: tuple[int, int] | None
    """Size and time of change in nanoseconds: what a file must show at the same path to be the same. None where there is no such file."""
    content: bytes | None = None

    def is_here(self) -> bool:
        """Return whether the same file is seen here at the same path."""
        return mark_of(self.path) == self.mark


@dataclass(frozen=True, slots=True)
class Parcel:
    """A task, its files, and the version of pbpp-rover that sends it."""

    task: Task[Any]
    files: tuple[SentFile, ...]
    version: str


@dataclass(frozen=True, slots=True)
class Refused:
    """What a worker hands back instead of an outcome: it does not see the files, or has another version."""

    version: str | None = None
    """Its version, if that is why."""


def mark_of(path: Path) -> tuple[int, int] | None:
    """Return a file's size and time of change; None if there is none."""
    try:
        status = path.stat()
    except OSError:
        return None
    return status.st_size, status.st_mtime_ns


def parcel_of(task: Task[Any], *, with_content: bool) -> Parcel:
    """Return a task as it is sent; a file that cannot be read is left to the function, whose error says so.

    Its files are named by their whole paths: a worker's own folder is another one.
    """
    files = []
    for path in (file.absolute() for file in task.files):
        mark, content = mark_of(path), None
        if with_content and mark is not None:
            try:
                content = path.read_bytes()
            except OSError:
                mark = None
        files.append(SentFile(path, mark, content))
    return Parcel(task, tuple(files), version(PACKAGE))


def open_parcel(function: Callable[[Task[Any]], Any], parcel: Parcel) -> Outcome[Any] | Refused:
    """Do the task on the worker, with the files where they are or with copies of them, which are taken away again."""
    own = version(PACKAGE)
    if own != parcel.version:
        return Refused(own)
    if all(file.content is None for file in parcel.files):
        if not all(file.is_here() for file in parcel.files):
            return Refused()
        return outcome_of(function, parcel.task)
    with tempfile.TemporaryDirectory(prefix="pbpp-") as folder:
        paths = _unpacked(parcel.files, Path(folder))
        outcome = outcome_of(function, replace(parcel.task, files=tuple(paths.values())))
        if outcome.error is not None:
            _rename(
                outcome.error,
                {str(copy): str(path) for path, copy in zip(parcel.task.files, paths.values(), strict=True)},
            )
    return outcome


def _unpacked(files: tuple[SentFile, ...], folder: Path) -> dict[Path, Path]:
    """Write copies of the files, those of one folder into one folder; return where each of them is."""
    folders = {
        parent: folder / str(number)
        for number, parent in enumerate(dict.fromkeys(file.path.parent for file in files))
    }
    paths = {file.path: folders[file.path.parent] / file.path.name for file in files}
    for file in files:
        if file.content is not None:
            paths[file.path].parent.mkdir(exist_ok=True)
            paths[file.path].write_bytes(file.content)
    return paths


def _rename(error: Exception, names: dict[str, str]) -> None:
    """Name in an error the files that its reader knows, not the copies."""

    def renamed(value: object) -> object:
        if isinstance(value, str):
            for copy, name in names.items():
                value = value.replace(copy, name)
        return value

    error.args = tuple(map(renamed, error.args))
    details = getattr(error, "details", None)
    if isinstance(details, dict):
        details.update({key: renamed(value) for key, value in details.items()})
