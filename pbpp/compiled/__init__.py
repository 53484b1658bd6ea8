"""What numba compiles (extra ``fast``): the only room that knows it, loaded by the first query of a planner that asks for it."""

from __future__ import annotations

from importlib.util import find_spec

__all__ = ["require_numba"]


def require_numba() -> None:
    """Refuse where numba is not installed, without loading it.

    Raises
    ------
    ImportError
        It is not there.
    """
    if find_spec("numba") is None:
        raise ImportError('the compiled search needs numba: pip install "pbpp-rover[fast]"')
