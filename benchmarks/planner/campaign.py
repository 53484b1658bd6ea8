"""Check many random fields against a visibility graph: ``python benchmarks/planner/campaign.py [COUNT] [FIRST_SEED]``.

The check is that of the tests (tests/pbpp/field_check.py). Prints each field that fails and a summary; exits 1 on a failure.
"""

from __future__ import annotations

import sys
from collections import Counter
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2] / "tests" / "pbpp"))

from field_check import check_field
from random_fields import random_field


def main(count: int = 20_000, first: int = 1_000_000) -> int:
    """Check `count` fields; return the number of failures."""
    verdicts: Counter[str] = Counter()
    failures = 0
    for seed in range(first, first + count):
        try:
            verdicts[check_field(random_field(seed))] += 1
        except Exception as error:  # noqa: BLE001 - whatever goes wrong is a failure, and the campaign goes on
            failures += 1
            print(f"seed {seed}: {type(error).__name__}: {str(error)[:200]}", flush=True)
    print(f"{count} fields, {failures} failures; verdicts: {dict(sorted(verdicts.items()))}")
    return failures


if __name__ == "__main__":
    sys.exit(1 if main(*map(int, sys.argv[1:])) else 0)
