"""Rows of a table that say what to plan: CSV, JSON lines or Parquet, read one by one; each becomes the options of a plan."""

from __future__ import annotations

import codecs
import csv
import json
import os
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import replace
from decimal import Decimal
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mavlink_bridge.cli.values import LEAST_MPS, MOST_M, MOST_MPS, checked_number
from mavlink_bridge.dataset.plan_table import read_parquet
from mavlink_bridge.errors import UsageError
from missions.errors import MissionFormatError

if TYPE_CHECKING:
    from mavlink_bridge.cli.options.plan import PlanOptions

Row = Mapping[str, Any]
RowError = MissionFormatError | UsageError

COLUMNS = (
    "name", "fence", "start", "target", "vehicle", "clearance", "corner_allowance", "snap", "speed", "method", "home", "output",
)  # fmt: skip
"""What a row may say. Another column is refused: a misspelt one would be passed over, and a plan made that nobody asked for."""

_MOST_LINE = 10_000  # characters, of which the names of the columns are in a few hundred (chosen)
_SUFFIXES = (".csv", ".jsonl", ".ndjson", ".parquet")


def read_rows(path: Path) -> Iterator[Row | RowError]:
    """Return a table's rows, as they are needed; of a row that says nothing that could be planned, why.

    Raises
    ------
    MissionFormatError, OSError
        The table cannot be read, or not beyond a line.
    UsageError
        It is of another kind, or its first line names a column that rows do not have.
    """
    kind = path.suffix.lower()
    if kind not in _SUFFIXES:
        raise UsageError(f"--batch {path}: expected a table ({', '.join(_SUFFIXES)})")
    rows: Iterator[Row | RowError] = {".csv": _csv_rows, ".parquet": _parquet_rows}.get(kind, _json_rows)(
        path
    )
    outputs: dict[str, int] = {}
    for number, row in enumerate(rows, start=1):
        trouble = row if isinstance(row, Exception) else _trouble(path, number, row, outputs)
        yield row if trouble is None else trouble


def _trouble(path: Path, number: int, row: Row, outputs: dict[str, int]) -> UsageError | None:
    """Return why a row is not planned; note its output."""
    if unknown := _unknown(row):
        return UsageError(f"{path}: row {number}: {unknown}")
    output = str(row.get("output") or "").strip()
    place = os.path.normcase(os.path.normpath(path.parent / output))
    if output and outputs.setdefault(place, number) != number:
        return UsageError(
            f"{path}: row {number}: output {output!r} is that of row {outputs[place]} too: one plan would overwrite the other"
        )
    return None


def _unknown(names: Iterable[str]) -> str:
    """Return what to say of columns that rows do not have; nothing where there are none."""
    unknown = ", ".join(repr(name) for name in names if name not in COLUMNS)
    return f"unknown column {unknown}; columns are {', '.join(COLUMNS)}" if unknown else ""


def _csv_rows(path: Path) -> Iterator[Row | RowError]:
    with path.open("rb") as head:
        is_utf16 = head.read(2) in (
            codecs.BOM_UTF16_LE,
            codecs.BOM_UTF16_BE,
        )  # a spreadsheet's "Unicode text"
    with path.open(encoding="utf-16" if is_utf16 else "utf-8-sig", newline="") as file:
        try:
            first = file.readline(_MOST_LINE)
            file.seek(0)
            reader = csv.DictReader(file, delimiter=max(",;\t", key=first.count), strict=True)
            names = [name.strip() for name in reader.fieldnames or ()]
            if not names:
                raise MissionFormatError(
                    f"{path} is empty; the first line names the columns: {', '.join(COLUMNS)}", file=str(path)
                )
            if twice := sorted({name for name in names if names.count(name) > 1}):
                raise UsageError(f"{path}: column {twice[0]!r} appears twice")
            if unknown := _unknown(names):
                raise UsageError(f"{path}: {unknown}")
            for row in reader:
                if None in row:
                    yield _unreadable(path, reader.line_num, f"more cells than the {len(names)} columns")
                else:
                    yield {name.strip(): value for name, value in row.items()}
        except UnicodeError:
            raise MissionFormatError(
                f"{path} is not a text file; expected UTF-8", file=str(path), advice="save it as CSV in UTF-8"
            ) from None
        except csv.Error as error:
            raise MissionFormatError(f"{path}: line {reader.line_num}: {error}", file=str(path)) from None


def _parquet_rows(path: Path) -> Iterator[Row]:
    for row in read_parquet(path):
        if unknown := _unknown(row):
            raise UsageError(f"{path}: {unknown}")
        yield row


def _json_rows(path: Path) -> Iterator[Row | RowError]:
    with path.open("rb") as file:
        for number, line in enumerate(file, start=1):
            if not line.strip():
                continue
            try:
                row = json.loads(line, object_pairs_hook=_object)
            except (ValueError, RecursionError) as error:
                yield _unreadable(path, number, f"not JSON: {error}")
            else:
                yield row if isinstance(row, dict) else _unreadable(path, number, "expected an object")


def _unreadable(path: Path, line: int, why: str) -> MissionFormatError:
    return MissionFormatError(f"{path}: line {line}: {why}", file=str(path), line=line)


def _object(pairs: list[tuple[str, Any]]) -> Row:
    row = dict(pairs)
    if len(row) < len(pairs):
        raise ValueError("a key appears twice")
    return row


def options_of(row: Row, options: PlanOptions, folder: Path) -> PlanOptions:
    """Return the options of one plan: what the row says, else what the command line says for all.

    Parameters
    ----------
    row : mapping
        The row; an empty cell says nothing.
    options : PlanOptions
        The command's options.
    folder : Path
        The table's: files in the row are named from there.

    Raises
    ------
    UsageError
        A cell is not what it has to be.
    """
    said = {name: value for name, value in row.items() if value not in (None, "", []) and name != "name"}
    read: dict[str, Callable[[Any], object]] = {
        "fence": lambda value: folder / _text(value),
        "vehicle": lambda value: folder / _text(value),
        "output": lambda value: [folder / _text(value)],
        "start": _place,
        "home": _place,
        "target": _places,
        "snap": lambda value: checked_number(_text(value), 0.0, MOST_M, "metres"),
        "speed": lambda value: checked_number(_text(value), LEAST_MPS, MOST_MPS, "metres a second"),
    }
    found: dict[str, Any] = {"output": [], "batch": None}
    for name, value in said.items():
        try:
            found[name] = read.get(name, _text)(value)
        except UsageError as error:
            raise UsageError(f"{name} {value!r}: {error}") from None
    return replace(options, **found)


def _text(value: object) -> str:
    if isinstance(value, bool) or not isinstance(value, (str, int, float, Decimal)):
        raise UsageError("expected a text or a number")
    return str(value).strip()


def _place(value: object) -> str:
    """Return a place as ``--start`` takes it; in JSON and Parquet it may be a list of latitude and longitude."""
    if isinstance(value, (list, tuple)):
        if len(value) != 2:
            raise UsageError("expected a latitude and a longitude")
        return ",".join(map(_text, value))
    return _text(value)


def _places(value: object) -> list[str]:
    """Return places as ``--target`` takes them: in a text with ; between them, in JSON and Parquet one place or a list of them."""
    if isinstance(value, str):
        return [part.strip() for part in value.split(";") if part.strip()]
    if isinstance(value, (list, tuple)) and value and isinstance(value[0], (str, list, tuple)):
        return list(map(_place, value))
    return [_place(value)]
