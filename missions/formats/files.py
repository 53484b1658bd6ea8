"""Files written: the one place that creates, replaces and keeps them."""

from __future__ import annotations

import errno
import itertools
import os
import secrets
import shutil
import stat
from contextlib import suppress
from typing import TYPE_CHECKING, TypeAlias

from missions.errors import MissionFormatError

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

Writer: TypeAlias = "Callable[[Path, bytes], None]"
"""What puts bytes into a file: `write_file`, or what looks first at the file that is there."""


_ADVICE = {
    errno.EISDIR: "choose another name",
    errno.EINVAL: "choose another name",
    errno.ENOSPC: "make room on the disk, or choose another folder",
    errno.ENOENT: "create the folder first, or choose another one",
}
"""What helps where the folder is not to blame, by the error's number."""


def write_file(path: Path, data: bytes, make_way: Callable[[], object] = lambda: None) -> None:
    """Write a whole file or nothing: what was there before is replaced when all of the new is on the disk.

    A file that is replaced keeps its permissions; a new one gets those of any new file. A link is replaced as a file is: what it
    leads to is left alone, so that nobody who can write into the folder chooses what is overwritten.

    Parameters
    ----------
    path : pathlib.Path
        Where to.
    data : bytes
        What.
    make_way : callable, optional
        Called when the new file is complete and about to take the place of the old one, so that the old one can be kept.

    Raises
    ------
    MissionFormatError
        The file cannot be written.
    """
    try:
        mode = mode_of(path)
        # Beside it, so that nobody ever finds half a mission; by a name that nobody can guess.
        unfinished = path.with_name(f".pbpp-{secrets.token_hex(8)}.part")
        descriptor = create_exclusively(unfinished)
        try:
            with os.fdopen(descriptor, "wb") as file:
                file.write(data)
                file.flush()
                os.fsync(file.fileno())
            if mode is not None:
                unfinished.chmod(mode)
            make_way()
            unfinished.replace(path)
        except BaseException:
            with suppress(OSError):
                unfinished.unlink()
            raise
    except OSError as error:
        raise unwritable(path, error) from None


def create_exclusively(path: Path) -> int:
    """Return the descriptor of a new file, open for writing; never one that was there, never one that a link leads to.

    Raises
    ------
    OSError
        Something of that name is there, or it cannot be created.
    """
    flags = os.O_CREAT | os.O_EXCL | os.O_WRONLY | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_BINARY", 0)
    return os.open(path, flags, 0o666)  # less the umask, as any new file


def keep_aside(path: Path) -> Path:
    """Keep a file under a second name beside it: ``NAME.bak``, or the first of ``NAME.bak2`` … that is free.

    Returns
    -------
    pathlib.Path
        The second name. The first is still there, too.

    Raises
    ------
    OSError
        It cannot be kept.
    """
    for number in itertools.count(1):
        aside = path.with_name(f"{path.name}.bak{number if number > 1 else ''}")
        with suppress(FileExistsError):
            _put_beside(path, aside)
            return aside
    raise AssertionError


def _put_beside(path: Path, aside: Path) -> None:
    """Create a second name for a file, not yet taken, by a link or else a copy.

    Raises
    ------
    FileExistsError
        The name is taken.
    """
    if path.is_symlink():
        aside.symlink_to(path.readlink())
        return
    try:
        aside.hardlink_to(path)
    except FileExistsError:
        raise
    except OSError:  # a file system without links, as on most memory cards
        descriptor = create_exclusively(aside)
        try:
            with os.fdopen(descriptor, "wb") as copy, path.open("rb") as original:
                shutil.copyfileobj(original, copy)
                copy.flush()
                os.fsync(copy.fileno())
            shutil.copystat(path, aside)
        except BaseException:
            with suppress(OSError):
                aside.unlink()
            raise


def mode_of(path: Path) -> int | None:
    """Return the permissions of the file that is there; None where none is.

    Raises
    ------
    OSError
        What is there is no file: a folder, a device, a pipe.
    """
    try:
        found = path.lstat().st_mode
    except FileNotFoundError:
        return None
    if stat.S_ISDIR(found):
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(path))
    if not (stat.S_ISREG(found) or stat.S_ISLNK(found)):
        raise OSError(errno.EINVAL, "it is not a regular file", str(path))
    return stat.S_IMODE(found) & 0o777 if stat.S_ISREG(found) else None


def unwritable(path: Path, error: OSError) -> MissionFormatError:
    """Return the error that a file is which cannot be written."""
    return MissionFormatError(
        f"{path} cannot be written: {error.strerror}",
        file=str(path),
        advice=_ADVICE.get(error.errno or 0, "choose another folder, or make this one writable"),
    )
