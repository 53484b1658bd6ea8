"""Texts from files, bounded: UTF-8 or what the file says, zipped KML unpacked."""

from __future__ import annotations

import codecs
import io
import re
import zipfile
import zlib
from typing import TYPE_CHECKING, NamedTuple

from missions.errors import MissionFormatError
from missions.formats.bounds import MOST_BYTES, check_bound
from missions.formats.foreign_files import check_head

if TYPE_CHECKING:
    from pathlib import Path
    from typing import IO
    from zipfile import ZipFile, ZipInfo

_CHUNK = 1 << 16
_DIRECTORY_ENTRY = b"PK\x01\x02"
_MOST_FILES = 10_000  # chosen: a .kmz holds a KML and its pictures
_XML_ENCODING = re.compile(rb"""\s*<\?xml[^>]*\sencoding\s*=\s*["']([A-Za-z0-9._-]+)["']""")
_ENCODINGS = re.compile(
    r"utf-?(8|16)(-sig)?|us-ascii|ascii|iso-?8859-\d+|latin-?\d+|windows-\d+|cp\d+|gbk?|gb2312|gb18030|big5|euc-(jp|kr)|shift_jis",
    re.IGNORECASE,
)
"""Python knows others that are no encodings of texts, or slow."""


class Text(NamedTuple):
    """What a file holds, and what there is to say of how it was read."""

    text: str
    remarks: tuple[str, ...] = ()


def read_text(path: Path) -> Text:
    """Read a text file: UTF-8, the encoding of its byte order mark or of its XML declaration; of a zipped KML (.kmz) the KML in it.

    Raises
    ------
    MissionFormatError
        The file is missing, too large, or is no text; the message says where.
    """
    remarks: tuple[str, ...] = ()
    try:
        with path.open("rb") as file:
            data = _bounded(file, str(path))
        if path.suffix.lower() == ".kmz":
            data, remarks = _unzipped(data, path)
    except OSError as error:
        raise MissionFormatError(
            f"{path} cannot be read: {error.strerror or error}",
            file=str(path),
            advice="check the path",
        ) from None
    check_head(data[:16], str(path), "a text file")
    return Text(_decoded(data, path).replace("\r\n", "\n").replace("\r", "\n"), remarks)


def _decoded(data: bytes, path: Path) -> str:
    is_utf16 = data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE))  # Notepad's "Unicode"
    declared = _XML_ENCODING.match(data[:200])
    encoding = "utf-16" if is_utf16 else declared[1].decode() if declared else "utf-8-sig"
    if encoding.lower() in ("utf-8", "utf8"):
        encoding = "utf-8-sig"
    if not _is_known(encoding):
        raise MissionFormatError(
            f"{path}: the encoding {encoding!r} is not supported; save the file as UTF-8", file=str(path)
        )
    try:
        return data.decode(encoding)
    except UnicodeError as error:
        place = f" (byte {error.start})" if isinstance(error, UnicodeDecodeError) else ""
        wanted = "UTF-8" if encoding == "utf-8-sig" else encoding
        raise MissionFormatError(
            f"{path} is not a text file{place}; expected {wanted}", file=str(path)
        ) from None


def _is_known(encoding: str) -> bool:
    try:
        codecs.lookup(encoding)
    except LookupError:
        return False
    return _ENCODINGS.fullmatch(encoding) is not None


def _bounded(file: IO[bytes], source: str) -> bytes:
    """Read all, chunk by chunk and never more than the bound: what a file says of its size may be a lie."""
    chunks, size = [], 0
    while chunk := file.read(_CHUNK):
        size += len(chunk)
        if size > MOST_BYTES:
            raise MissionFormatError(
                f"{source}: more than {MOST_BYTES / 1e6:.0f} MB, the limit",
                file=source,
                most=MOST_BYTES,
            )
        chunks.append(chunk)
    return b"".join(chunks)


def _unzipped(data: bytes, path: Path) -> tuple[bytes, tuple[str, ...]]:
    """Return the KML of a zip file, as KMZ wants it: doc.kml, else the first."""
    check_bound(data.count(_DIRECTORY_ENTRY), _MOST_FILES, "files in it", str(path))
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            found, remarks = _kml_in(archive, path)
            if found.compress_type not in (
                zipfile.ZIP_STORED,
                zipfile.ZIP_DEFLATED,
            ):  # Python unpacks others without a bound
                raise NotImplementedError(f"{found.filename} is not compressed with deflate")
            with archive.open(found) as file:
                return _bounded(file, f"{path}: {found.filename}"), remarks
    except (
        zipfile.BadZipFile,
        RuntimeError,  # encrypted, and ways of packing that Python does not know
        zlib.error,
        EOFError,
        OSError,
        ValueError,
    ) as error:
        reason = str(error) or type(error).__name__
        raise MissionFormatError(
            f"{path} is not a readable zip file: {reason}", file=str(path), advice=_ZIP_ADVICE
        ) from None


_ZIP_ADVICE = "save the .kmz again as an ordinary zip file, or save a .kml"


def _kml_in(archive: ZipFile, path: Path) -> tuple[ZipInfo, tuple[str, ...]]:
    found = [one for one in archive.infolist() if one.filename.lower().endswith(".kml")]
    if not found:
        raise MissionFormatError(f"{path} contains no .kml", file=str(path))
    chosen = next((one for one in found if one.filename.lower() == "doc.kml"), found[0])
    others = [one.filename for one in found if one is not chosen]
    if not others:
        return chosen, ()
    shown = ", ".join(others[:3]) + (f" and {len(others) - 3} more" if len(others) > 3 else "")
    return chosen, (f"{path}: only {chosen.filename} is read, not {shown}",)
