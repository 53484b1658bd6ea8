"""Files that commands write: what pbpp wrote is replaced, anybody else's is first kept as ``NAME.bak``.

Whether pbpp wrote a file is known from a list of checksums in the state folder: not every format has room for a mark, and a mark outlives
what somebody else changes afterwards, a checksum does not. A file that is not in the list (changed since, from another computer, the list lost) is
somebody else's.
"""

from __future__ import annotations

import hashlib
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

from mavlink_bridge.cli.common import warn
from mavlink_bridge.cli.failing import telling
from mavlink_bridge.user_folders import state_folder
from missions.errors import MissionError
from missions.formats import FORMATS, Part, parts_of
from missions.formats.files import keep_aside, mode_of, unwritable, write_file

if TYPE_CHECKING:
    from missions.situation import Situation

_LIST = "written-files.txt"
_MOST_BYTES = 1_000_000
"""Some 13,000 files; the older half is forgotten then."""

_PLANNING = ("plan", "demo")
"""Commands whose missions pbpp made itself; the others write what somebody made elsewhere."""


def write_kept(path: Path, data: bytes) -> None:
    """Write a whole file or nothing; what somebody else wrote there is first kept, with a note.

    A file that holds just that already is left alone: it stays whoever's it is.

    Raises
    ------
    MissionFormatError
        The file cannot be written, or the one that is there cannot be kept.
    """
    checksum = hashlib.sha256(data).hexdigest()
    if _is_there_already(path, checksum):
        return
    write_file(path, data, lambda: _make_way(path, data))
    _remember(checksum)


def make_room(path: Path) -> None:
    """Take away what stands in the place of a file that is written bit by bit; what somebody else wrote there is kept.

    Raises
    ------
    MissionFormatError
        It can be neither kept nor taken away.
    """
    try:
        mode_of(path)  # which refuses folders, devices and pipes
        _make_way(path, b"")
        path.unlink(missing_ok=True)
    except OSError as error:
        raise unwritable(path, error) from None


def remember(path: Path) -> None:
    """Put a file that was written bit by bit on the list, once it is complete."""
    with suppress(OSError):
        _remember(_checksum(path))


def _remember(checksum: str) -> None:
    """Put a file on the list; where there can be no list, the file will be kept as anybody's."""
    with suppress(OSError, MissionError):
        known = _list_path()
        known.parent.mkdir(parents=True, exist_ok=True)
        if known.exists() and known.stat().st_size > _MOST_BYTES:
            lines = known.read_text(encoding="utf-8").splitlines(keepends=True)
            write_file(known, "".join(lines[len(lines) // 2 :]).encode())
        with known.open("a", encoding="utf-8") as file:
            file.write(f"{checksum} {telling().command}\n")


def _is_there_already(path: Path, checksum: str) -> bool:
    try:
        return path.is_file() and not path.is_symlink() and _checksum(path) == checksum
    except OSError:
        return False


def _make_way(path: Path, data: bytes) -> None:
    """Keep what is at a path if it is not ours, or if a part of it would be lost.

    Raises
    ------
    OSError
        It cannot be kept.
    """
    if path.is_symlink():
        aim = path.readlink()  # what a link leads to is not touched: see `write_file`
        warn([f"{path} was a link to {aim} (left unchanged); the link is kept as {keep_aside(path)}"])
        return
    if not path.is_file() or path.stat().st_size == 0:
        return
    writer = _writer_of(path)
    if writer is None:
        warn(
            [
                f"{path} was not written by pbpp, or was changed since; the old file is kept as {keep_aside(path)}"
            ]
        )
    elif lost := _lost_parts(path, data, writer):
        warn(
            [
                f"{path} no longer contains its {' and '.join(lost)}; the old file is kept as {keep_aside(path)}"
            ]
        )


def _writer_of(path: Path) -> str | None:
    """Return the command that wrote a file as it is now; None where that is not known."""
    try:
        checksum = _checksum(path)
        lines = _list_path().read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError:
        return None
    return next((line.partition(" ")[2] for line in reversed(lines) if line.startswith(checksum)), None)


def _checksum(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _list_path() -> Path:
    return state_folder() / _LIST


def _lost_parts(path: Path, data: bytes, writer: str) -> list[str]:
    """Return the parts of a file of ours that its successor has no longer.

    A part that is there again, but other, is lost too where another kind of command wrote the file: a planned mission takes the place
    of a planned one, and not of one that was converted or downloaded.
    """
    format_ = FORMATS.get(path.suffix.lower())
    if format_ is None or format_.read is None or not format_.together or len(format_.holds) == 1:
        return []
    try:
        old = format_.read(path.read_text(encoding="utf-8"), str(path))
        new = format_.read(data.decode(), str(path))
    except (MissionError, UnicodeDecodeError):
        return [] if not data else ["part"]
    is_same_kind = writer == telling().command or {writer, telling().command} <= set(_PLANNING)
    return [
        "rally points" if part is Part.RALLY else str(part)
        for part in parts_of(old)
        if part not in parts_of(new) or (not is_same_kind and _values(old)[part] != _values(new)[part])
    ]


def _values(situation: Situation) -> dict[str, object]:
    """Return what a situation's parts hold; of a mission its items, for home is where a vehicle happens to be."""
    mission, fence, rally = situation.mission, situation.fence, situation.rally
    return {
        "mission": mission.value.items if mission else None,
        "fence": fence.value if fence else None,
        "rally": rally.value if rally else None,
        "parameters": situation.parameters,
    }
