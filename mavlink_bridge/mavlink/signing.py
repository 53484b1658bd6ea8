"""MAVLink 2 message signing: the key, and which signed frames are believed.

A frame carries a link id, a time in units of 10 µs since 2015-01-01 and the first 6 bytes of SHA-256 over the key and the frame
(https://mavlink.io/en/guide/message_signing.html). The key never leaves this module but into the hash and pymavlink's packer.
"""

from __future__ import annotations

import base64
import binascii
import hashlib
import hmac
import os
import stat
from typing import TYPE_CHECKING

from mavlink_bridge.errors import UsageError

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

# MAVLink 2 message signing, as its guide defines it: key, frame flag, signature block, time in 10 µs since 2015.
KEY_BYTES = 32
_MOST_FILE_BYTES = 4096  # chosen: longer than any passphrase; a wrong file is not read whole
_MAVLINK_2 = 0xFD
_FLAG_SIGNED = 1
_SIGNATURE_BYTES = 13
_EPOCH_2015_S = 1_420_070_400
_TICKS_PER_S = 100_000
# A sender not heard before may be a minute behind, as the signing guide has it.
_NEW_STREAM_BEHIND_TICKS = 60 * _TICKS_PER_S


class SigningKey:
    """The secret of 32 bytes; it does not show itself.

    Parameters
    ----------
    secret : bytes
        32 bytes.

    Raises
    ------
    UsageError
        It has another length.
    """

    __slots__ = ("_secret",)

    def __init__(self, secret: bytes) -> None:
        if len(secret) != KEY_BYTES:
            raise UsageError(f"a signing key has {KEY_BYTES} bytes, not {len(secret)}")
        self._secret = bytes(secret)

    def __repr__(self) -> str:
        return "SigningKey(…)"

    def __reduce__(self) -> str:
        raise TypeError("a signing key is not written anywhere")

    @classmethod
    def from_passphrase(cls, passphrase: str) -> SigningKey:
        """Return the key of a passphrase, as MAVProxy and Mission Planner make it: its SHA-256."""
        return cls(hashlib.sha256(passphrase.encode()).digest())

    @classmethod
    def read(cls, path: Path) -> SigningKey:
        """Read a key file: 32 bytes, 64 hexadecimal digits, 44 characters of base64, or else a passphrase.

        Raises
        ------
        UsageError
            The file cannot be read, is empty or too long, is no text and no key, or others may read it.
        """
        return cls._parse(_content(path), path)

    @classmethod
    def _parse(cls, content: bytes, path: Path) -> SigningKey:
        if len(content) == KEY_BYTES:
            return cls(content)
        try:
            text = content.decode().strip()
        except UnicodeDecodeError:
            text = ""
        if not text:
            raise UsageError(f"signing key {path}: neither {KEY_BYTES} bytes nor text") from None
        try:
            if len(text) == 2 * KEY_BYTES:
                return cls(bytes.fromhex(text))
        except ValueError:
            pass
        try:
            decoded = base64.b64decode(text, validate=True)
        except (binascii.Error, ValueError):
            decoded = b""
        return cls(decoded) if len(decoded) == KEY_BYTES else cls.from_passphrase(text)

    def signature(self, signed_bytes: bytes) -> bytes:
        """Return the 6 signature bytes of a frame without them."""
        return hashlib.sha256(self._secret + signed_bytes).digest()[:6]

    def hand_to(self, take: Callable[[bytes], None]) -> None:
        """Set the secret on the packer."""
        take(self._secret)


class Signing:
    """One end of a signed link: our timestamps, and what was heard of others'.

    Parameters
    ----------
    key : SigningKey
        The shared secret.
    clock : callable
        Returns the time in seconds since 1970 (`time.time`).
    link_id : int
        Our link's number.
    """

    def __init__(self, key: SigningKey, clock: Callable[[], float], link_id: int = 0) -> None:
        self.key = key
        self.link_id = link_id
        self._clock = clock
        self._ticks = 0
        self._streams: dict[tuple[int, int, int], int] = {}

    def next_timestamp(self) -> int:
        """Return the timestamp for the next frame: the clock's, and always later than any before."""
        self._ticks = max(self._ticks + 1, self._clock_ticks())
        return self._ticks

    def sent(self, frame: bytes) -> None:
        """Note a signed frame of ours: nothing as old in our own stream is news, however late it comes back."""
        self._streams[_stream(frame)] = _ticks(frame)

    def accepts(self, frame: bytes) -> bool:
        """Return whether a received frame is signed with our key and not a replay; an accepted one is remembered."""
        if len(frame) < _SIGNATURE_BYTES or frame[0] != _MAVLINK_2 or not frame[2] & _FLAG_SIGNED:
            return False
        if not hmac.compare_digest(self.key.signature(frame[:-6]), frame[-6:]):
            return False
        ticks, stream = _ticks(frame), _stream(frame)
        newest = self._streams.get(stream)
        if newest is None:
            # A stream not heard before may lag a minute behind us, as the protocol allows.
            newest = max(self._ticks, self._clock_ticks()) - _NEW_STREAM_BEHIND_TICKS - 1
        if ticks <= newest:
            return False
        self._streams[stream] = ticks
        self._ticks = max(self._ticks, ticks)
        return True

    def _clock_ticks(self) -> int:
        return int((self._clock() - _EPOCH_2015_S) * _TICKS_PER_S)


def _ticks(frame: bytes) -> int:
    return int.from_bytes(frame[-12:-6], "little")


def _stream(frame: bytes) -> tuple[int, int, int]:
    """Return link id, system and component of a signed frame."""
    return frame[-13], frame[5], frame[6]


def _content(path: Path) -> bytes:
    try:
        with path.open("rb") as file:
            mode = os.fstat(file.fileno()).st_mode
            content = file.read(_MOST_FILE_BYTES + 1)
    except OSError as error:
        raise UsageError(f"signing key {path} cannot be read: {error.strerror or error}") from None
    if os.name == "posix" and mode & (stat.S_IRWXG | stat.S_IRWXO):
        raise UsageError(f"signing key {path} may be read by others; run: chmod 600 {path}")
    if not content.strip():
        raise UsageError(f"signing key {path} is empty")
    if len(content) > _MOST_FILE_BYTES:
        raise UsageError(f"signing key {path} is longer than {_MOST_FILE_BYTES} bytes")
    return content
