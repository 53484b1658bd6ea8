"""Tasks streamed through workers on this machine: each result once, in bounded memory, whatever becomes of one task or of its process."""

from __future__ import annotations

import multiprocessing
import os
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from many import work

from mavlink_bridge.errors import ClusterError, LostWorkerError
from mavlink_bridge.many import Finished, Task, open_workers
from mavlink_bridge.many.task import Outcome, outcome_of
from mavlink_bridge.many.workers import AHEAD, Workers


def numbers(count):
    return [Task(number) for number in range(count)]


class Threads:
    """A backend of threads, which end in any order."""

    def __init__(self, count: int) -> None:
        self._count = count
        self._pool = ThreadPoolExecutor(count)

    def count(self):
        return self._count

    def submit(self, function, task):
        return self._pool.submit(outcome_of, function, task)

    def outcome(self, future, function, task):
        return future.result()

    def drop(self, futures):
        assert not futures

    def close(self):
        self._pool.shutdown()


@given(st.integers(1, 5), st.integers(0, 40), st.booleans())
def test_each_result_comes_once_and_few_are_taken_ahead(workers, count, in_order):
    backend = Threads(workers)
    taken = []

    def tasks():
        for task in numbers(count):
            taken.append(task)
            yield task

    told = []
    for done in Workers(backend).results(work.square, tasks(), in_order=in_order):
        told.append(done)
        assert len(taken) - len(told) <= AHEAD * workers
    assert sorted(done.number for done in told) == list(range(count))
    assert all(done.result() == done.number**2 for done in told)
    if in_order:
        assert [done.number for done in told] == list(range(count))
    backend.close()


@pytest.mark.parametrize("jobs", [1, 2])
def test_a_tasks_error_is_its_own(jobs):
    with open_workers(jobs) as workers:
        done = list(workers.results(work.square_or_raise, numbers(12)))
        odd = list(workers.results(work.raise_what_nobody_can_pickle, numbers(1)))
    assert [one.value for one in done if one.error is None] == [n * n for n in range(12) if n % 5 != 3]
    failed = [one for one in done if one.error is not None]
    assert [(one.number, str(one.error)) for one in failed] == [(3, "3 is not liked"), (8, "8 is not liked")]
    assert "square_or_raise" in failed[0].error.__notes__[0]
    with pytest.raises(ValueError, match="3 is not liked"):
        failed[0].result()
    assert str(odd[0].error) == "ValueError: held by a lock"


def test_a_task_that_kills_its_process_takes_no_other_with_it():
    with open_workers(2) as workers:
        done = list(workers.results(work.square_or_die, numbers(8), in_order=False))
        after = [one.result() for one in workers.results(work.square, numbers(3))]
    assert sorted(one.number for one in done) == list(range(8))
    assert {one.number: one.value for one in done if one.error is None} == {
        n: n * n for n in range(8) if n != 3
    }
    assert [type(one.error) for one in done if one.error is not None] == [LostWorkerError]
    assert after == [0, 1, 4]


def test_what_cannot_be_sent_is_an_error_of_its_task():
    with open_workers(2) as workers:
        done = list(workers.results(work.square, [Task(2), Task(lambda: 2), Task(3)]))
    assert [one.value for one in done] == [4, None, 9]
    assert "pickle" in str(done[1].error).lower()


def test_leaving_early_ends_what_is_under_way(tmp_path):
    begun_s = time.monotonic()
    tasks = (Task((0.01 if number in (0, 8) else 60.0, str(tmp_path))) for number in range(100))
    with open_workers(2) as workers:
        first = next(workers.results(work.slow, tasks))
        kept = workers.results(work.slow, tasks)
        assert next(kept).value is not None
    assert first.value is not None
    assert time.monotonic() - begun_s < 30.0
    assert multiprocessing.active_children() == []
    assert len(list(tmp_path.iterdir())) == 2


def test_processes_end_with_a_parent_that_is_killed(tmp_path):
    program = (
        "from mavlink_bridge.many import Task, open_workers\nfrom many import work\n"
        "if __name__ == '__main__':\n with open_workers(2) as workers:\n"
        f"  for done in workers.results(work.slow, [Task((0.01, {str(tmp_path)!r}))] * 2 + [Task((60, ''))] * 9):\n"
        "   print(done.value, flush=True)\n"
    )
    script = tmp_path / "program.py"
    script.write_text(program)
    path = str(Path(__file__).parents[1])
    said = (
        tmp_path / "said.txt"
    )  # multiprocessing tells that a killed program has cleaned up nothing: not the tests' leak
    with (
        said.open("w") as errors,
        subprocess.Popen(
            [sys.executable, str(script)],
            stdout=subprocess.PIPE,
            stderr=errors,
            text=True,
            env={**os.environ, "PYTHONPATH": path},
        ) as process,
    ):
        workers = {int(process.stdout.readline()) for _ in range(2)}
        process.kill()
    until_s = time.monotonic() + 30.0
    while any(map(lives, workers)) and time.monotonic() < until_s:
        time.sleep(0.05)
    assert not any(map(lives, workers))


def lives(process_id: int) -> bool:
    """Return whether a process runs; one that has ended and that nobody has asked for does not."""
    try:
        os.kill(process_id, 0)
        return Path(f"/proc/{process_id}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


def test_no_more_processes_than_tasks(monkeypatch):
    monkeypatch.setattr("mavlink_bridge.many.workers.Processes", None)
    with open_workers(8, most=1) as workers:
        assert [done.value for done in workers.results(work.square, numbers(2))] == [0, 1]


@pytest.mark.parametrize("error", [OSError, ImportError, NotImplementedError])
def test_without_shared_memory_one_after_the_other(monkeypatch, error):
    def pool(*_arguments, **_options):
        raise error("no semaphores here")

    monkeypatch.setattr("mavlink_bridge.many.backend.ProcessPoolExecutor", pool)
    with open_workers(2) as workers:
        assert [done.value for done in workers.results(work.square, numbers(3))] == [0, 1, 4]


def test_without_dask_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "mavlink_bridge.many.cluster", None)
    with (
        pytest.raises(ClusterError, match="--cluster needs the package distributed") as caught,
        open_workers(cluster="tcp://127.0.0.1:1"),
    ):
        pass
    assert "pbpp-rover[cluster]" in caught.value.details["advice"]


def test_a_value_may_be_none():
    assert Finished(0, Task(1)).result() is None
    assert Outcome() == outcome_of(lambda task: None, Task(1))
