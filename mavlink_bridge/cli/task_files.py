"""The files of one of many tasks: where they are on the worker that does it, and how its results name them."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TypeVar

Told = TypeVar("Told")


def files_of(*paths: Path | None) -> tuple[Path, ...]:
    """Return files that a task reads, each once, with those that belong to them: a shapefile has its parts beside it."""
    found: dict[Path, None] = {}
    for path in paths:
        if path is not None:
            found[path] = None
            if path.suffix.lower() == ".shp":
                found |= dict.fromkeys(sorted(path.parent.glob(f"{path.stem}.*")))
    return tuple(found)


def as_asked(told: Told, places: Mapping[Path, Path]) -> Told:
    """Return a result of texts, lists and mappings that names files as they were asked for, not as their copies on a worker are called."""
    names = {str(here): str(asked) for asked, here in places.items() if here != asked}
    return _renamed(told, names) if names else told  # type: ignore[return-value]


def _renamed(value: object, names: Mapping[str, str]) -> object:
    if isinstance(value, str):
        for here, asked in names.items():
            value = value.replace(here, asked)
        return value
    if isinstance(value, Mapping):
        return {key: _renamed(one, names) for key, one in value.items()}
    if isinstance(value, (list, tuple)):
        return [_renamed(one, names) for one in value]
    return value
