"""Thousands of logs as one dataset: Parquet files that any tool reads, ready questions, and a rover's own bounds.

The only room that knows DuckDB; it needs the extra ``data``.
"""

from mavlink_bridge.dataset.build import Progress, build, log_files
from mavlink_bridge.dataset.store import Dataset

__all__ = ["Dataset", "Progress", "build", "log_files"]
