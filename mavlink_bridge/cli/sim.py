"""Placeholder."""


def sim() -> None:
    """X."""
