"""Texts from and to files."""

from __future__ import annotations

import codecs
from contextlib import suppress
from typing import TYPE_CHECKING

from missions.errors import MissionFormatError

if TYPE_CHECKING:
    from pathlib import Path

_MOST_BYTES = 100_000_000
"""A small zip file may hold a huge one."""


def read_text(path: Path) -> str:
    """Read a text file: UTF-8, or what its byte order mark says; of a zipped KML (.kmz) the KML in it.

    Raises
    ------
    MissionFormatError
        The file is missing or is no text; says where.
    """
    try:
        data = _unzipped(path) if path.suffix.lower() == ".kmz" else path.read_bytes()
    except OSError as error:
        raise MissionFormatError(
            f"{path} cannot be read: {error.strerror}",
            file=str(path),
            advice="look at the path and its spelling",
        ) from None
    is_utf16 = data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE))  # Notepad's "Unicode"
    try:
        text = data.decode("utf-16" if is_utf16 else "utf-8-sig")
    except UnicodeDecodeError as error:
        raise MissionFormatError(
            f"{path} is not a text file (byte {error.start}); expected UTF-8", file=str(path)
        ) from None
    return text.replace("\r\n", "\n").replace("\r", "\n")


def _unzipped(path: Path) -> bytes:
    """Give the first KML of a zip file, as KMZ wants it."""
    import zipfile  # noqa: PLC0415 - slow to come, only for these
    import zlib  # noqa: PLC0415

    try:
        with zipfile.ZipFile(path) as archive:
            found = next((one for one in archive.infolist() if one.filename.lower().endswith(".kml")), None)
            if found is None:
                raise MissionFormatError(f"{path} holds no .kml", file=str(path))
            if found.file_size > _MOST_BYTES:
                raise MissionFormatError(
                    f"{path}: {found.filename} is {found.file_size / 1e6:.0f} MB; expected at most {_MOST_BYTES / 1e6:.0f} MB",
                    file=str(path),
                )
            return archive.read(found)
    except (
        zipfile.BadZipFile,
        RuntimeError,
        NotImplementedError,
        zlib.error,
    ) as error:  # broken, encrypted, packed otherwise
        raise MissionFormatError(f"{path} is no zip file that can be read: {error}", file=str(path)) from None


def write_text(path: Path, text: str) -> None:
    """Write a whole file or nothing.

    Raises
    ------
    MissionFormatError
        The file cannot be written.
    """
    whole = path.with_name(f".{path.name}.part")  # so that nobody ever finds half a mission
    try:
        whole.write_text(text, encoding="utf-8", newline="\n")
        whole.replace(path)
    except OSError as error:
        with suppress(OSError):
            whole.unlink()
        raise unwritable(path, error) from None


def unwritable(path: Path, error: OSError) -> MissionFormatError:
    """Give the error that a file is which cannot be written."""
    return MissionFormatError(
        f"{path} cannot be written: {error.strerror}",
        file=str(path),
        advice="choose another place, or make this one writable",
    )
