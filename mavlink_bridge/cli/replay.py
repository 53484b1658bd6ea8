"""``pbpp replay``: the bridge's director over recorded logs, and its events compared with what was expected."""

from __future__ import annotations

import multiprocessing
import os
import time
from concurrent.futures import ProcessPoolExecutor
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from mavlink_bridge.cli.drawing import progress_bar
from mavlink_bridge.cli.failing import ExitCode, Level, telling
from mavlink_bridge.cli.kept_files import write_kept
from mavlink_bridge.cli.log_times import log_begin
from mavlink_bridge.cli.plan_request import request_from_options
from mavlink_bridge.cli.terminal import echo, print_json, say
from mavlink_bridge.director import Orders, TargetSource
from mavlink_bridge.errors import LogError, UsageError
from mavlink_bridge.link import open_transport, parse_connection
from mavlink_bridge.logbook import SteadyClock
from mavlink_bridge.logbook.playback import vehicle_frames
from mavlink_bridge.mavlink.codec import Codec
from mavlink_bridge.replay.expectations import differences, expectation_path, read_expectation, to_expect
from mavlink_bridge.replay.replay import replay_log, replay_to_json

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

    from mavlink_bridge.cli.options.replay import ReplayOptions

_Told = dict[str, Any]


def replay(options: ReplayOptions) -> None:
    """Replay, record or compare logs; or play one to a client."""
    if options.send is not None:
        if len(options.logs) > 1 or options.record or options.expect is not None:
            raise UsageError("--send plays one LOG; it cannot be combined with --record or --expect")
        _send(options, options.send)
        return
    orders = Orders(
        system=options.system,
        any_vehicle=options.any_vehicle,
        request=request_from_options(None, [], options.clearance, options.corner_allowance, 0.0, "optimal"),
        target_sources=frozenset(TargetSource) - {TargetSource.ECHO, TargetSource.RALLY},
    )
    expected = _expected(options.logs, options.expect)
    teller = _Teller(options)
    results = _replayed(options.logs, orders, options.speed, options.jobs, teller)
    if options.record:
        _record(results, quiet=options.is_silent)
    if not _is_as_expected(expected, results, quiet=options.is_silent):
        raise typer.Exit(ExitCode.CHECK)
    if any(isinstance(result, LogError) for result in results.values()):
        raise typer.Exit(ExitCode.INPUT)


class _Teller:
    """Puts events on stdout, as they come: JSON with the log's own times, lines for people with seconds since its begin."""

    def __init__(self, options: ReplayOptions) -> None:
        self.is_quiet = options.is_silent
        self._wants_json = options.json_output
        self._names_logs = len(options.logs) > 1
        self._begin_s = 0.0

    def begin(self, log: Path) -> None:
        """Note that a log begins; events that follow belong to it."""
        if self._wants_json:
            return
        begin = log_begin(log)
        self._begin_s = begin.time_s
        if not self.is_quiet:
            echo(f"{log.name}: {begin}")

    def tell(self, event: _Told) -> None:
        if not telling().prints(Level.of_severity(event["severity"])):
            return
        if self._wants_json:
            print_json(event)
        else:
            prefix = f"{event['log']}: " if self._names_logs else ""
            echo(f"{prefix}{event['time_s'] - self._begin_s:8.2f} s  {event['event']}: {event['text']}")

    def fail(self, log: Path, error: LogError) -> None:
        """Report that one log of several cannot be used; the others are replayed all the same."""
        if self._wants_json:
            print_json({"log": log.name, "status": "error", "error": "LogError", "message": str(error)})
        say(f"error: {error}", typer.colors.RED)


_Results = dict[Path, list[_Told] | LogError]


def _replayed(
    logs: list[Path], orders: Orders, speed: float | None, jobs: int | None, teller: _Teller
) -> _Results:
    """Replay the logs; print each one's events in the order in which the logs were given."""
    workers = min(jobs or os.cpu_count() or 1, len(logs))
    pool = None if len(logs) == 1 or speed is not None or workers == 1 else _pool(workers)
    if pool is None:
        return _one_after_the_other(logs, orders, speed, teller)
    return _side_by_side(logs, orders, pool, teller)


def _pool(workers: int) -> ProcessPoolExecutor | None:
    """Return worker processes; None where there can be none, as in a sandbox without shared memory."""
    context = multiprocessing.get_context("spawn")  # a fork would copy the progress bar's thread half alive
    try:
        return ProcessPoolExecutor(workers, mp_context=context)
    except (ImportError, NotImplementedError, OSError):
        return None


def _one_after_the_other(logs: list[Path], orders: Orders, speed: float | None, teller: _Teller) -> _Results:
    results: _Results = {}
    for log in logs:
        wait = None if speed is None else _PlaySpeed(speed).wait
        told: list[_Told] = []
        try:
            teller.begin(log)
            for event in replay_log(log, orders, wait):
                told.append({"log": log.name, **event.as_json()})
                teller.tell(told[-1])
        except LogError as error:
            if len(logs) == 1:
                raise
            teller.fail(log, error)
            results[log] = error
        else:
            results[log] = told
    return results


def _side_by_side(logs: list[Path], orders: Orders, pool: ProcessPoolExecutor, teller: _Teller) -> _Results:
    results: _Results = {}
    try:
        futures = {log: pool.submit(replay_to_json, log, orders) for log in logs}
        with progress_bar(quiet=teller.is_quiet) as show:
            for number, (log, future) in enumerate(futures.items()):
                show(log.name, number, len(logs))
                try:
                    results[log] = future.result()
                except LogError as error:
                    teller.fail(log, error)
                    results[log] = error
                    continue
                teller.begin(log)
                for event in results[log]:  # type: ignore[union-attr]
                    teller.tell(event)
    finally:
        pool.shutdown(cancel_futures=True)
    return results


def _expected(logs: list[Path], expect: Path | None) -> dict[Path | None, list[_Told]]:
    """Read what is expected: of each log by itself, or (under None) of all together."""
    if expect is None:
        return {}
    if expect.is_dir():
        return {log: read_expectation(expect / expectation_path(log).name) for log in logs}
    return {None: read_expectation(expect)}


def _is_as_expected(expected: dict[Path | None, list[_Told]], results: _Results, *, quiet: bool) -> bool:
    found = []
    for log, events in expected.items():
        chosen = results.values() if log is None else [results[log]]
        told = [event for result in chosen if not isinstance(result, LogError) for event in result]
        found += differences(events, told)
    for line in found:
        say(line)
    if found:
        say("- expected but missing; + not expected; ~ different")
    elif expected and not quiet:
        count = sum(map(len, expected.values()))
        echo(f"As expected: all {count} events came" if count != 1 else "As expected: the one event came")
    return not found


def _record(results: _Results, *, quiet: bool) -> None:
    for log, told in results.items():
        if isinstance(told, LogError):
            continue
        path = expectation_path(log)
        write_kept(path, to_expect(told).encode())
        if not quiet:
            echo(f"Wrote {path}")


class _PlaySpeed:
    """Lets a log's time pass, so many times faster than it did."""

    def __init__(self, speed: float) -> None:
        self._speed = speed
        self._begun_s = time.monotonic()

    def wait(self, elapsed_s: float) -> None:
        """Wait until so many of the log's seconds have passed."""
        time.sleep(max(0.0, self.left_s(elapsed_s)))

    def left_s(self, elapsed_s: float) -> float:
        """Return how long it is until so many of the log's seconds have passed."""
        return self._begun_s + elapsed_s / self._speed - time.monotonic()


def _send(options: ReplayOptions, connection: str) -> None:
    """Play the vehicle's side of a log; what the client sends shows only that it is there."""
    is_called = parse_connection(connection).kind == "udpin"
    frames = vehicle_frames(options.logs[0], options.system, any_vehicle=options.any_vehicle)
    codec = Codec(1, 1)  # it only listens: the frames go out as they are in the log
    with closing(open_transport(connection)) as transport, progress_bar(quiet=options.is_silent) as show:

        def listen(timeout_s: float) -> bool:
            heard = [
                source
                for source, data in transport.receive(timeout_s)
                if codec.decode_with_bytes(data, source)
            ]
            for source in heard:
                transport.heard(source)
            return bool(heard)

        if is_called:
            show(f"waiting for a client on {connection}", 0, 0)
            while not listen(0.5):
                pass
        count = _play(frames, options.speed or 1.0, transport.send, listen, show)
    if not options.is_silent:
        echo(f"Sent {count} messages")


def _play(
    frames: Iterable[tuple[float, bytes]],
    speed: float,
    send: Callable[[bytes], None],
    listen: Callable[[float], bool],
    show: Callable[[str, int, int], None],
) -> int:
    pace = _PlaySpeed(speed)
    count = 0
    for elapsed_s, data in _elapsed(frames):
        while (left_s := pace.left_s(elapsed_s)) > 0:
            listen(min(left_s, 0.5))
        send(data)
        count += 1
        if count % 50 == 0:
            show(f"{elapsed_s:.0f} s", count, 0)
    return count


def _elapsed(frames: Iterable[tuple[float, bytes]]) -> Iterator[tuple[float, bytes]]:
    """Return the seconds since the first frame, by a clock that only goes forward."""
    clock = SteadyClock()
    begin_s: float | None = None
    for time_s, data in frames:
        now_s = clock.advance(time_s, None)
        begin_s = now_s if begin_s is None else begin_s
        yield now_s - begin_s, data
