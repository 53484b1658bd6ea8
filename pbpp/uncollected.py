"""Building without garbage collection.

A build makes hundreds of thousands of tuples and not one cycle, and meanwhile Python looks through all that the program holds. Without that it took
0.74 of the CPU time on 1,000 obstacles with the command line loaded, 0.96 on 5,000, and the same where the program holds little else.
"""

from __future__ import annotations

import gc
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def uncollected() -> Iterator[None]:
    """Hold Python's cyclic garbage collection off in a block; for all threads of the process, as it has one switch for all."""
    was_on = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was_on:
            gc.enable()
