"""What numba compiles (extra ``fast``): the only room that knows it, loaded by the first planner that asks for it.

A cache of numba does not see that a function it calls has changed in another file, so each module here compiles nothing but its own functions.
"""

from __future__ import annotations

from importlib.util import find_spec

from pbpp.partition.flat import Engine

__all__ = ["load_engine"]


def load_engine() -> Engine:
    """Return the compiled sweep and search; loading numba takes a while.

    Raises
    ------
    ImportError
        If numba is not installed.
    """
    if find_spec("numba") is None:
        raise ImportError('compiled planning needs numba: pip install "pbpp-rover[fast]"')
    from .search import Searcher  # noqa: PLC0415 - an extra
    from .sweep import sweep  # noqa: PLC0415 - an extra

    return Engine(sweep, Searcher)
