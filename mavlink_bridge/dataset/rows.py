"""From a log to the rows of a dataset: those of ``pbpp log --json``, and its positions."""

from __future__ import annotations

import datetime as dt
import hashlib
import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from mavlink_bridge.dataset.schema import TABLES
from mavlink_bridge.errors import LogError
from mavlink_bridge.logbook import read_logbook
from mavlink_bridge.logbook.document import as_document

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from numpy.typing import NDArray

    from mavlink_bridge.logbook.track import TrackFix
    from mavlink_bridge.many import Task

Row = tuple[Any, ...]
UNDATED: Final = "undated"
_EPOCH = dt.datetime(1970, 1, 1, tzinfo=dt.UTC)
_CHECKSUM_DIGITS = (
    16  # of a log's name in the tables: two of 10 million logs share them with a chance of 3e-6
)
_SITE_DIGITS = 2  # 0.01 degrees of latitude are 1.1 km; chosen: fields of one farm share a site


@dataclass(frozen=True, slots=True)
class FileMark:
    """A file as it was found: enough to know it again without reading it."""

    path: str
    size_bytes: int
    changed_ns: int


@dataclass(slots=True)
class LogRows:
    """The rows of one log.

    Parameters
    ----------
    file : FileMark
    log : str
        Its name in the tables.
    month : str
        The partition it belongs to.
    rows : dict of str to list
        By table; each row has the table's columns, those of partitioned tables and the vehicle behind them.
    problem : str or None
        Why it could not be read.
    """

    file: FileMark
    log: str
    month: str = UNDATED
    rows: dict[str, list[Row]] = field(default_factory=dict)
    problem: str | None = None


def mark_of(path: Path) -> FileMark:
    """Return a file as it is found.

    Raises
    ------
    OSError
        It cannot be looked at.
    """
    status = path.stat()
    return FileMark(str(path), status.st_size, status.st_mtime_ns)


def checksum_of(path: Path) -> str:
    """Return the SHA-256 of a file in hexadecimal digits."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def log_name(checksum: str) -> str:
    """Return how a log is called in the tables."""
    return checksum[:_CHECKSUM_DIGITS]


def read_rows(task: Task[tuple[FileMark, ...]]) -> list[LogRows]:
    """Return the rows of a few logs: what a worker does. A log that cannot be read is a row with its reason.

    Parameters
    ----------
    task : Task
        The files as they were found, and where they are read.
    """
    return [rows_of(path, mark) for path, mark in zip(task.files, task.asked, strict=True)]


def rows_of(path: Path, mark: FileMark) -> LogRows:
    """Return the rows of a log."""
    try:
        checksum = checksum_of(path)
    except OSError as error:
        # It has no checksum to be known by: its path stands in, and it is looked at again the next time.
        found = LogRows(mark, "", problem=f"cannot be read: {error.strerror or error}")
        found.rows["logs"] = [_bad_log("", mark, found.problem or "")]
        return found
    found = LogRows(mark, log_name(checksum))
    track = _Positions()
    try:
        document = as_document(read_logbook(path, on_track=track.take))
    except LogError as error:
        found.problem = str(error).replace(str(path), mark.path)
    except Exception as error:  # noqa: BLE001 - one log's trouble must not stop the others; it is told with its kind
        found.problem = f"internal error, a bug in pbpp: {type(error).__name__}: {error}"
    if found.problem is not None:
        found.rows["logs"] = [_bad_log(checksum, mark, found.problem)]
        return found
    found.month = month_of(document)
    found.rows = {name: list(rows) for name, rows in document_rows(document, checksum, mark).items()}
    found.rows["positions"] = list(track.rows(found.log))
    return found


def month_of(document: Mapping[str, Any]) -> str:
    """Return the partition of a log."""
    begins = _date(document)
    return UNDATED if begins is None else f"{begins:%Y-%m}"


def _date(document: Mapping[str, Any]) -> dt.datetime | None:
    if not document["has_timestamps"]:
        return None
    try:
        return _EPOCH + dt.timedelta(seconds=document["begins_s"])
    except OverflowError:
        return None  # a clock far off


def document_rows(document: Mapping[str, Any], checksum: str, mark: FileMark) -> dict[str, list[Row]]:
    """Return the rows of all tables but ``files`` and ``positions``, from the document of ``pbpp log --json``."""
    log, begins = log_name(checksum), _date(document)
    begins_s = document["begins_s"] if begins is not None else None
    damage = document["damage"]
    rows: dict[str, list[Row]] = {name: [] for name in TABLES if name not in ("files", "logs", "positions")}
    rows["logs"] = [
        (
            *(log, checksum, document["log"], mark.size_bytes, None, begins_s, document["duration_s"]),
            *(document["has_timestamps"], document["clock_jumps"], document["clock_trouble"]),
            *(damage[name] for name in _DAMAGE),
            len(document["vehicles"]),
        )
    ]
    heard = {vehicle["system"] for vehicle in document["vehicles"]}
    for sent in document["messages"]:
        told = (sent["system"], sent["component"], sent["id"], sent["name"], sent["count"], sent["rate_hz"])
        # What others than a vehicle send stands in the partition of the first vehicle that was heard.
        vehicle = sent["system"] if sent["system"] in heard else min(heard, default=0)
        rows["messages"].append((log, *told, vehicle))
    for vehicle in document["vehicles"]:
        for name, row in _vehicle_rows(vehicle, log, begins_s):
            rows[name].append((*row, vehicle["system"]))
    return rows


_DAMAGE = (
    *("frames", "unknown_ids", "bad_crcs", "gaps", "skipped_bytes", "orphan_timestamps", "untimed_frames"),
    *("wrong_timestamps", "truncated_bytes", "broken_gzip"),
)
_ZONES = ("inclusion_polygons", "exclusion_polygons", "inclusion_circles", "exclusion_circles", "vertices")


def _bad_log(checksum: str, mark: FileMark, problem: str) -> Row:
    known = (log_name(checksum), checksum, Path(mark.path).name, mark.size_bytes, problem)
    return (*known, *(None,) * (len(TABLES["logs"].columns) - len(known)))


def _vehicle_rows(vehicle: Mapping[str, Any], log: str, begins_s: float | None) -> Iterator[tuple[str, Row]]:
    """Yield the rows of one vehicle, each with its table."""
    yield "vehicles", _vehicle_row(vehicle, log, begins_s)
    yield from _drive_rows(vehicle, log)
    for breach in vehicle["intrusions"]:
        deepest = (breach["begun_s"], breach["ended_s"], breach["deepest_m"], *breach["position"])
        yield "breaches", (log, "track", *deepest, *breach["begun_at"], breach["zone"], None, None)
    for breach in vehicle["reported_breaches"]:
        told = (breach["count"], breach["breach_type"])
        yield "breaches", (log, "autopilot", breach["time_s"], *(None,) * 7, *told)
    for target in vehicle["targets"]:
        place = (target["time_s"], *target["position"])
        yield "targets", (log, *place, target["source"], *target["station"], target["said"])
    for transfer in vehicle["transfers"]:
        times = (transfer["begun_s"], transfer["ended_s"], transfer["announced"], transfer["seen"])
        who = transfer["station"] or (None, None)
        end = (transfer["ending"], transfer["result"], transfer["repeats"])
        yield "transfers", (log, transfer["kind"], transfer["way"], *who, *times, *end)
    for span in vehicle["modes"]:
        yield "modes", (log, *(span[name] for name in TABLES["modes"].names[1:]))
    for name, value in vehicle["parameters"].items():
        yield "parameters", (log, name, value)
    yield from _event_rows(vehicle, log)


def _vehicle_row(vehicle: Mapping[str, Any], log: str, begins_s: float | None) -> Row:
    fences, near = vehicle["fences"], vehicle["nearest"]
    last = [fences[-1][name] for name in _ZONES] if fences else [None] * len(_ZONES)
    nearest = (near["clearance_m"], near["time_s"], *near["position"], near["zone"]) if near else (None,) * 5
    return (
        *(log, begins_s, site_of(vehicle), vehicle["component"], vehicle["mav_type"]),
        vehicle["firmware"],
        *(vehicle["home"] or (None, None)),
        *(vehicle["mission_items"], vehicle["rally_points"], len(fences), *last, vehicle["fence_trouble"]),
        *(vehicle["driven_m"], vehicle["positions"], vehicle["positions_without_fix"]),
        *(vehicle["targets_seen"], vehicle["parameters_seen"], *nearest),
    )


def site_of(vehicle: Mapping[str, Any]) -> str | None:
    """Return where a vehicle is: its home, else its position, rounded to about a kilometre; None where neither is known."""
    place = vehicle["home"] or vehicle["position"]
    return None if place is None else ",".join(f"{round(angle, _SITE_DIGITS) + 0:.2f}" for angle in place)


def _drive_rows(vehicle: Mapping[str, Any], log: str) -> Iterator[tuple[str, Row]]:
    for number, drive in enumerate(vehicle["drives"], start=1):
        key = (log, number)
        rest = (drive[name] for name in TABLES["drives"].names[4:])
        yield "drives", (*key, drive["begun_s"], site_of(vehicle), *rest)
        told = drive["foreseen"] or {}
        yield (
            "grades",
            (
                *key,
                *(drive[_key(name)] for name in TABLES["grades"].names[2:7]),
                *(told.get(name) for name in ("took_s", "least_clearance_m", "deviation_m")),
                "; ".join(drive["notes"]) or None,
            ),
        )
        for leg_number, leg in enumerate(drive["legs"], start=1):
            yield "legs", (*key, leg_number, *(leg[_key(name)] for name in TABLES["legs"].names[3:]))


def _key(column: str) -> str:
    """Return how a column is called in the document, which keeps the code's word."""
    return column.replace("predicted", "foreseen")


def _event_rows(vehicle: Mapping[str, Any], log: str) -> Iterator[tuple[str, Row]]:
    for change in vehicle["parameter_changes"]:
        name, values = change["name"], (change["before"], change["after"])
        text = f"{name} {values[0]} → {values[1]}"
        yield "events", (log, change["time_s"], "parameter", name, text, *values)
    for fence in vehicle["fences"]:
        zones = sum(fence[name] for name in _ZONES[:4])
        text = f"{zones} zones, {fence['vertices']} vertices"
        yield "events", (log, fence["time_s"], "fence", str(zones), text, None, None)
    for note in vehicle["notes"]:
        yield "events", (log, None, "note", None, note, None, None)


class _Positions:
    """Collects the positions of a log."""

    def __init__(self) -> None:
        self._rows: list[Row] = []

    def take(
        self,
        system: int,
        mode: str,
        armed: bool,  # noqa: FBT001 - as the recorder calls it
        fixes: Sequence[TrackFix],
        clearances_m: NDArray[Any] | None,
    ) -> None:
        """Take positions of one vehicle, in one mode; those without a fix stand at no place."""
        kept_m = [None] * len(fixes) if clearances_m is None else clearances_m.tolist()
        for fix, clearance_m in zip(fixes, kept_m, strict=True):
            is_placed = not math.isnan(fix.position.lat_deg)
            place = fix.position if is_placed else (None, None)
            moves = (fix.speed_mps, fix.heading_deg, fix.item, mode, armed)
            near_m = None if clearance_m is None or math.isinf(clearance_m) else clearance_m
            self._rows.append((fix.time_s, fix.boot_s, *place, *moves, near_m, system))

    def rows(self, log: str) -> Iterator[Row]:
        """Yield the rows, in the order of time."""
        for row in sorted(self._rows, key=lambda row: (row[-1], row[0])):
            yield (log, *row)
