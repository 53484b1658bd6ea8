"""Tasks on a dask cluster: who works there, in which version, and what comes back. The only module that knows dask."""

from __future__ import annotations

import logging
from importlib.metadata import PackageNotFoundError, version
from typing import TYPE_CHECKING, Any

import dask
from distributed import Client, KilledWorker

from mavlink_bridge.errors import ClusterError, LostWorkerError
from mavlink_bridge.many.parcel import PACKAGE, Refused, open_parcel, parcel_of
from mavlink_bridge.many.task import Outcome

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping
    from concurrent.futures import Future

    from mavlink_bridge.many.backend import Function
    from mavlink_bridge.many.task import Task

_CONNECT_S = 15.0
"""How long to wait for the scheduler, and for its first worker (chosen: `dask worker` takes some seconds to start)."""

_COUNTED_EVERY = 50
"""Tasks between two looks at who works there (chosen): a look takes some milliseconds, a task seldom less than a hundred."""

_ADVICE = "install the same version on every machine: pip install 'pbpp-rover[cluster]=={}', and start its `dask worker` again"


class Cluster:
    """The workers of a dask scheduler.

    Dask itself does again elsewhere what a lost worker was at, and hands each result out once.

    Raises
    ------
    ClusterError
        A worker has another version of pbpp-rover.
    """

    def __init__(self, client: Client, address: str) -> None:
        self._client = client
        self._address = address
        self._executor = client.get_executor(pure=False)  # two tasks that are told the same are two tasks
        self._submitted = 0
        self._threads: dict[str, int] = {}
        self._sends_files = False
        self._look()

    def count(self) -> int:
        """Return how many tasks the workers do at the same time; one while there is none, for another may come."""
        return max(1, sum(self._threads.values()))

    def submit(self, function: Function, task: Task[Any]) -> Future[Any]:
        """Send a task to the scheduler, with its files if a worker did not see others."""
        self._submitted += 1
        if self._submitted % _COUNTED_EVERY == 0:
            self._look()
        parcel = parcel_of(task, with_content=self._sends_files)
        try:
            future: Future[Any] = self._executor.submit(open_parcel, function, parcel)
        except Exception as error:  # noqa: BLE001 - dask has no name for it in every version
            raise self._lost_or(error) from None
        return future

    def outcome(self, future: Future[Any], function: Function, task: Task[Any]) -> Outcome[Any] | Future[Any]:
        """Return what came of a task; or, where the worker does not see its files, another try with them.

        Raises
        ------
        ClusterError
            The scheduler is gone, or the worker has another version.
        """
        if future.cancelled():
            raise self._lost()
        trouble = future.exception()
        if isinstance(trouble, KilledWorker):
            return Outcome(error=LostWorkerError(_killed(trouble)))
        if trouble is not None:
            return Outcome(error=trouble if isinstance(trouble, Exception) else RuntimeError(repr(trouble)))
        answer: Outcome[Any] | Refused = future.result()
        if isinstance(answer, Outcome):
            return answer
        if answer.version is not None:
            raise _other_versions({"a worker that joined": answer.version})
        self._sends_files = True
        return self.submit(function, task)

    def mend(self) -> None:
        """Do nothing: a lost worker takes no other's tasks with it."""

    def drop(self, futures: Iterable[Future[Any]]) -> None:
        """Cancel tasks; one that a worker is at is done there for nothing."""
        for future in futures:
            future.cancel()

    def close(self) -> None:
        """Cancel what is not done, and leave the cluster."""
        self._executor.shutdown(wait=False)
        self._client.close()

    def _look(self) -> None:
        """See who works there; ask new ones for their version."""
        try:
            threads = dict(self._client.nthreads())
            new = [worker for worker in threads if worker not in self._threads]
            answers = self._client.run(version, PACKAGE, workers=new, on_error="return") if new else {}
        except Exception as error:  # noqa: BLE001 - dask has no name for it in every version
            raise self._lost_or(error) from None
        check_versions(answers)
        self._threads = threads

    def _lost_or(self, error: Exception) -> Exception:
        """Return what an error of dask's means: that the connection is gone, whatever its kind (some versions have no name for it), or itself."""
        is_gone = isinstance(error, OSError) or self._client.status != "running"
        return self._lost() if is_gone else error

    def _lost(self) -> ClusterError:
        return ClusterError(f"the scheduler {self._address} is lost, or it cancelled the tasks")


def _killed(trouble: KilledWorker) -> str:
    told = f", the last one {trouble.last_worker.address}" if trouble.last_worker else ""
    return (
        f"{trouble.allowed_failures + 1} workers died at it{told}; it may need more memory than a worker has"
    )


def check_versions(answers: Mapping[str, object]) -> None:
    """Refuse workers that have another version of pbpp-rover than this program, or none.

    Raises
    ------
    ClusterError
        There are such; which, and both versions.
    """
    own = version(PACKAGE)
    others = {worker: told for worker, told in answers.items() if told != own}
    # who left while being asked does no more tasks; one that comes again is asked again
    others = {
        worker: told for worker, told in others.items() if isinstance(told, (str, PackageNotFoundError))
    }
    if others:
        raise _other_versions(others)


def _other_versions(others: Mapping[str, object]) -> ClusterError:
    own = version(PACKAGE)
    named = "; ".join(
        f"{worker} has {f'{PACKAGE} {told}' if isinstance(told, str) else f'no {PACKAGE}'}"
        for worker, told in sorted(others.items())
    )
    return ClusterError(
        f"refused: {named}; this program is {PACKAGE} {own}, and another version may measure differently",
        advice=_ADVICE.format(own),
        own_version=own,
        workers={worker: told if isinstance(told, str) else None for worker, told in others.items()},
    )


def open_cluster(address: str) -> Cluster:
    """Connect to a scheduler.

    Raises
    ------
    ClusterError
        It cannot be reached, has no workers, or a worker has another version of pbpp-rover.
    """
    # files that are sent are part of the task, so that a lost worker's task still has them: large on purpose
    dask.config.set({"distributed.admin.large-graph-warning-threshold": "1TB"})
    for name in ("distributed", "distributed.client"):
        logging.getLogger(name).setLevel(
            logging.CRITICAL
        )  # what matters of it comes back as an error of ours
    try:
        client = Client(address, timeout=_CONNECT_S, set_as_default=False, name="pbpp")
    except (OSError, ValueError) as error:
        raise ClusterError(
            f"no dask scheduler answers at {address} within {_CONNECT_S:g} s ({error})",
            advice="start one with `dask scheduler`, or correct the address: tcp://HOST:8786",
        ) from None
    try:
        client.wait_for_workers(1, timeout=_CONNECT_S)
        return Cluster(client, address)
    except TimeoutError:
        client.close()
        raise ClusterError(
            f"the scheduler {address} has no workers after {_CONNECT_S:g} s",
            advice=f"start some on the machines that are to work: `dask worker {address} --nthreads 1`",
        ) from None
    except BaseException:
        client.close()
        raise
