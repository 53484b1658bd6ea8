"""The journal beside a recorded log: what reached the director otherwise than by frames, so that a replay decides the same.

A JSON line each: first the orders, then every call of the director that is no frame, with its time and the number of frames received before
it, and every event.
"""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any, TextIO

from mavlink_bridge.backup.drive_note import note_from_json, note_to_json
from mavlink_bridge.director import Event, Orders, TargetSource
from mavlink_bridge.director.orders import Homing, ObstacleSource
from mavlink_bridge.errors import LogError
from missions.errors import MissionError
from missions.firmware import read_firmware
from missions.formats.calibration import calibration_from_plain, calibration_to_plain
from missions.geo import LatLon
from missions.request import request_of
from missions.situation import Situation
from missions.stops import Stop, Stops
from missions.vehicle import Footprint

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from mavlink_bridge.backup.drive_note import DriveNote
    from missions.request import Request

_FORMAT = 2  # of the file; others are not read


@dataclass(frozen=True, slots=True)
class Call:
    """A call of the director.

    Parameters
    ----------
    frames : int
        How many frames were received before it.
    time_s : float
        Its time.
    name : str
        Which call: ``start``, ``timer``, ``target``, ``request``, ``obstacle``, ``clear``, ``confirm``, ``drive``, ``withhold``, ``hold``, ``suspect``, ``plan_made``, ``ways_made``, ``backup_stored``,
        ``backup_failed``, ``in_use``, ``note_stored`` or ``note_failed``.
    target : LatLon, optional
        The target that was typed, or where the obstacle is.
    text : str
        The obstacle's radius, the request, who asks for HOLD, where the backup lies, or why there is none, or no note.
    """

    frames: int
    time_s: float
    name: str
    target: LatLon | None = None
    text: str = ""


@dataclass(frozen=True)
class Journal:
    """A journal that was read."""

    orders: Orders
    described: Situation
    calls: tuple[Call, ...]
    notes: tuple[DriveNote, ...] = ()


class JournalWriter:
    """Writes a journal, line by line.

    Parameters
    ----------
    file : text file
        Open for writing.
    orders : Orders
        What the director may do.
    described : Situation
        What was known beforehand: parameters, the firmware's version, how far it rolls on.
    notes : tuple of DriveNote
        The drives that earlier runs had begun.

    Raises
    ------
    LogError
        From every method: it cannot be written.
    """

    def __init__(
        self, file: TextIO, orders: Orders, described: Situation, notes: tuple[DriveNote, ...] = ()
    ) -> None:
        self._file = file
        self._write(
            {
                "journal": _FORMAT,
                "orders": _orders_to_json(orders),
                "parameters": dict(described.parameters),
                "firmware": str(described.firmware) if described.firmware else None,
                "stopping": [[one.speed_mps, one.distance_m] for one in described.stops.given],
                "calibration": calibration_to_plain(described.calibration),
                "drive_notes": [note_to_json(note) for note in notes],
            }
        )

    def call(self, call: Call) -> None:
        """Write a call."""
        entry: dict[str, Any] = {"frames": call.frames, "time_s": call.time_s, "call": call.name}
        if call.target is not None:
            entry["target"] = list(call.target)
        if call.text:
            entry["text"] = call.text
        self._write(entry)

    def event(self, event: Event) -> None:
        """Write an event."""
        self._write({"told": event.as_json()})

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    def _write(self, entry: Mapping[str, Any]) -> None:
        try:
            self._file.write(json.dumps(entry) + "\n")
            self._file.flush()
        except OSError as error:
            raise LogError(f"{self._file.name}: {error.strerror}", path=self._file.name) from error


def journal_path(log: Path) -> Path:
    """Return where the journal of a log lies."""
    return log.with_suffix(".journal.jsonl")


def read_journal(path: Path) -> Journal:
    """Read a journal.

    Raises
    ------
    LogError
        It cannot be read; the message says at which line.
    """
    calls: list[Call] = []
    line_number = 1
    try:
        lines = path.read_text(encoding="utf-8").splitlines()
        head = json.loads(lines[0])
        if head["journal"] != _FORMAT:
            raise LogError(f"{path}: journal format {head['journal']!r}; expected {_FORMAT}")
        orders = _orders_from_json(head["orders"])
        firmware = read_firmware(head["firmware"]) if head.get("firmware") else None
        given = tuple(Stop(*one) for one in head.get("stopping", ()))
        notes = tuple(map(note_from_json, head.get("drive_notes", ())))
        described = Situation(
            parameters=head["parameters"],
            firmware=firmware,
            stops=Stops(given),
            calibration=calibration_from_plain(head.get("calibration")),
        )
        for line_number, line in enumerate(lines[1:], start=2):  # noqa: B007 - told where it fails
            entry = json.loads(line)
            if "told" in entry:  # for people: a replay tells its own
                continue
            target = LatLon(*entry["target"]) if "target" in entry else None
            calls.append(
                Call(entry["frames"], entry["time_s"], entry["call"], target, str(entry.get("text", "")))
            )
    except OSError as error:
        raise LogError(f"{path} cannot be read: {error.strerror}", file=str(path)) from None
    except (ValueError, KeyError, TypeError, IndexError, MissionError) as error:
        raise LogError(
            f"{path}: line {line_number} is not a journal entry: {error!r}", file=str(path)
        ) from None
    return Journal(orders, described, tuple(calls), notes)


def request_to_text(request: Request) -> str:
    """Return a request as the text of a call."""
    return json.dumps(_request_to_json(request))


def request_from_text(text: str) -> Request:
    """Return the request that a call's text is."""
    return _request_from_json(json.loads(text))


def _request_to_json(request: Request) -> dict[str, Any]:
    words = request.words()
    return {**words, "footprint": asdict(words["footprint"])}


def _request_from_json(document: dict[str, Any]) -> Request:
    return request_of(**{**document, "footprint": Footprint(**document.get("footprint", {}))})


def _orders_to_json(orders: Orders) -> dict[str, Any]:
    document = asdict(orders)
    document["request"] = _request_to_json(orders.request)
    document["target_sources"] = sorted(orders.target_sources)
    document["obstacle_sources"] = sorted(orders.obstacle_sources)
    return document


def _orders_from_json(document: dict[str, Any]) -> Orders:
    homing = document.get("homing", {})
    places = {name: LatLon(*place) for name, place in homing.get("places", {}).items()}
    return Orders(
        **{
            **document,
            "homing": Homing(**{**homing, "places": places}),
            "identity": tuple(document["identity"]) if document["identity"] else None,
            "target_sources": frozenset(TargetSource(name) for name in document["target_sources"]),
            "obstacle_sources": frozenset(map(ObstacleSource, document.get("obstacle_sources", ()))),
            "request": _request_from_json(document["request"]),
        }
    )
