"""Texts from and to files."""

from __future__ import annotations

from contextlib import suppress
from typing import TYPE_CHECKING

from missions.errors import MissionFormatError

if TYPE_CHECKING:
    from pathlib import Path


def read_text(path: Path) -> str:
    """Read a UTF-8 file, with or without a byte order mark.

    Raises
    ------
    MissionFormatError
        The file is missing or is no text; says where.
    """
    try:
        return path.read_text(encoding="utf-8-sig")
    except OSError as error:
        raise MissionFormatError(f"{path} cannot be read: {error.strerror}", file=str(path)) from None
    except UnicodeDecodeError as error:
        raise MissionFormatError(
            f"{path} is not a text file (byte {error.start}); expected UTF-8", file=str(path)
        ) from None


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
        raise MissionFormatError(f"{path} cannot be written: {error.strerror}", file=str(path)) from None
