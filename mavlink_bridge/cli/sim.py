"""Placeholder."""
def sim() -> None:
    """x."""
