"""Many frozen dataclass objects at once, about three times faster than by their constructor.

A frozen class's constructor sets each field through `object.__setattr__` in Python code, which costs more than all the rest of reading a
log. Here the fields are set column by column through the slots' own descriptors, all in C; nobody sees the objects before they are done.
"""

from __future__ import annotations

from collections import deque
from dataclasses import fields
from itertools import repeat
from typing import TYPE_CHECKING, Any, TypeVar

if TYPE_CHECKING:
    from collections.abc import Sequence

    from _typeshed import DataclassInstance

_T = TypeVar("_T", bound="DataclassInstance")


def build(cls: type[_T], columns: Sequence[Sequence[Any]]) -> list[_T]:
    """Make an object of each row.

    Parameters
    ----------
    cls : type
        A frozen dataclass with slots, at least one, and without a `__post_init__`.
    columns : sequence of sequences
        The values of each field, in the class's order, all equally many.

    Returns
    -------
    list of objects of the class
    """
    objects = list(map(object.__new__, repeat(cls, len(columns[0]))))
    for field, column in zip(fields(cls), columns, strict=True):
        deque(map(getattr(cls, field.name).__set__, objects, column), maxlen=0)
    return objects
