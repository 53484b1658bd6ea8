"""Where tasks are done on this machine: one after the other, or in processes."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Iterable
from concurrent.futures import BrokenExecutor, Future, ProcessPoolExecutor
from typing import Any, Protocol
from weakref import WeakSet

from mavlink_bridge.many.task import Outcome, Task, outcome_of

Function = Callable[[Task[Any]], Any]


class WorkerPool(Protocol):
    """Does tasks somewhere; `workers.Workers` asks it, and knows nothing of where."""

    def count(self) -> int:
        """Return how many tasks are done at the same time."""

    def submit(self, function: Function, task: Task[Any]) -> Future[Any]:
        """Begin a task."""

    def outcome(self, future: Future[Any], function: Function, task: Task[Any]) -> Outcome[Any] | Future[Any]:
        """Return what came of a task whose future has ended, or the future of another try.

        Raises
        ------
        concurrent.futures.BrokenExecutor
            A process died, and nobody knows at which task.
        ClusterError
            The cluster is of no use any more.
        """

    def mend(self) -> None:
        """Make it fit again after a lost worker took others' tasks with it."""

    def drop(self, futures: Iterable[Future[Any]]) -> None:
        """Drop tasks that nobody waits for any more."""

    def close(self) -> None:
        """End it, and with it what is under way."""


class InTurn:
    """Does each task at once, in this process."""

    def count(self) -> int:
        """Return one."""
        return 1

    def submit(self, function: Function, task: Task[Any]) -> Future[Any]:
        """Do a task."""
        future: Future[Any] = Future()
        future.set_result(outcome_of(function, task))
        return future

    def outcome(self, future: Future[Any], function: Function, task: Task[Any]) -> Outcome[Any]:  # noqa: ARG002 - as every backend
        """Return what came of a task."""
        return _outcome(future)

    def mend(self) -> None:
        """Do nothing: who does them cannot be lost."""

    def drop(self, futures: Iterable[Future[Any]]) -> None:
        """Do nothing: whatever was begun is done."""

    def close(self) -> None:
        """Do nothing, for the same reason."""


class Processes:
    """Does tasks in processes of its own.

    Raises
    ------
    ImportError, NotImplementedError, OSError
        There can be none, as in a sandbox without shared memory.
    """

    def __init__(self, count: int) -> None:
        self._count = count
        self._others = set(multiprocessing.active_children())
        self._pool = _pool(count)
        self._futures: WeakSet[Future[Any]] = WeakSet()

    def count(self) -> int:
        """Return the number of processes."""
        return self._count

    def submit(self, function: Function, task: Task[Any]) -> Future[Any]:
        """Hand a task to a process."""
        try:
            future: Future[Any] = self._pool.submit(outcome_of, function, task)
        except BrokenExecutor as error:  # a process died between two calls
            future = Future()
            future.set_exception(error)
        self._futures.add(future)
        return future

    def outcome(self, future: Future[Any], function: Function, task: Task[Any]) -> Outcome[Any]:  # noqa: ARG002 - as every backend
        """Return what came of a task."""
        return _outcome(future)

    def mend(self) -> None:
        """Take new processes: a pool of which one has died takes no more tasks."""
        self._pool.shutdown()
        self._pool = _pool(self._count)

    def drop(self, futures: Iterable[Future[Any]]) -> None:
        """End the processes in the middle of what they are at, and take new ones."""
        if not all(future.done() for future in futures):
            self.close()
            self._pool = _pool(self._count)

    def close(self) -> None:
        """End the processes, whatever they are at."""
        if not all(future.done() for future in self._futures):
            # no future is cancelled: Python before 3.12 stumbles over one when a process has ended
            for process in set(multiprocessing.active_children()) - self._others:
                process.terminate()
        self._pool.shutdown()


def _outcome(future: Future[Any]) -> Outcome[Any]:
    """Return the outcome in a future; what hinders a task or its outcome on its way to or from a process (it cannot be pickled) is the task's error."""
    try:
        outcome: Outcome[Any] = future.result()
    except BrokenExecutor:
        raise
    except Exception as error:  # noqa: BLE001 - as in `outcome_of`
        return Outcome(error=error)
    return outcome


def _pool(count: int) -> ProcessPoolExecutor:
    context = multiprocessing.get_context("spawn")  # a fork would copy the progress bar's thread half alive
    return ProcessPoolExecutor(count, mp_context=context, initializer=_begin)


def _begin() -> None:
    """Make a new process end without a word when the terminal's Ctrl-C or the end of its parent asks for it."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    """End when the parent does, killed or not: else an idle process would wait for ever."""
    parent = multiprocessing.parent_process()
    assert parent is not None
    parent.join()
    os._exit(1)
