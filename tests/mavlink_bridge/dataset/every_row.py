"""What datasets are compared by."""

from __future__ import annotations

from typing import TYPE_CHECKING

from mavlink_bridge.dataset.schema import TABLES
from mavlink_bridge.dataset.store import Dataset

if TYPE_CHECKING:
    from pathlib import Path


def every_row(dataset: Path) -> dict[str, list[str]]:
    """All rows of all tables, sorted: what a dataset is, however its files are cut."""
    database = Dataset(dataset).open()
    rows = {name: sorted(map(repr, database.execute(f"SELECT * FROM {name}").fetchall())) for name in TABLES}
    database.close()
    return rows
