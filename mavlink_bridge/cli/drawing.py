"""What rich draws on a terminal: tables and the progress bar; every text from outside goes into them as a `cell`."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from typing import TYPE_CHECKING

from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)
from rich.text import Text

from mavlink_bridge.cli.failing import telling
from mavlink_bridge.cli.terminal import say
from missions.words import harmless

if TYPE_CHECKING:
    from mavlink_bridge.dataset.build import Progress as BuildProgress


def console(*, err: bool = False) -> Console:
    """Return a console for what rich draws; every text from outside goes into it as a `cell`."""
    return Console(stderr=err, highlight=False, markup=False)


def cell(text: object, style: str = "") -> Text:
    """Return what rich shows of a text: as it stands, without markup and without control characters; a cell as it is."""
    return text if isinstance(text, Text) else Text(harmless(str(text)), style=style)


class Shown:
    """Shows how far a command is: text, steps done, steps in all. This one shows nothing."""

    def __call__(self, text: str, done: int, total: int) -> None:
        """Show it."""

    def aside(self) -> AbstractContextManager[None]:
        """Clear the terminal of what moves on it, for as long as the context lasts."""
        return nullcontext()


class _LineProgress(Shown):
    """Prints progress in lines, one for each new text."""

    def __init__(self) -> None:
        self._last = ""

    def __call__(self, text: str, _done: int, _total: int) -> None:
        if text != self._last:
            self._last = text
            say(text)


class _Bar(Shown):
    """A progress bar on stderr."""

    def __init__(self, progress: Progress) -> None:
        self._progress = progress
        self._task = progress.add_task("", total=None)

    def __call__(self, text: str, done: int, total: int) -> None:
        self._progress.update(self._task, description=harmless(text), completed=done, total=total or None)

    @contextmanager
    def aside(self) -> Iterator[None]:
        self._progress.stop()
        try:
            yield
        finally:
            self._progress.start()


@contextmanager
def progress_bar(*, quiet: bool) -> Iterator[Shown]:
    """Show a progress bar on stderr where that is a terminal; yields what moves it."""
    if not sys.stderr.isatty() or quiet:
        yield _LineProgress() if telling().verbose and not quiet else Shown()
        return
    told = TextColumn("{task.description:<38}", markup=False)
    columns = (told, BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    with Progress(*columns, console=console(err=True), transient=True) as progress:
        yield _Bar(progress)


@contextmanager
def build_bar(*, quiet: bool) -> Iterator[Callable[[BuildProgress], None]]:
    """Show on stderr, where that is a terminal, how many logs were read, how many a second, and how long it will take; yields what moves it."""
    if quiet or not sys.stderr.isatty():
        yield lambda _: None
        return
    columns = (
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("{task.fields[rate]}", markup=False),
        TimeElapsedColumn(),
        TextColumn("left", markup=False),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=console(err=True), transient=True) as progress:
        task = progress.add_task("", total=None, rate="")

        def show(now: BuildProgress) -> None:
            elapsed_s = progress.tasks[0].elapsed or 0.0
            rate = (
                f"{now.read / elapsed_s:.1f} logs/s, {now.size_bytes / elapsed_s / 1e6:.1f} MB/s"
                if elapsed_s > 0
                else ""
            )
            progress.update(task, completed=now.done, total=now.files, rate=rate)

        yield show
