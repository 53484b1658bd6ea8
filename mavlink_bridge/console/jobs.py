"""Work beside the loop: planning, checking, reading files. Newer work for the same purpose makes older pointless, which is then stopped.

Threads, as the bridge plans: what is compiled lets the others run meanwhile, and what is not is asked now and then whether to stop.
"""

from __future__ import annotations

import asyncio
import contextlib
from threading import Thread
from typing import TYPE_CHECKING, Any, TypeVar

if TYPE_CHECKING:
    from collections.abc import Callable

ResultT = TypeVar("ResultT")

_MOST_AT_ONCE = 2
"""However many pages ask: what is left of a small computer is the bridge's. Chosen, not measured."""


class SupersededError(Exception):
    """Newer work has taken the place of this."""


class Job:
    """One piece of work; `is_dropped` is a plain flag that one thread sets and the other reads."""

    def __init__(self) -> None:
        self.is_dropped = False


class Jobs:
    """Runs work in threads, at most a few at once, for an asyncio loop."""

    def __init__(self) -> None:
        self._newest: dict[str, Job] = {}
        self._room = asyncio.Semaphore(_MOST_AT_ONCE)

    async def run(self, purpose: str, work: Callable[[Callable[[], bool]], ResultT]) -> ResultT:
        """Do work, and return what comes of it.

        Parameters
        ----------
        purpose : str
            Newer work for the same purpose stops this.
        work : callable
            Gets what tells whether to stop.

        Raises
        ------
        SupersededError
            Newer work has taken its place, or it was cancelled.
        """
        self.cancel(purpose)
        job = self._newest[purpose] = Job()
        try:
            async with self._room:
                if job.is_dropped:
                    raise SupersededError
                found = await _in_thread(lambda: work(lambda: job.is_dropped))
        except asyncio.CancelledError:
            job.is_dropped = True
            raise
        finally:
            if self._newest.get(purpose) is job:
                del self._newest[purpose]
        if job.is_dropped:
            raise SupersededError
        return found

    def cancel(self, purpose: str) -> None:
        """Stop what is done for a purpose."""
        if (job := self._newest.get(purpose)) is not None:
            job.is_dropped = True


async def _in_thread(work: Callable[[], ResultT]) -> ResultT:
    """Do work in a thread that nobody waits for when the program ends."""
    loop = asyncio.get_running_loop()
    future: asyncio.Future[ResultT] = loop.create_future()

    def settle(put: Callable[[Any], None], value: Any) -> None:  # noqa: ANN401 - a result or an error
        if not future.done():
            put(value)

    def run() -> None:
        try:
            found = work()
        except BaseException as error:  # noqa: BLE001 - raised again where the result is awaited
            _tell(loop, settle, future.set_exception, error)
        else:
            _tell(loop, settle, future.set_result, found)

    Thread(target=run, name="console work", daemon=True).start()
    return await future


def _tell(loop: asyncio.AbstractEventLoop, *call: Any) -> None:  # noqa: ANN401 - a function and its arguments
    """Hand a result to the loop, where there is still one."""
    with contextlib.suppress(RuntimeError):  # closed: the server has ended meanwhile
        loop.call_soon_threadsafe(*call)
