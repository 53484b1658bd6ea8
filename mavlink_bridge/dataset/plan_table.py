"""Tables of plans as Parquet: rows that say what to plan, and the plans made of them. DuckDB reads and writes them bit by bit."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from mavlink_bridge.dataset.schema import literal
from mavlink_bridge.errors import UsageError

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

_ROWS = 1000
"""Rows read at a time."""

_MEMORY = "256MB"
"""What DuckDB may take (chosen): rows of plans are small, and what does not fit goes to a temporary file."""

_COLUMNS = {
    "row": "BIGINT",
    "name": "VARCHAR",
    "status": "VARCHAR",
    "error": "VARCHAR",
    "message": "VARCHAR",
    "exit_code": "INTEGER",
    "fence_file": "VARCHAR",
    "vehicle_file": "VARCHAR",
    "method": "VARCHAR",
    "start": "DOUBLE[]",
    "targets": "DOUBLE[][]",
    "path": "DOUBLE[][]",
    "length_m": "DOUBLE",
    "straight_line_m": "DOUBLE",
    "duration_s": "DOUBLE",
    "clearance_m": "DOUBLE",
    "start_clearance_m": "DOUBLE",
    "drawn_clearance_m": "DOUBLE",
    "driven_clearance_m": "DOUBLE",
    "planning_s": "DOUBLE",
    "mission_items": "BIGINT",
    "extrapolated": "VARCHAR[]",
    "warnings": "VARCHAR[]",
    "outputs": "VARCHAR[]",
}
"""What of a result's keys a Parquet file has, and as what: the same columns whatever the rows were. JSON lines have them all."""


def read_parquet(path: Path) -> Iterator[dict[str, Any]]:
    """Return the rows of a Parquet file, an empty cell as None.

    Raises
    ------
    UsageError
        DuckDB is not installed.
    OSError
        It cannot be read.
    """
    duckdb = _duckdb(path)
    with duckdb.connect(config={"memory_limit": _MEMORY}) as connection:
        try:
            found = connection.execute("SELECT * FROM read_parquet($1)", [literal(path)])
            names = [column[0] for column in found.description]
            while rows := found.fetchmany(_ROWS):
                for row in rows:
                    yield dict(zip(names, row, strict=True))
        except duckdb.Error as error:
            raise OSError(0, str(error).splitlines()[0], str(path)) from None


def write_parquet(lines: Path, path: Path) -> None:
    """Write results, which stand in a file of JSON lines, as a Parquet file.

    Raises
    ------
    UsageError
        DuckDB is not installed.
    OSError
        It cannot be written.
    """
    duckdb = _duckdb(path)
    columns = ", ".join(f"{name}: '{kind}'" for name, kind in _COLUMNS.items())
    query = f"SELECT * FROM read_json({_quoted(literal(lines))}, format = 'newline_delimited', columns = {{{columns}}})"  # noqa: S608 - our own names
    with duckdb.connect(config={"memory_limit": _MEMORY, "preserve_insertion_order": True}) as connection:
        try:
            connection.execute(f"COPY ({query}) TO {_quoted(path)} (FORMAT parquet, COMPRESSION zstd)")
        except duckdb.Error as error:
            raise OSError(0, str(error).splitlines()[0], str(path)) from None


def check_installed(path: Path) -> None:
    """Find before any work whether a Parquet file can be read or written.

    Raises
    ------
    UsageError
        DuckDB is not installed.
    """
    _duckdb(path)


def _duckdb(path: Path) -> Any:  # noqa: ANN401 - a module without types
    try:
        return import_module("duckdb")
    except ModuleNotFoundError:
        raise UsageError(
            f"{path}: Parquet needs the package duckdb",
            advice="install it with: pip install 'pbpp-rover[data]'",
        ) from None


def _quoted(path: object) -> str:
    return "'" + str(path).replace("'", "''") + "'"
