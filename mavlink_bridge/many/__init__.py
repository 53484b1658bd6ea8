"""Many tasks at once, in bounded memory: processes on this machine, or the workers of a dask cluster.

::

    tasks = (Task(asked=orders, files=(log,)) for log in logs)
    with open_workers(jobs=options.jobs, cluster=options.cluster) as workers:
        for done in workers.results(replay_task, tasks):   # replay_task(task): a function of a module
            if done.error is not None: ...                 # of this task alone; the others go on
            else: ... done.value

`results` is what `concurrent.futures.Executor.map` is, with four things that it has not: only a few tasks are taken ahead and a few results kept, whatever
their number; a task's error is that task's alone; a process that dies takes no other task with it; and with a cluster a file that a worker
does not see at its path is sent to it. Leaving the ``with`` cancels what was not done.

Only `cluster` knows dask; it is loaded when a cluster is asked for.
"""

from __future__ import annotations

from mavlink_bridge.many.task import Finished, Task
from mavlink_bridge.many.workers import Workers, open_workers

__all__ = ["Finished", "Task", "Workers", "open_workers"]
