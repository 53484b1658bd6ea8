"""Tasks streamed through workers: a few ahead, each result once, in order or as they come."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Future, wait
from contextlib import contextmanager
from importlib import import_module
from typing import TYPE_CHECKING, Any

from mavlink_bridge.errors import ClusterError, LostWorkerError
from mavlink_bridge.many.backend import InTurn, Processes
from mavlink_bridge.many.task import Asked, Finished, Task, Value

if TYPE_CHECKING:
    from mavlink_bridge.many.backend import WorkerPool

AHEAD = 4
"""Tasks begun or kept back for each worker (chosen, not measured): enough that none waits for the next, and all that is ever in memory."""

_KILLED = "the process that worked on it died, and another one when it was alone; it may need more memory than there is"
_EXTRA = "--cluster needs the package distributed"


class Workers:
    """Workers on this machine or on a cluster, as `open_workers` opens them."""

    def __init__(self, backend: WorkerPool) -> None:
        self._backend = backend

    def results(
        self,
        function: Callable[[Task[Asked]], Value],
        tasks: Iterable[Task[Asked]],
        *,
        in_order: bool = True,
    ) -> Iterator[Finished[Asked, Value]]:
        """Return what comes of each task, each once.

        Parameters
        ----------
        function : callable
            Of a module, so that another process finds it, or a `functools.partial` of one; called with the task.
        tasks : iterable of Task
            Taken as they are needed: `AHEAD` for each worker ahead of what was returned.
        in_order : bool
            In the order of the tasks (what comes too early is kept back), or as they come.

        Raises
        ------
        ClusterError
            The cluster is lost, or a worker with another version joined it.
        """
        run = _RunningTasks(self._backend, function)
        numbered = enumerate(tasks)
        early: dict[int, Finished[Asked, Value]] = {}
        wanted = 0
        try:
            while True:
                room = AHEAD * self._backend.count() - len(early)
                run.fill(numbered, room)
                if run.is_idle:
                    return
                for done in run.next_done():
                    if not in_order:
                        yield done
                        continue
                    early[done.number] = done
                while wanted in early:
                    yield early.pop(wanted)
                    wanted += 1
        finally:
            run.cancel()


class _RunningTasks:
    """The tasks that are under way."""

    def __init__(self, backend: WorkerPool, function: Callable[[Task[Any]], Any]) -> None:
        self._backend = backend
        self._function = function
        self._running: dict[Future[Any], tuple[int, Task[Any]]] = {}

    @property
    def is_idle(self) -> bool:
        """Whether nothing is under way."""
        return not self._running

    def fill(self, numbered: Iterator[tuple[int, Task[Any]]], room: int) -> None:
        """Begin as many tasks as there is room for."""
        while len(self._running) < room and (following := next(numbered, None)) is not None:
            self._running[self._backend.submit(self._function, following[1])] = following

    def next_done(self) -> list[Finished[Any, Any]]:
        """Wait until something is done; return it, in the order of the tasks."""
        ended, _ = wait(self._running, return_when=FIRST_COMPLETED)
        told: list[Finished[Any, Any]] = []
        suspects: list[tuple[int, Task[Any]]] = []
        for future in ended:
            told += self._taken(future, suspects)
        if suspects:
            told += self._one_by_one(suspects)
        return sorted(told, key=lambda done: done.number)

    def _taken(
        self, future: Future[Any], suspects: list[tuple[int, Task[Any]]]
    ) -> Iterator[Finished[Any, Any]]:
        """Return what came of a task that is no longer under way, if anything did."""
        number, task = self._running.pop(future)
        try:
            came = self._backend.outcome(future, self._function, task)
        except BrokenExecutor:
            suspects.append((number, task))
            return
        if isinstance(came, Future):
            self._running[came] = number, task
        else:
            yield Finished(number, task, came.value, came.error)

    def _one_by_one(self, suspects: list[tuple[int, Task[Any]]]) -> Iterator[Finished[Any, Any]]:
        """Do alone each task that was under way when a process died: only the one that kills its own is an error, the others are done."""
        wait(self._running)
        for future in list(self._running):
            yield from self._taken(future, suspects)
        self._backend.mend()
        for number, task in suspects:
            self._running[self._backend.submit(self._function, task)] = number, task
            killers: list[tuple[int, Task[Any]]] = []
            (future,) = wait(self._running).done
            yield from self._taken(future, killers)
            if killers:
                self._backend.mend()
                yield Finished(number, task, error=LostWorkerError(_KILLED))

    def cancel(self) -> None:
        """Cancel what is under way: nobody waits for it any more."""
        self._backend.drop(self._running)
        self._running.clear()


@contextmanager
def open_workers(
    jobs: int | None = None, cluster: str | None = None, *, most: int | None = None
) -> Iterator[Workers]:
    """Open workers; on leaving, what was not done is cancelled.

    Parameters
    ----------
    jobs : int, optional
        How many processes on this machine; one per processor if None. With one the tasks are done in this process, one after the other.
    cluster : str, optional
        The address of a dask scheduler, ``tcp://HOST:PORT``, whose workers do the tasks instead.
    most : int, optional
        How many tasks there will be, where that is known: no more processes than that.

    Raises
    ------
    ClusterError
        The scheduler cannot be reached, has no workers, or a worker has another version of pbpp-rover; or dask is not installed.
    """
    backend = _on_this_machine(jobs, most) if cluster is None else _on_cluster(cluster)
    try:
        yield Workers(backend)
    finally:
        backend.close()


def _on_this_machine(jobs: int | None, most: int | None) -> WorkerPool:
    count = jobs or os.cpu_count() or 1
    if most is not None:
        count = min(count, most)
    if count <= 1:
        return InTurn()
    try:
        return Processes(count)
    except (ImportError, NotImplementedError, OSError):  # a sandbox without shared memory
        return InTurn()


def _on_cluster(address: str) -> WorkerPool:
    try:
        module = import_module("mavlink_bridge.many.cluster")  # half a second, and an extra
    except ModuleNotFoundError as error:
        raise ClusterError(
            f"{_EXTRA} ({error})", advice="install it with: pip install 'pbpp-rover[cluster]'"
        ) from None
    backend: WorkerPool = module.open_cluster(address)
    return backend
