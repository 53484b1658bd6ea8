"""Telemetry logs: reading them fast and forgivingly, and writing them.

`TlogReader` gives a log's frames as the same messages a live link gives, `read_columns` one message type as arrays, and `survey` counts
what a log holds.
"""

from mavlink_bridge.tlog.damage import Damage
from mavlink_bridge.tlog.reader import LogEntry, TlogReader, read_columns
from mavlink_bridge.tlog.survey import Traffic, survey
from mavlink_bridge.tlog.writer import SENT_LINK, TlogWriter

__all__ = ["SENT_LINK", "Damage", "LogEntry", "TlogReader", "TlogWriter", "Traffic", "read_columns", "survey"]
