"""A dataset on the disk: Parquet files by table, month and vehicle, and the list of those that count.

What a build adds is first staged (whole folders, put in their place by one rename), then published: the new files are moved into the tables'
folders and the list is replaced, in one step. Whatever is in those folders and not on the list was left by a build that was killed, and goes when
the next one begins; so a dataset is at any time that before the step or that after it.
"""

from __future__ import annotations

import json
import math
import os
import secrets
import shutil
from contextlib import contextmanager
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any, Final

import numpy as np

from mavlink_bridge.backup.vehicle_lock import lock_file
from mavlink_bridge.dataset.schema import PARTITION, SCHEMA_VERSION, TABLES, VIEWS, literal
from mavlink_bridge.errors import DatasetError
from missions.formats.files import write_file

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence

    from numpy.typing import NDArray

    from mavlink_bridge.dataset.rows import Row
    from mavlink_bridge.dataset.schema import Column, Table

LIST_NAME: Final = "pbpp-dataset.json"
_PARTITIONED: Final = tuple(f"{one.name}=" for one in PARTITION)
"""How the names of a table's own folders begin."""

_STAGING, _INCOMING, _SCRATCH, _LOCK = ".staging", ".incoming", ".scratch", ".lock"
_MEMORY: Final = "160MB"
"""What DuckDB may hold; beyond, it writes to the scratch folder. Chosen: with the workers below 400 MB."""

_MOST_PARTS: Final = 8
"""A partition in more files than this is written into one. Chosen, not measured."""

_ROW_GROUP: Final = (
    122_880  # rows of a Parquet row group, DuckDB's own default: named, so that memory stays as measured
)


def connection(scratch: Path | None = None) -> Any:  # noqa: ANN401 - duckdb has its own types, and may not be there
    """Return a DuckDB database in memory.

    Raises
    ------
    DatasetError
        DuckDB is not installed.
    """
    if find_spec("duckdb") is None:
        raise DatasetError(
            "datasets need the package duckdb, which is not installed",
            advice="install it with: pip install 'pbpp-rover[data]'",
        )
    found = import_module("duckdb").connect()
    found.execute(f"SET memory_limit = '{_MEMORY}'")
    found.execute("SET threads = 1")  # more memory and no sooner done on the few rows of a load
    found.execute("SET preserve_insertion_order = true")
    if scratch is not None:
        scratch.mkdir(parents=True, exist_ok=True)
        found.execute(f"SET temp_directory = {quoted(scratch)}")
    return found


def words_of_duckdb(error: Exception) -> str | None:
    """Return in one line what DuckDB says; None of another error."""
    if type(error).__module__.partition(".")[0] not in ("duckdb", "_duckdb"):
        return None
    return " ".join(str(error).split())


def quoted(text: object) -> str:
    """Return a text as SQL writes it."""
    return "'" + str(text).replace("'", "''") + "'"


class Dataset:
    """A dataset's folder.

    Parameters
    ----------
    folder : Path

    Raises
    ------
    DatasetError
        There is something else in the folder, or a dataset of another version.
    """

    def __init__(self, folder: Path) -> None:
        if named := [part for part in folder.parts if part.startswith(_PARTITIONED)]:
            raise DatasetError(
                f"{folder}: DuckDB reads a folder's name {named[0]!r} for the rows' own",
                folder=str(folder),
                advice="choose a folder with another name",
            )
        self.folder = folder
        self._files: dict[str, list[str]] = {name: [] for name in TABLES}
        self._published: list[str] = []
        self._lock: IO[bytes] | None = None
        if (folder / LIST_NAME).is_file():
            self._read_list()
        elif folder.exists() and (not folder.is_dir() or not _is_ours(folder)):
            raise DatasetError(
                f"{folder} is not a dataset: it holds other files",
                folder=str(folder),
                advice="choose a new folder, or one that `pbpp logs build` made",
            )

    @property
    def is_there(self) -> bool:
        """Whether anything was built there."""
        return (self.folder / LIST_NAME).is_file()

    def _read_list(self) -> None:
        path = self.folder / LIST_NAME
        try:
            document = json.loads(path.read_text(encoding="utf-8"))
            version = document["schema"]
            files = {name: [str(file) for file in document["files"].get(name, ())] for name in TABLES}
            published = [str(one) for one in document["published"]]
        except (OSError, ValueError, LookupError, TypeError, AttributeError) as error:
            raise DatasetError(
                f"{path} cannot be read: {error}",
                file=str(path),
                advice="build the dataset again, in another folder",
            ) from None
        if version != SCHEMA_VERSION:
            raise DatasetError(
                f"{self.folder} is a dataset of schema {version}; this program reads and writes schema {SCHEMA_VERSION}",
                folder=str(self.folder),
                found=version,
                expected=SCHEMA_VERSION,
                advice="build it again, in another folder",
            )
        self._files, self._published = files, published

    def _write_list(self) -> None:
        document = {"schema": SCHEMA_VERSION, "files": self._files, "published": self._published}
        write_file(self.folder / LIST_NAME, (json.dumps(document, indent=1) + "\n").encode())

    # Reading

    def open(self) -> Any:  # noqa: ANN401 - as `connection`
        """Return a database with the dataset's tables and views, which reads nothing else and writes nothing.

        Raises
        ------
        DatasetError
            There is no dataset, or no DuckDB.
        """
        if not self.is_there:
            raise DatasetError(
                f"{self.folder}: there is no dataset",
                folder=str(self.folder),
                advice="build it: pbpp logs build FOLDER -o DATASET",
            )
        self._check_files()
        found = connection()
        with self.readable():
            for table in TABLES.values():
                found.execute(f"CREATE VIEW {table.name} AS {self.select(table)}")
            for view in VIEWS:
                found.execute(f"CREATE VIEW {view.name} AS {view.sql}")
        allowed = ", ".join(
            quoted(one) for one in (self.folder, literal(self.folder))
        )  # as it is, and as it is asked for
        found.execute(f"SET allowed_directories = [{allowed}]")
        found.execute("SET enable_external_access = false")
        found.execute("SET lock_configuration = true")
        return found

    def _check_files(self) -> None:
        """Refuse a dataset that was copied in part: rows that are gone would be missed by nobody.

        Raises
        ------
        DatasetError
            A file of its list is not there.
        """
        listed = [name for files in self._files.values() for name in files]
        if missing := [name for name in listed if not (self.folder / name).is_file()]:
            raise self.unreadable(
                f"{len(missing)} of its {len(listed)} files are not there, such as {missing[0]}"
            )

    @contextmanager
    def readable(self) -> Iterator[None]:
        """Let what DuckDB cannot read or write of the dataset's files be an error of the dataset."""
        try:
            yield
        except Exception as error:
            text = words_of_duckdb(error)
            if text is None:
                raise
            raise self.unreadable(text) from None

    def unreadable(self, why: str) -> DatasetError:
        """Return the error that a dataset is whose files cannot be used."""
        return DatasetError(
            f"{self.folder}: {why}",
            folder=str(self.folder),
            advice="copy the whole folder again, or build it anew in another one",
        )

    def select(self, table: Table) -> str:
        """Return the query of all of a table's rows."""
        files = [self.folder / name for name in self._files[table.name]]
        if not files:
            columns = ", ".join(f"CAST(NULL AS {one.sql}) AS {one.name}" for one in table.every_column)
            return f"SELECT {columns} WHERE false"
        return f"SELECT {', '.join(one.name for one in table.every_column)} FROM {_parquet(files, table)}"  # noqa: S608 - our own names

    def known_files(self, database: Any) -> Iterator[Sequence[Any]]:  # noqa: ANN401 - as `connection`
        """Yield of each file that was looked at: path, size, time of change, log and its problem; staged ones come last."""
        columns = "f.path, f.bytes, f.changed_ns, f.log, l.problem"
        parts = [(self.select(TABLES["files"]), self.select(TABLES["logs"]))]
        for folder in self._staged():
            one, other = (_parquet([folder / f"{name}.parquet"]) for name in ("files", "logs"))
            parts.append((f"SELECT * FROM {one}", f"SELECT * FROM {other}"))  # noqa: S608 - our own names
        for files, logs in parts:
            query = f"SELECT {columns} FROM ({files}) f LEFT JOIN ({logs}) l ON f.log = l.log"  # noqa: S608 - our own names
            yield from database.execute(query).fetchall()

    # Building

    def begin(self) -> Any:  # noqa: ANN401 - as `connection`
        """Make the folder ready for a build: take away what a killed one left; return a database to build with.

        Raises
        ------
        DatasetError
            Another build adds to it, or it is of another version.
        """
        self.folder.mkdir(parents=True, exist_ok=True)
        lock = (self.folder / _LOCK).open("ab")
        if not lock_file(lock):
            lock.close()
            raise DatasetError(
                f"{self.folder}: another `pbpp logs build` adds to this dataset; nothing was changed",
                folder=str(self.folder),
                advice="wait for it to finish, or stop it",
            )
        self._lock = lock
        if self.is_there:
            self._read_list()  # as it is now: another build may have ended since
            self._check_files()
        for name in (_INCOMING, _SCRATCH):
            shutil.rmtree(self.folder / name, ignore_errors=True)
        for folder in self._staged(every=True):
            if folder.suffix == ".part" or folder.name in self._published:
                shutil.rmtree(folder)
        database = connection(self.folder / _SCRATCH)
        if not self.is_there:
            self._write_list()
        listed = {self.folder / name for files in self._files.values() for name in files}
        for table in TABLES:
            for path in (self.folder / table).rglob("*.parquet"):
                if path not in listed:
                    path.unlink()
        return database

    def end(self) -> None:
        """Take away what a build needs only while it runs."""
        for name in (_INCOMING, _SCRATCH, _STAGING):
            shutil.rmtree(self.folder / name, ignore_errors=True)

    def close(self) -> None:
        """Let another build add to it."""
        if self._lock is not None:
            self._lock.close()
            self._lock = None

    def _staged(self, *, every: bool = False) -> list[Path]:
        found = sorted((self.folder / _STAGING).glob("*"))
        return found if every else [one for one in found if one.suffix != ".part"]

    @property
    def staged_logs(self) -> int:
        """How many batches wait to be published."""
        return len(self._staged())

    def stage(self, database: Any, rows: Mapping[str, Sequence[Row]]) -> None:  # noqa: ANN401 - as `connection`
        """Put rows aside, on the disk, all or none of them.

        Parameters
        ----------
        database : duckdb connection
        rows : mapping of str to sequence of tuple
            By table; those of partitioned tables with month and vehicle behind their columns.
        """
        name = secrets.token_hex(8)
        folder = self.folder / _STAGING / f"{name}.part"
        folder.mkdir(parents=True)
        for table in TABLES.values():
            _write_rows(
                database, folder / f"{table.name}.parquet", table.every_column, rows.get(table.name, ())
            )
        _flush(folder)
        folder.rename(folder.with_name(name))

    def publish(self, database: Any, superseded: Iterable[str] = ()) -> None:  # noqa: ANN401 - as `connection`
        """Make what was staged part of the dataset, in one step.

        Parameters
        ----------
        database : duckdb connection
        superseded : iterable of str
            Logs whose rows go: their file holds another log now.
        """
        staged = self._staged()
        files = {name: list(listed) for name, listed in self._files.items()}
        gone = self._without(database, files, sorted(superseded)) if superseded else []
        for table in TABLES.values() if staged else ():
            files[table.name] += self._incoming(
                database, table, [f"{one}/{table.name}.parquet" for one in staged]
            )
        gone += self._in_fewer_parts(database, files)
        self._files, self._published = files, [folder.name for folder in staged]
        self._write_list()
        for folder in staged:
            shutil.rmtree(folder)
        for name in gone:
            (self.folder / name).unlink(missing_ok=True)

    def _incoming(self, database: Any, table: Table, sources: Sequence[str]) -> list[str]:  # noqa: ANN401
        """Write rows as new files of a table; return their names. They are not on the list yet."""
        incoming = self.folder / _INCOMING / secrets.token_hex(8)
        incoming.mkdir(parents=True)
        keys = [one.name for one in PARTITION] if table.is_partitioned else []
        order = ", ".join(
            [*keys, *(one for one in ("log", "path", "drive", "leg", "time_s") if one in table.names)]
        )
        options = "FORMAT parquet, COMPRESSION zstd"
        months: list[Any] = [None]
        if keys:
            source = _parquet(sources)
            found = database.execute(f"SELECT DISTINCT month FROM {source} ORDER BY 1").fetchall()  # noqa: S608
            months = [month for (month,) in found]
            options += f", PARTITION_BY ({', '.join(keys)})"
        for month in months:  # one at a time, so that few partitions are open at once
            where = "" if month is None else f" WHERE month = {quoted(month)}"
            query = f"SELECT * FROM {_parquet(sources)}{where} ORDER BY {order}"  # noqa: S608
            if keys:
                database.execute(f"COPY ({query}) TO {quoted(incoming / (month or ''))} ({options})")
            else:
                database.execute(
                    f"COPY ({query}) TO {quoted(incoming / 'part.parquet')} ({options}, ROW_GROUP_SIZE {_ROW_GROUP})"
                )
        return [self._moved(table, path) for path in sorted(incoming.rglob("*.parquet"))]

    def _moved(self, table: Table, path: Path) -> str:
        """Move a new file to its place; return its name there."""
        partition = [part for part in path.parts if part.startswith(_PARTITIONED)]
        name = Path(table.name, *partition, f"part-{secrets.token_hex(8)}.parquet")
        to = self.folder / name
        to.parent.mkdir(parents=True, exist_ok=True)
        _sync(path)
        path.replace(to)
        return name.as_posix()

    def _in_fewer_parts(self, database: Any, files: dict[str, list[str]]) -> list[str]:  # noqa: ANN401
        """Write partitions that are in too many files into one each; return the names of the old files."""
        gone = []
        for table in TABLES.values():
            parts: dict[str, list[str]] = {}
            for name in files[table.name]:
                parts.setdefault(name.rpartition("/")[0], []).append(name)
            for names in parts.values():
                if len(names) > _MOST_PARTS:
                    files[table.name] = [name for name in files[table.name] if name not in names]
                    files[table.name] += self._rewritten(database, table, names, "")
                    gone += names
        return gone

    def _without(self, database: Any, files: dict[str, list[str]], logs: Sequence[str]) -> list[str]:  # noqa: ANN401
        """Write the files that hold rows of some logs anew without them; return the names of the old files."""
        which = f"log IN ({', '.join(map(quoted, logs))})"
        gone = []
        for table in TABLES.values():
            for name in list(files[table.name]):
                found = _parquet([self.folder / name], table)
                (count,) = database.execute(f"SELECT count(*) FROM {found} WHERE {which}").fetchone()  # noqa: S608
                if count:
                    files[table.name].remove(name)
                    files[table.name] += self._rewritten(database, table, [name], f" WHERE NOT ({which})")
                    gone.append(name)
        return gone

    def _rewritten(self, database: Any, table: Table, names: Sequence[str], where: str) -> list[str]:  # noqa: ANN401
        (self.folder / _INCOMING).mkdir(exist_ok=True)
        source = self.folder / _INCOMING / f"{secrets.token_hex(8)}.parquet"
        columns = ", ".join(one.name for one in table.every_column)
        found = _parquet([self.folder / name for name in names], table)
        query = f"SELECT {columns} FROM {found}{where}"  # noqa: S608
        database.execute(f"COPY ({query}) TO {quoted(source)} (FORMAT parquet, COMPRESSION zstd)")
        return self._incoming(database, table, [str(source)])


def _is_ours(folder: Path) -> bool:
    """Return whether a folder is empty, but for what a build that was killed may have left."""
    return all(path.name in (_STAGING, _INCOMING, _SCRATCH, _LOCK) for path in folder.iterdir())


def _parquet(files: Iterable[object], table: Table | None = None) -> str:
    """Return the reading of Parquet files; with a table, of those in its folders, whose names tell month and vehicle."""
    names = ", ".join(quoted(literal(file)) for file in files)
    if table is None or not table.is_partitioned:
        return f"read_parquet([{names}], hive_partitioning = false)"
    types = ", ".join(f"{quoted(one.name)}: {one.sql}" for one in PARTITION)
    return f"read_parquet([{names}], hive_partitioning = true, hive_types = {{{types}}})"


def _write_rows(database: Any, path: Path, columns: Sequence[Column], rows: Sequence[Row]) -> None:  # noqa: ANN401
    """Write rows to a Parquet file, by way of numpy's columns: numbers and truths as floats, in which NaN is NULL."""
    values: list[Sequence[Any]] = list(zip(*rows, strict=True)) if rows else [()] * len(columns)
    arrays = {one.name: _column(one.sql, column) for one, column in zip(columns, values, strict=True)}
    database.register("staged_rows", arrays)
    selected = ", ".join(_typed(one) for one in columns)
    query = f"SELECT {selected} FROM staged_rows"  # noqa: S608
    database.execute(f"COPY ({query}) TO {quoted(path)} (FORMAT parquet, COMPRESSION zstd)")
    database.unregister("staged_rows")


def _column(sql: str, values: Sequence[Any]) -> NDArray[Any]:
    if sql == "VARCHAR":
        return np.array(values, dtype=object)
    if sql == "BIGINT":  # nanoseconds since 1970 are more than a double holds
        return np.array([None if one is None else str(one) for one in values], dtype=object)
    return np.array([math.nan if one is None else one for one in values], dtype=np.float64)


def _typed(column: Column) -> str:
    name = column.name
    if column.sql == "VARCHAR":
        return f"CAST({name} AS VARCHAR) AS {name}"
    if column.sql == "BIGINT":
        return f"CAST(CAST({name} AS VARCHAR) AS BIGINT) AS {name}"
    known = (
        f"make_timestamp(CAST(round({name} * 1e6) AS BIGINT))"
        if column.sql == "TIMESTAMP"
        else f"CAST({name} AS {column.sql})"
    )
    return f"CASE WHEN isnan({name}) THEN NULL ELSE {known} END AS {name}"


def _flush(folder: Path) -> None:
    """Have the files of a folder on the disk before it is renamed."""
    for path in folder.iterdir():
        _sync(path)


def _sync(path: Path) -> None:
    with path.open("rb+") as file:
        os.fsync(file.fileno())
