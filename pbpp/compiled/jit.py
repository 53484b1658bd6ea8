"""How functions are compiled, and where the result is kept."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numba

_OPTIONS: dict[str, Any] = {"error_model": "numpy"}


def _kept(**options: Any) -> Callable[[Callable[..., Any]], Callable[..., Any]]:  # noqa: ANN401 - numba's
    """Return a decorator that compiles a function and keeps the result on disk, if there is any place for it.

    numba looks for one in the order NUMBA_CACHE_DIR, beside the module, the user's cache directory, and refuses to compile where it finds none.
    """

    def decorate(function: Callable[..., Any]) -> Callable[..., Any]:
        try:
            result: Callable[..., Any] = numba.njit(**_OPTIONS, **options, cache=True)(function)
        except RuntimeError:
            result = numba.njit(**_OPTIONS, **options)(function)
        return result

    return decorate


compiled = _kept()
released = _kept(nogil=True)
"""As `compiled`, without Python's lock: other threads go on meanwhile."""

# What makes no arrays does not count references to those it is given: counted at every call, they took three quarters of the time. Such a function
# must not return an array. In the others a record is no reference: it is read before its array is let go.
uncounted = _kept(_nrt=False)
inlined = _kept(_nrt=False, forceinline=True)
