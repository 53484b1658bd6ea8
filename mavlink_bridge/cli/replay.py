"""``pbpp replay``: the bridge's director over recorded logs, and its events compared with what was expected."""

from __future__ import annotations

import time
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from mavlink_bridge.cli.drawing import progress_bar
from mavlink_bridge.cli.failing import ExitCode, Level, error_line, error_name, exit_code_of, telling
from mavlink_bridge.cli.kept_files import write_kept
from mavlink_bridge.cli.log_times import log_begin
from mavlink_bridge.cli.plan_request import request_from_options
from mavlink_bridge.cli.terminal import echo, print_json, say
from mavlink_bridge.director import Orders, TargetSource
from mavlink_bridge.errors import LogError, UsageError
from mavlink_bridge.link import open_transport, parse_connection
from mavlink_bridge.logbook import SteadyClock
from mavlink_bridge.logbook.playback import vehicle_frames
from mavlink_bridge.many import open_workers
from mavlink_bridge.mavlink.codec import Codec
from mavlink_bridge.replay.expectations import differences, expectation_path, read_expectation, to_expect
from mavlink_bridge.replay.replay import replay_done, replay_log, replay_task

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
    judge = _Judge(options)
    teller = _Teller(options)
    single = len(options.logs) == 1 and options.cluster is None
    if single or options.speed is not None:
        _one_after_the_other(options, orders, teller, judge)
    else:
        _many(options, orders, teller, judge)
    raise typer.Exit(judge.exit_code())


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

    def fail(self, log: Path, error: Exception) -> None:
        """Report that one log of several cannot be used; the others are replayed all the same."""
        if self._wants_json:
            print_json(
                {"log": log.name, "status": "error", "error": error_name(error), "message": error_line(error)}
            )
        say(f"error: {error_line(error)}", typer.colors.RED)


class _Judge:
    """Compares what each log told with what was expected of it, or records it; keeps of it only what is still needed.

    Raises
    ------
    LogError
        An expectation cannot be read: before any log is.
    """

    def __init__(self, options: ReplayOptions) -> None:
        self._expect = options.expect
        self._records = options.record
        self._is_quiet = options.is_silent
        self._codes: list[ExitCode] = []
        self._found: list[str] = []
        self._count = 0
        self._together: list[_Told] | None = None
        if self._expect is not None and self._expect.is_dir():
            self._count = sum(len(read_expectation(self._path(log))) for log in options.logs)
        elif self._expect is not None:
            self._together = []
            self._count = len(read_expectation(self._expect))

    def _path(self, log: Path) -> Path:
        assert self._expect is not None
        return self._expect / expectation_path(log).name

    def take(self, log: Path, told: list[_Told]) -> None:
        """Take a log's events."""
        if self._together is not None:
            self._together += told
        elif self._expect is not None:
            self._found += differences(read_expectation(self._path(log)), told)
        if self._records:
            path = expectation_path(log)
            write_kept(path, to_expect(told).encode())
            if not self._is_quiet:
                echo(f"Wrote {path}")

    def fail(self, log: Path, error: Exception) -> None:
        """Note that a log could not be replayed: nothing of what was expected came."""
        self._codes.append(exit_code_of(error))
        if self._expect is not None and self._together is None:
            self._found += differences(read_expectation(self._path(log)), [])

    def exit_code(self) -> ExitCode:
        """Report what was not as expected; return the exit code."""
        if self._together is not None:
            assert self._expect is not None
            self._found += differences(read_expectation(self._expect), self._together)
        for line in self._found:
            say(line)
        if self._found:
            say("- expected but missing; + not expected; ~ different")
            return ExitCode.CHECK
        if self._expect is not None and not self._is_quiet:
            many = self._count != 1
            echo(f"As expected: all {self._count} events came" if many else "As expected: the one event came")
        return min(self._codes, default=ExitCode.DONE)


def _one_after_the_other(options: ReplayOptions, orders: Orders, teller: _Teller, judge: _Judge) -> None:
    """Replay logs here; print each event when it comes."""
    for log in options.logs:
        wait = None if options.speed is None else _PlaySpeed(options.speed).wait
        told: list[_Told] = []
        try:
            teller.begin(log)
            for event in replay_log(log, orders, wait):
                told.append({"log": log.name, **event.as_json()})
                teller.tell(told[-1])
        except LogError as error:
            if len(options.logs) == 1:
                raise
            teller.fail(log, error)
            judge.fail(log, error)
        else:
            judge.take(log, told)


def _many(options: ReplayOptions, orders: Orders, teller: _Teller, judge: _Judge) -> None:
    """Replay many logs with workers; print each one's events in the order in which the logs were given."""
    logs = options.logs
    tasks = (replay_task(log, orders) for log in logs)
    with (
        open_workers(options.jobs, options.cluster, most=len(logs)) as workers,
        progress_bar(quiet=teller.is_quiet) as show,
    ):
        for done in workers.results(replay_done, tasks):
            log = logs[done.number]
            show(log.name, done.number + 1, len(logs))
            if done.error is not None:
                teller.fail(log, done.error)
                judge.fail(log, done.error)
                continue
            told = done.result()
            teller.begin(log)
            for event in told:
                teller.tell(event)
            judge.take(log, told)


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
