"""The events that a replay is expected to report, and how its own differ from those.

An expectation is a file of JSON lines, one an event. Of each event only the keys that stand there count, so that lines can be shortened by hand
to what matters.
"""

from __future__ import annotations

import difflib
import json
import math
from typing import TYPE_CHECKING, Any, Final

from mavlink_bridge.errors import LogError

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence
    from pathlib import Path

_WORDING: Final = ("log", "severity", "text", "info", "warnings")
_DETAILS: Final = ("details", "path", "waypoints", "drawn_clearance_m", "duration_s")
"""Left out of recorded expectations: wording, and details of routes and errors, which may change for the better."""

_TOLERANCES: Final = {"time_s": 1e-3, "position": 2e-7, "path": 2e-7}  # a millisecond, and two units of degE7
_TOLERANCE: Final = 0.02
"""How far numbers may lie apart: times in seconds, positions in degrees, all others in metres and seconds. Counts must be equal."""

_SHARES: Final = {"length_m": 0.05}
"""What may differ by a share: another route of nearly the same length is the same decision."""


def expectation_path(log: Path) -> Path:
    """Return where the expectation of a log lies: beside it."""
    return log.with_suffix(".events.jsonl")


def to_expect(events: Sequence[Mapping[str, Any]]) -> str:
    """Return the text of an expectation file for a replay's events."""
    left_out = {*_WORDING, *_DETAILS}
    kept = [{key: value for key, value in event.items() if key not in left_out} for event in events]
    return "".join(json.dumps(event) + "\n" for event in kept)


def read_expectation(path: Path) -> list[dict[str, Any]]:
    """Read an expectation file.

    Raises
    ------
    LogError
        It cannot be read, or a line is no JSON object.
    """
    try:
        lines = path.read_text(encoding="utf-8").splitlines()
    except OSError as error:
        raise LogError(f"{path} cannot be read: {error.strerror}", file=str(path)) from None
    except UnicodeDecodeError:
        raise LogError(f"{path} is not a text file; expected JSON lines", file=str(path)) from None
    events = []
    for number, line in enumerate(lines, start=1):
        if not line.strip():
            continue
        try:
            event = json.loads(line)
        except ValueError as error:
            raise LogError(f"{path}: line {number}: not JSON: {error}", file=str(path)) from None
        if not isinstance(event, dict):
            raise LogError(f"{path}: line {number}: not an event: {line[:40]}", file=str(path))
        events.append(event)
    return events


def differences(expected: Sequence[Mapping[str, Any]], told: Sequence[Mapping[str, Any]]) -> list[str]:
    """Return line by line where the events differ from the expected ones; nothing where all is as it should be.

    ``-`` stands before events that were expected and did not come, ``+`` before others that came, ``~`` before those that came otherwise.
    """
    names = [[(event.get("event"), event.get("log")) for event in events] for events in (expected, told)]
    if any("log" not in event for event in expected):
        names = [[(name, None) for name, _ in events] for events in names]
    matcher = difflib.SequenceMatcher(None, names[0], names[1], autojunk=False)
    found: list[str] = []
    for tag, first, last, told_first, told_last in matcher.get_opcodes():
        if tag == "equal":
            pairs = zip(expected[first:last], told[told_first:told_last], strict=True)
            found += [line for one, other in pairs for line in _changes(one, other)]
        else:
            found += [f"- {_line(event)}" for event in expected[first:last]]
            found += [f"+ {_line(event)}" for event in told[told_first:told_last]]
    return found


def _changes(expected: Mapping[str, Any], told: Mapping[str, Any]) -> Iterator[str]:
    for key, value in expected.items():
        if key not in told:
            yield f"~ {_head(told)}: {key} expected {_short(value)}, missing"
        elif not _is_same(value, told[key], _tolerance(key, value)):
            yield f"~ {_head(told)}: {key} expected {_short(value)}, got {_short(told[key])}"


def _tolerance(key: str, value: Any) -> float:  # noqa: ANN401 - any JSON value
    if key in _SHARES and isinstance(value, float | int):
        return _SHARES[key] * abs(value)
    return _TOLERANCES.get(key, _TOLERANCE)


def _is_same(one: Any, other: Any, tolerance: float) -> bool:  # noqa: ANN401 - any JSON value
    if isinstance(one, dict) and isinstance(other, dict):
        return one.keys() == other.keys() and all(_is_same(one[key], other[key], tolerance) for key in one)
    if isinstance(one, list | tuple) and isinstance(other, list | tuple):
        return len(one) == len(other) and all(
            _is_same(a, b, tolerance) for a, b in zip(one, other, strict=True)
        )
    if isinstance(one, float) or isinstance(other, float):
        are_numbers = isinstance(one, float | int) and isinstance(other, float | int)
        return are_numbers and math.isclose(one, other, rel_tol=0.0, abs_tol=tolerance + 1e-9)
    return bool(one == other)


def _head(event: Mapping[str, Any]) -> str:
    log = f"{event['log']} " if "log" in event else ""
    return f"{log}{event.get('time_s')} {event.get('event')}"


def _line(event: Mapping[str, Any]) -> str:
    rest = {key: value for key, value in event.items() if key not in ("time_s", "event", "path", *_WORDING)}
    return f"{_head(event)} {_short(rest)}"


def _short(value: Any) -> str:  # noqa: ANN401 - any JSON value
    text = json.dumps(value)
    return text if len(text) <= 120 else f"{text[:117]}..."
