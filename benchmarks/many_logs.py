"""How ten thousand logs become a dataset: time, memory, size, and how long questions take.

``python benchmarks/many_logs.py FOLDER [--logs 1000] [--jobs 1] [-o FILE]`` makes so many logs in FOLDER/logs (our recordings with other times, over a year, and
other system ids, twenty of them; those that are there stay), builds FOLDER/dataset anew, asks every ready question, adds ten logs and builds again, and compares the
rows of 200 logs drawn at random (fewer where there are fewer) with those of ``pbpp log --json``. Every step is a process of its own whose CPU time and peak memory count,
workers included.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import resource
import shutil
import subprocess
import sys
import threading
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parent.parent))

from binascii import crc_hqx

from mavlink_bridge.dataset.questions import QUESTIONS
from mavlink_bridge.dataset.rows import checksum_of, document_rows, log_name, mark_of
from mavlink_bridge.dataset.schema import TABLES
from mavlink_bridge.dataset.store import Dataset
from mavlink_bridge.tlog.checksum import _REVERSED
from mavlink_bridge.tlog.wire import CLASS_OF_ID, CRC_SEED, LAYOUTS

HERE = Path(__file__).parent
LOGS = sorted((HERE.parent / "sitl_logs").glob("*.tlog"))
SYSTEMS = 20
FIRST_S = 1_735_689_600  # 2025-01-01
YEAR_S = 365 * 86_400


@dataclass(frozen=True)
class Template:
    """A recording of one vehicle: its bytes, and where its times stand."""

    data: np.ndarray
    times_at: np.ndarray
    times_us: np.ndarray

    def at(self, begin_us: int) -> bytes:
        """Return the recording as if it had begun then."""
        moved = (self.times_us - (self.times_us[0] & ~np.uint64(3)) + np.uint64(begin_us & ~3)).astype(">u8")
        data = self.data.copy()
        data[self.times_at[:, None] + np.arange(8)] = moved.view(np.uint8).reshape(-1, 8)
        return data.tobytes()


def template(log: Path, system: int) -> Template:
    """Return a recording with another system id for its vehicle, in headers and in what is addressed to it."""
    data = bytearray(log.read_bytes())
    at, times_at = 0, []
    while at < len(data):
        times_at.append(at)
        frame, size = at + 8, data[at + 9]
        message_id = int.from_bytes(data[frame + 7 : frame + 10], "little")
        is_changed = data[frame + 5] == 1
        if is_changed:
            data[frame + 5] = system
        if message_id in CLASS_OF_ID:
            fields = LAYOUTS[CLASS_OF_ID[message_id]].dtype.fields
            offset = fields["target_system"][1] if "target_system" in fields else size
            if offset < size and data[frame + 10 + offset] == 1:
                data[frame + 10 + offset] = system
                is_changed = True
        end = frame + 10 + size
        if is_changed:
            covered = bytes(data[frame + 1 : end]) + bytes([CRC_SEED[message_id]])
            data[end : end + 2] = (
                crc_hqx(covered.translate(_REVERSED), 0xFFFF).to_bytes(2, "big").translate(_REVERSED)
            )
        at = end + 2
    places = np.array(times_at)
    whole = np.frombuffer(bytes(data), np.uint8)
    times = whole[places[:, None] + np.arange(8)].copy().view(">u8").astype(np.uint64).reshape(-1)
    return Template(whole, places, times)


def make_logs(folder: Path, first: int, count: int) -> list[Path]:
    """Write so many logs, each of one of twenty vehicles, spread over a year; those that are there stay."""
    folder.mkdir(parents=True, exist_ok=True)
    made: dict[tuple[Path, int], Template] = {}
    paths = []
    for number in range(first, first + count):
        path = folder / f"{number:06d}.tlog"
        paths.append(path)
        if path.exists():
            continue
        log, system = LOGS[number % len(LOGS)], 1 + number // len(LOGS) % SYSTEMS
        key = (log, system)
        made.setdefault(key, template(*key))
        begin_s = FIRST_S + random.Random(number).uniform(0, YEAR_S)
        path.write_bytes(made[key].at(int(begin_s * 1e6)))
    return paths


def measured(*words: str) -> tuple[float, float, int, str]:
    """Run pbpp; return CPU seconds, seconds, the most memory of it and its workers together in MB, and what it printed."""
    before, begun_s = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    process = subprocess.Popen(
        [sys.executable, "-m", "mavlink_bridge.cli", *words], stdout=subprocess.PIPE, text=True
    )
    peak = [0]

    def watch() -> None:
        while process.poll() is None:
            peak[0] = max(peak[0], sum(map(_proportional_kb, _family(process.pid))))
            time.sleep(0.1)

    watcher = threading.Thread(target=watch)
    watcher.start()
    out, _ = process.communicate()
    watcher.join()
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    cpu_s = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    if process.returncode:
        raise SystemExit(f"pbpp {' '.join(words)} ended with {process.returncode}\n{out}")
    return cpu_s, time.perf_counter() - begun_s, peak[0] // 1024, out


def _family(process: int) -> list[int]:
    try:
        children = Path(f"/proc/{process}/task/{process}/children").read_text().split()
    except OSError:
        return []
    return [process, *(one for child in children for one in _family(int(child)))]


def _proportional_kb(process: int) -> int:
    """Return a process's memory, shared pages counted once among those that share them."""
    try:
        lines = Path(f"/proc/{process}/smaps_rollup").read_text().splitlines()
    except OSError:
        return 0
    return sum(int(line.split()[1]) for line in lines if line.startswith("Pss:"))


def same_rows(dataset: Path, paths: list[Path]) -> int:
    """Return for how many logs the dataset has other rows than ``pbpp log --json`` tells."""
    database = Dataset(dataset).open()
    wrong = 0
    for begin in range(0, len(paths), 20):
        some = paths[begin : begin + 20]
        _, _, _, out = measured("log", "--json", *map(str, some))
        for path, document in zip(some, json.loads(out)["logs"], strict=True):
            checksum = checksum_of(path)
            wanted = document_rows(document, checksum, mark_of(path))
            for name, rows in wanted.items():
                table = TABLES[name]
                columns = [*table.names, *(["vehicle"] if table.is_partitioned else [])]
                shown = ", ".join(f"epoch({one})" if one == "begins_utc" else one for one in columns)
                found = database.execute(
                    f"SELECT {shown} FROM {name} WHERE log = ?", [log_name(checksum)]
                ).fetchall()
                if sorted(map(_plain, found)) != sorted(map(_plain, rows)):
                    wrong += 1
                    print(f"{path.name}: {name} differs", file=sys.stderr)
                    break
    return wrong


def _plain(row: tuple[object, ...]) -> str:
    return repr([round(float(one), 5) if isinstance(one, (int, float)) else one for one in row])


def main() -> None:
    """Run it all and print a table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--logs", type=int, default=1000)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("-o", "--output", type=Path)
    options = parser.parse_args()
    logs, dataset = options.folder / "logs", options.folder / "dataset"
    paths = make_logs(logs, 0, options.logs)
    for stale in set(logs.glob("*.tlog")) - set(paths):
        stale.unlink()
    shutil.rmtree(dataset, ignore_errors=True)
    logs_bytes = sum(path.stat().st_size for path in paths)
    lines = [
        f"{options.logs} logs, {logs_bytes / 1e6:.0f} MB, --jobs {options.jobs}, {os.cpu_count()} processors, Python {sys.version.split()[0]}",
        "",
    ]
    lines += ["| step | CPU s | s | peak memory, MB |", "|---|---|---|---|"]

    def step(name: str, *words: str) -> float:
        cpu_s, took_s, peak_mb, _ = measured(*words)
        lines.append(f"| {name} | {cpu_s:.2f} | {took_s:.2f} | {peak_mb} |")
        print(lines[-1], flush=True)
        return cpu_s

    built_s = step("build", "logs", "build", str(logs), "-o", str(dataset), "--jobs", str(options.jobs), "-q")
    for question in QUESTIONS:
        step(f"ask {question}", "logs", "ask", str(dataset), question, "--json")
    more = make_logs(logs, options.logs, 10)
    again_s = step(
        "build again, 10 new logs", "logs", "build", str(logs), "-o", str(dataset), "--jobs", "1", "-q"
    )
    size = sum(path.stat().st_size for path in dataset.rglob("*") if path.is_file())
    drawn = random.Random(1).sample([*paths, *more], min(200, options.logs))
    wrong = same_rows(dataset, drawn)
    lines += [
        "",
        f"- {built_s / options.logs:.4f} CPU s a log: {built_s / options.logs * 10_000 / 60:.1f} CPU minutes for 10,000",
        f"- the dataset has {size / 1e6:.1f} MB in {sum(1 for _ in dataset.rglob('*.parquet'))} files, {size / logs_bytes:.1%} of the logs' size",
        f"- building again with 10 new logs took {again_s / built_s:.2%} of the CPU time",
        f"- of {len(drawn)} logs drawn at random {wrong} have other rows than `pbpp log --json` tells",
    ]
    print("\n".join(lines))
    if options.output:
        options.output.write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
