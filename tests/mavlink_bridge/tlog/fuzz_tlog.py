"""Damaged variants of recorded logs, and the check that the reader gets out of each all that damage left whole.

``python tests/mavlink_bridge/tlog/fuzz_tlog.py --count 100000`` runs the long campaign; the tests run the first 500 of the same seeds.
"""

from __future__ import annotations

import argparse
import random
import sys
import tempfile
import time
from collections import Counter
from dataclasses import dataclass
from functools import cache
from itertools import pairwise
from pathlib import Path

from mavlink_bridge.errors import LogError
from mavlink_bridge.tlog import LogEntry, TlogReader
from mavlink_bridge.tlog.wire import CLASS_OF_ID

LOGS = sorted((Path(__file__).parents[3] / "sitl_logs").glob("*.tlog"))
FAR_BYTES = 300
PIECE_BYTES = 16_000
KINDS = ("flips", "cuts", "insertions", "overwrites", "shuffles", "all")


@dataclass(frozen=True)
class Record:
    begin: int
    end: int
    key: tuple  # time_s, link, frame; of a raw log the frame alone
    is_wanted: bool


@dataclass(frozen=True)
class Original:
    """A stretch of a log with whole records, and where each stands."""

    data: bytes
    records: tuple[Record, ...]
    suffix: str


@dataclass(frozen=True)
class Variant:
    """A damaged log as pieces of the original, (begin, end), and foreign bytes between them."""

    pieces: tuple[tuple[int, int] | bytes, ...]
    copies: bool  # whether pieces of the original may occur twice

    def build(self, original: bytes) -> bytes:
        return b"".join(p if isinstance(p, bytes) else original[p[0] : p[1]] for p in self.pieces)

    def is_far(self, record: Record, size: int) -> bool:
        """Whether the record stands in a piece and more than `FAR_BYTES` from its ends, where these are damage."""
        for piece in self.pieces:
            if isinstance(piece, bytes):
                continue
            begin = 0 if piece[0] == 0 and piece is self.pieces[0] else piece[0] + FAR_BYTES
            end = size if piece[1] == size and piece is self.pieces[-1] else piece[1] - FAR_BYTES
            if begin <= record.begin and record.end <= end:
                return True
        return False


@cache
def original(number: int) -> Original:
    """Cut stretch ``number`` out of the recorded logs; every fourth without its timestamps."""
    rng = random.Random(f"original {number}")
    whole = LOGS[number % len(LOGS)].read_bytes()
    starts, at = [], 0
    while at < len(whole):
        starts.append(at)
        at += 20 + whole[at + 9]
    first = rng.randrange(len(starts))
    begin = min(starts[first], starts[-1] - PIECE_BYTES)
    begin = min(start for start in starts if start >= begin)
    inside = [start for start in starts if begin <= start <= begin + PIECE_BYTES]
    frames = [whole[a:b] for a, b in pairwise(inside)]
    is_raw = number % 4 == 3
    if is_raw:
        frames = [frame[8:] for frame in frames]
    return _index(frames, is_raw)


def _index(frames: list[bytes], is_raw: bool) -> Original:
    # What the reader gives for whole logs is checked against pymavlink elsewhere.
    data, suffix, head = b"".join(frames), *((".raw", 0) if is_raw else (".tlog", 8))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"whole{suffix}"
        path.write_bytes(data)
        entries = iter(list(TlogReader(path)))
    records, at = [], 0
    for frame in frames:
        is_wanted = int.from_bytes(frame[head + 7 : head + 10], "little") in CLASS_OF_ID
        key = _key(next(entries), is_raw) if is_wanted else ()
        records.append(Record(at, at + len(frame), key, is_wanted))
        at += len(frame)
    return Original(data, tuple(records), suffix)


def _key(entry: LogEntry, is_raw: bool) -> tuple:
    return (repr(entry.frame),) if is_raw else (entry.time_s, entry.link, repr(entry.frame))


def make_variant(rng: random.Random, data: bytes) -> Variant:
    """Damage a log in a random way at one to four places."""
    kind = rng.choice(KINDS)
    pieces: list[tuple[int, int] | bytes] = [(0, len(data))]
    copies = False
    for _ in range(rng.randint(1, 4)):
        one = rng.choice(KINDS[:-1]) if kind == "all" else kind
        if one == "shuffles":
            pieces = _shuffled(rng, pieces)
        else:
            junk, copied = _junk(rng, one, data)
            copies |= copied
            pieces = _replaced(rng, pieces, data, one, junk)
    return Variant(tuple(pieces), copies)


def _junk(rng: random.Random, kind: str, data: bytes) -> tuple[bytes, bool]:
    size = rng.choice([1, 2, 7, 8, 9, rng.randint(10, 60), rng.randint(60, 3000)])
    if kind in {"flips", "cuts"}:
        return b"", False
    taste = rng.randrange(4)
    if taste == 0:
        return rng.randbytes(size), False
    if taste == 1:
        return bytes(rng.choices([0xFD, 0xFE, 0, 1, 33, 9, 255], k=size)), False
    if taste == 2:
        return bytes([rng.choice([0, 255, 0xFD, 0xFE])]) * size, False
    begin = rng.randrange(len(data))
    return data[begin : begin + size], True


def _replaced(
    rng: random.Random, pieces: list[tuple[int, int] | bytes], data: bytes, kind: str, junk: bytes
) -> list[tuple[int, int] | bytes]:
    whole = [
        place for place, piece in enumerate(pieces) if isinstance(piece, tuple) and piece[1] - piece[0] > 2
    ]
    if not whole:
        return pieces
    place = rng.choice(whole)
    begin, end = pieces[place]
    at = rng.randrange(begin, end)
    size = {"flips": 1, "insertions": 0, "overwrites": len(junk)}.get(
        kind, rng.choice([1, 8, rng.randint(1, 3000)])
    )
    if kind == "flips":
        junk = bytes([data[at] ^ 1 << rng.randrange(8)])
    after = min(at + size, end)
    parts = [(begin, at), junk, (after, end)]
    kept = [part for part in parts if (part if isinstance(part, bytes) else part[1] > part[0])]
    return [*pieces[:place], *kept, *pieces[place + 1 :]]


def _shuffled(rng: random.Random, pieces: list[tuple[int, int] | bytes]) -> list[tuple[int, int] | bytes]:
    place = max(
        range(len(pieces)),
        key=lambda number: len(range(*pieces[number])) if isinstance(pieces[number], tuple) else 0,
    )
    if isinstance(pieces[place], bytes):
        return pieces
    begin, end = pieces[place]
    cuts = sorted({begin, end, *(rng.randint(begin, end) for _ in range(rng.randint(1, 4)))})
    parts = list(pairwise(cuts))
    rng.shuffle(parts)
    return [*pieces[:place], *parts, *pieces[place + 1 :]]


@dataclass
class Score:
    """What a campaign found."""

    far: int = 0
    found: int = 0
    invented: int = 0
    refused: int = 0
    slowest_s: float = 0.0

    def add(self, seed: int, folder: Path) -> str:
        """Read one variant; return its kind of trouble, if any."""
        rng = random.Random(seed)
        source = original(rng.randrange(28))
        variant = make_variant(rng, source.data)
        path = folder / f"variant{source.suffix}"
        path.write_bytes(variant.build(source.data))
        far = Counter(r.key for r in source.records if r.is_wanted and variant.is_far(r, len(source.data)))
        begin_s = time.process_time()
        try:
            entries = list(TlogReader(path))
        except LogError:
            entries = []
            self.refused += 1
        self.slowest_s = max(self.slowest_s, time.process_time() - begin_s)
        found = Counter(_key(entry, source.suffix == ".raw") for entry in entries)
        missed = far - found
        every = Counter(r.key[-1] for r in source.records if r.is_wanted)
        invented = Counter() if variant.copies else Counter(repr(e.frame) for e in entries) - every
        self.far += far.total()
        self.found += far.total() - missed.total()
        self.invented += invented.total()
        return f"missed {missed} invented {invented}" if missed or invented else ""


def campaign(seeds: range, folder: Path, *, verbose: bool = False) -> Score:
    """Read the variants of all these seeds."""
    score = Score()
    for seed in seeds:
        trouble = score.add(seed, folder)
        if trouble and verbose:
            print(f"seed {seed}: {trouble[:600]}")
    return score


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=100_000)
    parser.add_argument("--first", type=int, default=0)
    args = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        score = campaign(range(args.first, args.first + args.count), Path(folder), verbose=True)
    print(f"{args.count} variants: {score}, {score.found / score.far:.5%} of the far frames found")
    return 0 if score.found >= 0.99 * score.far else 1


if __name__ == "__main__":
    sys.exit(main())
