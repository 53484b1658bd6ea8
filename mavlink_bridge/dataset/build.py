"""Building a dataset from folders of logs: what is new is read, in batches that are kept as they are done."""

from __future__ import annotations

from collections import defaultdict
from contextlib import closing
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from mavlink_bridge.dataset.rows import FileMark, LogRows, checksum_of, log_name, mark_of, read_rows
from mavlink_bridge.dataset.schema import TABLES
from mavlink_bridge.errors import DatasetError
from mavlink_bridge.many import Task

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Sequence

    from mavlink_bridge.dataset.store import Dataset
    from mavlink_bridge.many import Workers

SUFFIXES: Final = (".tlog", ".raw", ".bin", ".gz")
"""Names of files in a folder that are taken for logs; a file that is named itself is taken whatever its name."""

_A_TASK: Final = 8
"""Logs that a worker reads at once: their rows are some hundred kilobytes. Chosen, not measured."""

_A_BATCH: Final = 96
"""Logs whose rows are put on the disk together; so many are read again after a kill. Chosen, not measured."""

_A_LOAD: Final = 2000
"""Logs that are published together: each load makes a file for each table, month and vehicle. Chosen, not measured."""


@dataclass(slots=True)
class Progress:
    """How far a build is.

    Parameters
    ----------
    files : int
        Files in all.
    known : int
        Files skipped: in the dataset already, by path, size and time of change, or by checksum.
    read : int
        Logs read so far.
    size_bytes : int
        Of the logs read.
    bad : list of (str, str)
        Logs that could not be read, and why: those read now, and known ones.
    """

    files: int = 0
    known: int = 0
    read: int = 0
    size_bytes: int = 0
    bad: list[tuple[str, str]] = field(default_factory=list)

    @property
    def done(self) -> int:
        """Files that need no more work."""
        return self.known + self.read


def log_files(places: Iterable[Path]) -> list[Path]:
    """Return the logs in folders and below, and files that are named themselves, in the order of their names.

    Raises
    ------
    DatasetError
        There is no such folder or file.
    """
    found: dict[Path, None] = {}
    for place in places:
        if place.is_dir():
            inside = (path for path in place.rglob("*") if path.suffix.lower() in SUFFIXES and path.is_file())
            found.update(dict.fromkeys(sorted(inside)))
        elif place.exists():
            found[place] = None
        else:
            raise DatasetError(f"{place}: no such folder or file", place=str(place), advice="check the path")
    return list({path.resolve(): None for path in found})


def build(
    dataset: Dataset,
    paths: Sequence[Path],
    workers: Workers,
    show: Callable[[Progress], None] = lambda _: None,
) -> Progress:
    """Read the logs that a dataset does not hold, and add them.

    What is done stays done, however the build ends: started again it goes on, and comes to the same rows.

    Parameters
    ----------
    dataset : Dataset
    paths : sequence of Path
    workers : Workers
        Who reads them.
    show : callable, optional
        Told how far it is.

    Raises
    ------
    DatasetError
        The dataset is of another version, or there is no DuckDB.
    """
    with dataset.readable(), closing(dataset):
        database = dataset.begin()
        progress = Progress(files=len(paths))
        known = _Known(dataset, database)
        batch = _Batch()
        for done in workers.results(read_rows, _tasks(paths, known, batch, progress, show), in_order=False):
            found = (
                done.value if done.error is None else [_lost(mark, done.error) for mark in done.task.asked]
            )
            for log in found or ():
                batch.add(log, is_new=known.take(log))
                progress.read += 1
                progress.size_bytes += log.file.size_bytes
                if log.problem is not None:
                    progress.bad.append((log.file.path, log.problem))
            show(progress)
            if batch.logs >= _A_BATCH:
                dataset.stage(database, batch.rows)
                batch = batch.emptied()
                if dataset.staged_logs * _A_BATCH >= _A_LOAD:
                    dataset.publish(database)
        if batch.rows:
            dataset.stage(database, batch.rows)
        superseded = known.superseded()
        if dataset.staged_logs or superseded:
            dataset.publish(database, superseded)
        database.close()
        dataset.end()
    return progress


class _Known:
    """What the dataset holds already."""

    def __init__(self, dataset: Dataset, database: Any) -> None:  # noqa: ANN401 - a duckdb connection
        self.files: dict[str, tuple[FileMark, str]] = {}
        self.logs: dict[str, str | None] = {}  # with their problems
        self._held: set[str] = set()  # by files that hold another log now
        for path, size_bytes, changed_ns, log, problem in dataset.known_files(database):
            before = self.files.get(path)
            if before is None or before[1] != log or before[0].changed_ns < changed_ns:
                self.hold(FileMark(path, size_bytes, changed_ns), log)
            self.logs[log] = problem

    def hold(self, mark: FileMark, log: str) -> None:
        """Note which log a file holds."""
        _, before = self.files.get(mark.path, (None, log))
        if before != log:
            self._held.add(before)
        self.files[mark.path] = mark, log

    def superseded(self) -> set[str]:
        """Return the logs that no file holds any more since another took their place; those of files that are gone stay."""
        return self._held - {log for _, log in self.files.values()}

    def take(self, log: LogRows) -> bool:
        """Note a log that was read; return whether its rows are new."""
        if not log.log:
            return True
        is_new = log.log not in self.logs
        self.logs[log.log] = log.problem
        return is_new


def _tasks(
    paths: Sequence[Path],
    known: _Known,
    batch: _Batch,
    progress: Progress,
    show: Callable[[Progress], None],
) -> Iterator[Task[tuple[FileMark, ...]]]:
    """Yield the work: a few logs at a time that the dataset does not hold."""
    waiting: list[FileMark] = []
    for path in paths:
        mark = _new_mark(path, known, batch, progress)
        if mark is None:
            show(progress)
            continue
        waiting.append(mark)
        if len(waiting) == _A_TASK:
            yield _task(waiting)
            waiting = []
    if waiting:
        yield _task(waiting)


def _task(marks: Sequence[FileMark]) -> Task[tuple[FileMark, ...]]:
    return Task(tuple(marks), tuple(Path(mark.path) for mark in marks))


def _new_mark(path: Path, known: _Known, batch: _Batch, progress: Progress) -> FileMark | None:
    """Return a file that is to be read; None where its log is in the dataset already."""
    try:
        mark = mark_of(path)
    except OSError:
        return FileMark(str(path), 0, 0)  # what reads it says why not
    before, log = known.files.get(mark.path, (None, ""))
    if before != mark or not log:
        if not known.logs:
            return mark
        # By another name, or changed since: its content decides.
        log = _checked_log(path)
        known.hold(mark, log)
        if log not in known.logs:
            return mark
        batch.add_file(mark, log)
    problem = known.logs[log]
    progress.known += 1
    if problem is not None:
        progress.bad.append((mark.path, problem))
    return None


def _checked_log(path: Path) -> str:
    try:
        return log_name(checksum_of(path))
    except OSError:
        return ""


def _lost(mark: FileMark, error: Exception) -> LogRows:
    """Return the row of a log whose worker was lost."""
    found = LogRows(mark, "", problem=f"its worker was lost: {error}")
    empty = (None,) * (len(TABLES["logs"].columns) - 5)
    found.rows["logs"] = [("", "", Path(mark.path).name, mark.size_bytes, found.problem, *empty)]
    return found


class _Batch:
    """The rows that wait to be staged."""

    def __init__(self) -> None:
        self.rows: dict[str, list[tuple[Any, ...]]] = defaultdict(list)
        self.logs = 0

    def add(self, log: LogRows, *, is_new: bool) -> None:
        """Add a log's rows; those of a log that is there under another name are left out."""
        self.logs += 1
        if log.log:
            self.add_file(log.file, log.log)
        for name, rows in log.rows.items() if is_new and log.log else ():
            if TABLES[name].is_partitioned:
                self.rows[name] += [(*row[:-1], log.month, row[-1]) for row in rows]
            else:
                self.rows[name] += rows

    def add_file(self, mark: FileMark, log: str) -> None:
        """Note that a file holds a log."""
        self.rows["files"].append((mark.path, mark.size_bytes, mark.changed_ns, log))

    def emptied(self) -> _Batch:
        """Empty it for the next rows; what yields tasks holds on to it."""
        self.rows = defaultdict(list)
        self.logs = 0
        return self
