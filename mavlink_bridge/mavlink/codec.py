"""Frames to bytes and back, by pymavlink's ArduPilot dialect (MAVLink 2 out, 1 and 2 in)."""

from __future__ import annotations

import struct
from dataclasses import fields
from typing import TYPE_CHECKING, Any, ClassVar

from pymavlink.dialects.v20 import ardupilotmega as dialect

from mavlink_bridge.mavlink.echoes import SentFrames
from mavlink_bridge.mavlink.messages import (
    MESSAGES,
    Frame,
    Message,
    MissionAck,
    MissionCount,
    MissionCurrent,
)

if TYPE_CHECKING:
    from collections.abc import Hashable

    from mavlink_bridge.mavlink.signing import Signing


_HEADER_BYTES_V1, _HEADER_BYTES_V2 = 6, 10
_MOST_SOURCES = 64
"""Receive buffers that are kept: twice as many as there are sources that are answered."""


def _extended(parent: Any, names: tuple[str, ...]) -> Any:  # noqa: ANN401 - pymavlink ships no types
    """Return pymavlink's class of a message with the uint32 fields that MAVLink's common.xml has and ArduPilot's own does not: extensions, after all others.

    Only what is sent and where fields stand comes from here; pymavlink reads what it knows itself, `to_frame` the rest.
    """
    own = tuple(parent.fieldnames)

    class Extended(parent):  # type: ignore[misc]  # pymavlink ships no types
        fieldnames: ClassVar = [*own, *names]
        ordered_fieldnames: ClassVar = [*parent.ordered_fieldnames, *names]
        fieldtypes: ClassVar = [*parent.fieldtypes, *["uint32_t"] * len(names)]
        orders: ClassVar = [*parent.orders, *range(len(own), len(own) + len(names))]
        lengths: ClassVar = [*parent.lengths, *[1] * len(names)]
        array_lengths: ClassVar = [*parent.array_lengths, *[0] * len(names)]
        native_format = bytearray(parent.native_format + b"I" * len(names))
        unpacker = struct.Struct(native_format.decode())
        defaulted = len(parent.__init__.__defaults__ or ()) + len(names)
        """How many fields at the end have a default: extensions, and HEARTBEAT's version."""

        def __init__(self, *args: Any, **values: Any) -> None:  # noqa: ANN401 - as pymavlink's own
            given = {**dict(zip(self.fieldnames, args, strict=False)), **values}
            super().__init__(**{name: given[name] for name in own if name in given})
            for name in names:
                setattr(self, name, given.get(name, 0))

        def pack(self, mav: Any, force_mavlink1: bool = False) -> bytes:  # noqa: ANN401, FBT001, FBT002 - pymavlink's signature
            values = [getattr(self, name) for name in self.ordered_fieldnames]
            packed: bytes = self._pack(
                mav, self.crc_extra, self.unpacker.pack(*values), force_mavlink1=force_mavlink1
            )
            return packed

    return Extended


_IDS = {
    dialect.MAVLink_mission_current_message: ("mission_id", "fence_id", "rally_points_id"),
    dialect.MAVLink_mission_count_message: ("opaque_id",),
    dialect.MAVLink_mission_ack_message: ("opaque_id",),
}
"""Ids of lists."""


def _dialect_classes() -> dict[int, Any]:
    classes = dict(dialect.mavlink_map)
    for parent, names in _IDS.items():
        if not set(names) <= set(parent.fieldnames):
            classes[parent.id] = _extended(parent, names)
    return classes


DIALECT: dict[int, Any] = _dialect_classes()
"""pymavlink's class of every message by its id, with the fields that it lacks."""

_FIELDS = {name: tuple(field.name for field in fields(cls)) for name, cls in MESSAGES.items()}
_DIALECT_CLASSES: dict[str, Any] = {
    message_class.msgname: message_class
    for message_class in DIALECT.values()
    if message_class.msgname in MESSAGES
}


_IDS_LEFT_OUT: dict[type[Message], int] = {MissionCurrent: 3, MissionCount: 1, MissionAck: 1}
"""How many ids stand at the end of a message, which pymavlink may not read."""

_WITH_ARRAYS = frozenset(
    name
    for name, cls in _DIALECT_CLASSES.items()
    if any(
        cls.array_lengths[cls.ordered_fieldnames.index(field)]
        and cls.fieldtypes[cls.fieldnames.index(field)] != "char"
        for field in _FIELDS[name]
    )
)
"""Messages with lists of numbers, which are tuples in ours."""


class Codec:
    """One direction-less end of a MAVLink link: its own sequence counter and receive buffers.

    Parameters
    ----------
    system, component : int
        The identity stamped on what is sent.
    signing : Signing, optional
        Signs what is sent; what is received unsigned, wrongly signed or replayed is left out.
    sent : SentFrames, optional
        What another end before this one sent, to which this one adds; what comes back of it is left out.

    Attributes
    ----------
    bad_bytes : int
        Received bytes that belong to no sound frame.
    echoes : int
        Frames left out that were ours, come back byte for byte.
    untrusted_frames : int
        Sound frames left out for their signature.
    """

    def __init__(
        self, system: int, component: int, signing: Signing | None = None, sent: SentFrames | None = None
    ) -> None:
        # pymavlink's own check takes a stream's time from frames before it has verified them: it only packs.
        self._packer = _packer(system, component, signing)
        self._parsers: dict[Hashable, Any] = {}
        self._signing = signing
        self._sent = SentFrames() if sent is None else sent
        self.bad_bytes = 0
        self.echoes = 0
        self.untrusted_frames = 0

    @property
    def identity(self) -> tuple[int, int]:
        """System and component id stamped on what is sent."""
        return self._packer.srcSystem, self._packer.srcComponent

    @identity.setter
    def identity(self, identity: tuple[int, int]) -> None:
        self._packer.srcSystem, self._packer.srcComponent = identity

    def encode(self, message: Message) -> bytes:
        """Return the bytes of one MAVLink 2 frame and count the sequence number up."""
        if self._signing is not None:
            self._packer.signing.timestamp = self._signing.next_timestamp()
        packed: bytes = _to_dialect(message).pack(self._packer)
        self._packer.seq = (self._packer.seq + 1) % 256
        self._sent.remember(packed)
        if self._signing is not None:
            self._signing.sent(packed)
        return packed

    def decode(self, data: bytes) -> list[Frame]:
        """Take received bytes; return the complete frames of known types in them, damaged ones left out."""
        return [frame for _, frame in self.decode_with_bytes(data) if frame is not None]

    def decode_with_bytes(self, data: bytes, source: Hashable = None) -> list[tuple[bytes, Frame | None]]:
        """Return each sound frame's bytes in what was received and, where its type is known, the frame.

        Parameters
        ----------
        data : bytes
            What came.
        source : hashable, optional
            Where from, for datagrams: the begin of a frame waits for its end from there, so that one sender's garbage spoils no other's
            frames; and for nothing where a datagram is whole by itself.
        """
        decoded = []
        for raw in self._parse(data, source):
            if raw.get_type() == "BAD_DATA":
                self.bad_bytes += len(raw.data)
                continue
            frame_bytes = bytes(raw.get_msgbuf())
            if frame_bytes in self._sent:
                self.echoes += 1
            elif self._signing is not None and not self._signing.accepts(frame_bytes):
                self.untrusted_frames += 1
            else:
                decoded.append((frame_bytes, to_frame(raw)))
        return decoded

    def _parse(self, data: bytes, source: Hashable) -> list[Any]:
        parser = self._parsers.pop(source, None) or _parser()
        raws = None
        if source is not None and parser.buf_len():
            alone = _parser()
            raws = alone.parse_buffer(data)
            if raws and raws[0].get_type() != "BAD_DATA":
                self.bad_bytes += parser.buf_len()
                parser = alone
            else:
                raws = None
        if raws is None:
            raws = parser.parse_buffer(data) or []
        # pymavlink keeps all that ever came for as long as a frame's begin is left at its end.
        del parser.buf[: parser.buf_index]
        parser.buf_index = 0
        self._parsers[source] = parser  # of too many the one that was silent longest is forgotten
        if len(self._parsers) > _MOST_SOURCES:
            del self._parsers[next(iter(self._parsers))]
        return raws


def _parser() -> Any:  # noqa: ANN401 - pymavlink ships no types
    parser = dialect.MAVLink(None)
    parser.robust_parsing = True
    return parser


def _packer(system: int, component: int, signing: Signing | None) -> Any:  # noqa: ANN401 - pymavlink ships no types
    packer = dialect.MAVLink(None, srcSystem=system, srcComponent=component)
    if signing is not None:
        packer.signing.sign_outgoing = True
        packer.signing.link_id = signing.link_id
        signing.key.hand_to(lambda secret: setattr(packer.signing, "secret_key", secret))
    return packer


def to_frame(raw: Any) -> Frame | None:  # noqa: ANN401 - pymavlink ships no types
    """Turn a pymavlink message into a `Frame`; None for a type this project does not speak."""
    name = raw.get_type()
    message_class = MESSAGES.get(name)
    if message_class is None:
        return None
    values = [getattr(raw, field, 0) for field in _FIELDS[name]]
    if (count := _IDS_LEFT_OUT.get(message_class)) and not hasattr(raw, _FIELDS[name][-1]):
        values[-count:] = _ids_in(raw, count)
    if name in _WITH_ARRAYS:
        values = [tuple(value) if isinstance(value, list) else value for value in values]
    return Frame(raw.get_srcSystem(), raw.get_srcComponent(), message_class(*values))


def _ids_in(raw: Any, count: int) -> tuple[int, ...]:  # noqa: ANN401 - pymavlink ships no types
    """Read the end of a payload; MAVLink 2 leaves off what is 0 there."""
    frame_bytes = bytes(raw.get_msgbuf())
    begin = _HEADER_BYTES_V1 if frame_bytes[0] == dialect.PROTOCOL_MARKER_V1 else _HEADER_BYTES_V2
    size = raw.unpacker.size
    payload = frame_bytes[begin : begin + frame_bytes[1]].ljust(size + 4 * count, b"\0")
    ids: tuple[int, ...] = struct.unpack_from(f"<{count}I", payload, size)
    return ids


def _to_dialect(message: Message) -> Any:  # noqa: ANN401 - pymavlink ships no types
    name = _NAMES[type(message)]
    values = dict(_BLANKS[name])
    for field in _FIELDS[name]:
        value = getattr(message, field)
        values[field] = value.encode() if isinstance(value, str) else value
    return _DIALECT_CLASSES[name](**values)


def _blank(dialect_class: Any, field: str) -> Any:  # noqa: ANN401 - pymavlink ships no types
    index = dialect_class.fieldnames.index(field)
    length = dialect_class.array_lengths[dialect_class.ordered_fieldnames.index(field)]
    kind = dialect_class.fieldtypes[index]
    if kind == "char":
        return b""
    return [0] * length if length else 0


_NAMES = {message_class: name for name, message_class in MESSAGES.items()}
_BLANKS = {
    name: {field: _blank(dialect_class, field) for field in dialect_class.fieldnames}
    for name, dialect_class in _DIALECT_CLASSES.items()
}
"""What is sent for the fields that a class leaves out."""
