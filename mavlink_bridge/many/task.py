"""One of many tasks, what came of it, and how a worker does it."""

from __future__ import annotations

import pickle
import traceback
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Generic, TypeVar

if TYPE_CHECKING:
    from pathlib import Path

Asked = TypeVar("Asked")
Value = TypeVar("Value")


@dataclass(frozen=True, slots=True)
class Task(Generic[Asked]):
    """What one call of a function is told; it goes to another process, so all of it can be pickled."""

    asked: Asked
    """Anything."""
    files: tuple[Path, ...] = ()
    """The files that the function reads. On a worker that does not see them at these paths they are copies of the same name, those of
    one folder in one folder; so the function reads only these, and names files in what it returns by what it was asked."""


@dataclass(frozen=True, slots=True)
class Finished(Generic[Asked, Value]):
    """What came of a task: a value, or the error that its function raised."""

    number: int
    """The task's place in the order in which they were given, from 0."""
    task: Task[Asked]
    value: Value | None = None
    error: Exception | None = None

    def result(self) -> Value:
        """Return the value, or raise the error."""
        if self.error is not None:
            raise self.error
        return self.value  # type: ignore[return-value] # None is a value too


@dataclass(frozen=True, slots=True)
class Outcome(Generic[Value]):
    """What a worker hands back: a value or an error, as data, so that neither breaks the way back."""

    value: Value | None = None
    error: Exception | None = None


def outcome_of(function: Callable[[Task[Asked]], Value], task: Task[Asked]) -> Outcome[Value]:
    """Call the function; return its value, or its error with the traceback as a note."""
    try:
        return Outcome(function(task))
    except Exception as error:  # noqa: BLE001 - whatever it is, it is this task's affair
        return Outcome(error=portable(error))


def portable(error: Exception) -> Exception:
    """Return an error as another process can read it: itself, or a plain one with its name and text."""
    error.add_note("".join(traceback.format_exception(error)))
    try:
        pickle.loads(pickle.dumps(error))  # noqa: S301 - made in this line
    except Exception:  # noqa: BLE001 - an error may hold anything
        plain = RuntimeError(f"{type(error).__name__}: {error}")
        plain.add_note(error.__notes__[-1])
        return plain
    return error
