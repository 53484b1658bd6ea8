"""The browser that the page's tests share."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

import pytest

from mavlink_bridge.backup.vehicle_lock import lock_file

if TYPE_CHECKING:
    from collections.abc import Iterator

    from playwright.sync_api import Browser


@pytest.fixture(scope="module")
def chromium() -> Iterator[Browser]:
    # Only who asks for it needs playwright; no longer than a module, whose neighbours run loops of their own.
    from console.browser_kit import launched
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        found = launched(playwright)
        yield found
        found.close()


@pytest.fixture
def browser(chromium: Browser, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    """Two tests at a time, of all workers: three of them draw software WebGL so slowly that a page counts as gone, and has lost control."""
    folder = tmp_path_factory.getbasetemp().parent
    with (folder / "browser-1.lock").open("ab") as one, (folder / "browser-2.lock").open("ab") as other:
        while not (lock_file(one) or lock_file(other)):
            time.sleep(0.1)
        yield chromium
