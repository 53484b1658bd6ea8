"""How fast the log reader is against pymavlink, on a log of over half a million messages made by repeating ours.

Run ``python benchmarks/tlog.py``; it makes the log in a temporary folder, extracts fence, targets, positions and parameters in four ways
within one run, checks that all found the same, and prints times, ratios and the reader's peak memory.
"""

from __future__ import annotations

import argparse
import struct
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from pymavlink import mavutil

from mavlink_bridge.mavlink import messages as m
from mavlink_bridge.mavlink.codec import to_frame
from mavlink_bridge.tlog import LogEntry, TlogReader, read_columns

LOGS = sorted((Path(__file__).parent.parent / "sitl_logs").glob("*.tlog"))
WANTED = [
    m.MissionCount,
    m.MissionItemInt,
    m.MissionAck,
    m.CommandInt,
    m.SetPositionTargetGlobalInt,
    m.GlobalPositionInt,
    m.ParamValue,
]
NAMES = [m.wire_name(message_class) for message_class in WANTED]
MEMORY = """
import sys
from pathlib import Path
from benchmarks.tlog import WANTED
from mavlink_bridge.tlog import TlogReader
count = sum(1 for _ in TlogReader(Path(sys.argv[1]), WANTED))
status = Path("/proc/self/status").read_text()
print(next(int(line.split()[1]) // 1024 for line in status.splitlines() if line.startswith("VmHWM")))
"""


def make_log(path: Path, least: int) -> int:
    """Repeat our logs, each time later than the one before, until at least so many messages are in."""
    count, shift_us, end_us = 0, 0, 0
    with path.open("wb") as file:
        while count < least:
            for log in LOGS:
                records = list(_records(log.read_bytes()))
                shift_us = max(0, end_us - records[0][0]) & ~3
                file.writelines(struct.pack(">Q", time_us + shift_us) + frame for time_us, frame in records)
                end_us = records[-1][0] + shift_us + 1_000_000
                count += len(records)
    return count


def _records(data: bytes) -> Iterator[tuple[int, bytes]]:
    at = 0
    while at < len(data):
        end = at + 8 + 12 + data[at + 9]  # ours are MAVLink 2 and not signed
        yield int.from_bytes(data[at : at + 8], "big"), data[at + 8 : end]
        at = end


def by_reader(path: Path) -> list[LogEntry]:
    """Extract with our reader, as message objects."""
    return list(TlogReader(path, WANTED))


def by_columns(path: Path) -> int:
    """Extract with our reader, as columns, one type after the other."""
    return sum(len(read_columns(path, message_class)["time_s"]) for message_class in WANTED)


def by_full_decode(path: Path) -> list[Any]:
    """Extract with pymavlink, everything decoded."""
    log = mavutil.mavlogfile(str(path))
    found = []
    while (raw := log.recv_msg()) is not None:
        if raw.get_type() in NAMES:
            found.append(raw)
    return found


def by_filter(path: Path) -> list[Any]:
    """Extract with pymavlink's index and type filter."""
    log = mavutil.mavlink_connection(str(path))
    found = []
    while (raw := log.recv_match(type=NAMES)) is not None:
        found.append(raw)
    return found


def timed(work: Callable[[Path], Any], path: Path) -> tuple[float, Any]:
    """Return the CPU seconds of one call, and how many messages it found and their hash."""
    begin_s = time.process_time()
    result = work(path)
    spent_s = time.process_time() - begin_s
    return spent_s, result if isinstance(result, int) else (len(result), hash(tuple(map(comparable, result))))


def comparable(found: Any) -> tuple[int, str]:  # noqa: ANN401 - pymavlink ships no types
    """Return a log entry's time and frame, and those of a message of pymavlink."""
    if isinstance(found, LogEntry):
        return round(found.time_s * 1e6), repr(found.frame)
    return round(found._timestamp * 1e6), repr(to_frame(found))  # noqa: SLF001 - pymavlink's way


def peak_mb(path: Path) -> int:
    """Return the peak memory in MB of a process that reads the log."""
    root = Path(__file__).parent.parent
    answer = subprocess.run(
        [sys.executable, "-c", MEMORY, str(path)], cwd=root, check=True, capture_output=True, text=True
    )
    return int(answer.stdout)


def main() -> int:
    """Measure, print, and fail where a promise is not kept."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--messages", type=int, default=500_000)
    least = parser.parse_args().messages
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "long.tlog"
        count = make_log(path, least)
        print(f"{count} messages, {path.stat().st_size / 1e6:.1f} MB")
        works = (by_reader, by_columns, by_filter, by_full_decode)
        rounds = [[timed(work, path) for work in works] for _ in range(2)]
        memory_mb = peak_mb(path)
    ours_s, columns_s, filter_s, full_s = (
        min(seconds for seconds, _ in runs) for runs in zip(*rounds, strict=True)
    )
    found, columns, filtered, full = (result for _, result in rounds[0])
    same = found == filtered == full and columns == found[0]
    for name, seconds in [
        ("TlogReader", ours_s),
        ("read_columns, one type after the other", columns_s),
        ("pymavlink recv_match(type=...)", filter_s),
        ("pymavlink recv_msg, all decoded", full_s),
    ]:
        print(
            f"{name:40} {seconds:7.3f} s  {count / seconds / 1e6:7.3f} M messages/s  {seconds / ours_s:6.1f} x TlogReader"
        )
    print(
        f"{found[0]} messages wanted; results {'equal' if same else 'DIFFERENT'}; peak memory {memory_mb} MB"
    )
    kept = same and full_s >= 15 * ours_s and filter_s >= 5 * ours_s and memory_mb <= 100
    print("promise (15 x, 5 x, 100 MB)", "kept" if kept else "NOT KEPT")
    return 0 if kept else 1


if __name__ == "__main__":
    sys.exit(main())
