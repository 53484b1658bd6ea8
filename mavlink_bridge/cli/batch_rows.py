"""Rows of a table that say what to plan: CSV, JSON lines or Parquet, read one by one; each becomes the options of a plan."""

from __future__ import annotations

import csv
import json
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mavlink_bridge.cli.values import LEAST_MPS, MOST_M, MOST_MPS, checked_number
from mavlink_bridge.dataset.plan_table import read_parquet
from mavlink_bridge.errors import UsageError
from missions.errors import MissionFormatError

if TYPE_CHECKING:
    from mavlink_bridge.cli.options.plan import PlanOptions

Row = Mapping[str, Any]

COLUMNS = (
    "name", "fence", "start", "target", "vehicle", "clearance", "corner_allowance", "snap", "speed", "method", "home", "output",
)  # fmt: skip
"""What a row may say. Another column is refused: a misspelt one would be passed over, and a plan made that nobody asked for."""

_SUFFIXES = (".csv", ".jsonl", ".ndjson", ".parquet")


def read_rows(path: Path) -> Iterator[Row]:
    """Return a table's rows, as they are needed.

    Raises
    ------
    MissionFormatError, OSError
        The table, or a line of it, cannot be read.
    UsageError
        It is of another kind, or has a column that rows do not have.
    """
    kind = path.suffix.lower()
    if kind not in _SUFFIXES:
        raise UsageError(f"--batch {path}: expected a table ({', '.join(_SUFFIXES)})")
    rows = {".csv": _csv_rows, ".parquet": read_parquet}.get(kind, _json_rows)(path)
    outputs: dict[str, int] = {}
    for number, row in enumerate(rows, start=1):
        if unknown := [name for name in row if name not in COLUMNS]:
            raise UsageError(
                f"{path}: row {number}: unknown column {', '.join(map(repr, unknown))}; columns are {', '.join(COLUMNS)}"
            )
        output = str(row.get("output") or "").strip()
        if output and outputs.setdefault(output, number) != number:
            raise UsageError(
                f"{path}: row {number}: output {output!r} is that of row {outputs[output]} too: one plan would take the other's place"
            )
        yield row


def _csv_rows(path: Path) -> Iterator[Row]:
    with path.open(encoding="utf-8-sig", newline="") as file:
        reader = csv.DictReader(file, restkey="more cells than columns", strict=True)
        try:
            names = [name.strip() for name in reader.fieldnames or ()]
            if twice := sorted({name for name in names if names.count(name) > 1}):
                raise UsageError(f"{path}: column {twice[0]!r} is there twice")
            for row in reader:
                yield {(name or "").strip(): value for name, value in row.items()}
        except (csv.Error, UnicodeDecodeError) as error:
            raise MissionFormatError(f"{path}: line {reader.line_num}: {error}", file=str(path)) from None


def _json_rows(path: Path) -> Iterator[Row]:
    with path.open("rb") as file:
        for number, line in enumerate(file, start=1):
            if not line.strip():
                continue
            try:
                row = json.loads(line, object_pairs_hook=_object)
            except (ValueError, RecursionError) as error:
                raise MissionFormatError(
                    f"{path}: line {number}: not JSON: {error}", file=str(path)
                ) from None
            if not isinstance(row, dict):
                raise MissionFormatError(
                    f"{path}: line {number}: expected an object", file=str(path), line=number
                )
            yield row


def _object(pairs: list[tuple[str, Any]]) -> Row:
    row = dict(pairs)
    if len(row) < len(pairs):
        raise ValueError("a key is there twice")
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
    if isinstance(value, bool) or not isinstance(value, (str, int, float)):
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
