"""What a walk through a log had to pass over."""

from __future__ import annotations

from dataclasses import dataclass, fields


@dataclass(frozen=True, slots=True)
class Damage:
    """Counts of one walk through a log.

    Parameters
    ----------
    frames : int
        Frames found, of all message types and whether wanted or not. No damage by itself.
    unknown_ids : int
        Those of them with a message id our dialect does not have. Their checksum cannot be checked. No damage by itself.
    bad_crcs : int
        Frames dropped for a wrong checksum though their neighbours fit. Frames that were not wanted are not checked.
    gaps : int
        Places where bytes had to be passed over.
    skipped_bytes : int
        Bytes in those places.
    orphan_timestamps : int
        Timestamps without a frame.
    untimed_frames : int
        Frames without a timestamp of their own in a log that has timestamps; they get the one before.
    wrong_timestamps : int
        Lone timestamps more than a day off both neighbours; they get the one before.
    truncated_bytes : int
        Bytes of a record that the log's end cuts off.
    broken_gzip : int
        1 if the packing broke off or its own checksum is wrong.
    """

    frames: int = 0
    unknown_ids: int = 0
    bad_crcs: int = 0
    gaps: int = 0
    skipped_bytes: int = 0
    orphan_timestamps: int = 0
    untimed_frames: int = 0
    wrong_timestamps: int = 0
    truncated_bytes: int = 0
    broken_gzip: int = 0

    @property
    def is_clean(self) -> bool:
        """Whether every byte of the log belongs to a good record."""
        return not self._faults()

    def __str__(self) -> str:
        faults = ", ".join(f"{count} {name.replace('_', ' ')}" for name, count in self._faults().items())
        return f"{self.frames} frames, {faults or 'no damage'}"

    def _faults(self) -> dict[str, int]:
        names = [field.name for field in fields(self) if field.name not in {"frames", "unknown_ids"}]
        return {name: getattr(self, name) for name in names if getattr(self, name)}
