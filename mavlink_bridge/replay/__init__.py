"""The director over recorded logs: the replay, the journal beside a log, and what is expected of it."""
