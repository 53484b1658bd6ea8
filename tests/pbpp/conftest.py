import json
import sys
from pathlib import Path

import pytest

HERE = Path(__file__).parent
# Modules that several test files share: visibility_graph, random_fields.
sys.path.insert(0, str(HERE))


@pytest.fixture(scope="session")
def load_case():
    """Return a function that reads one of the planning cases."""

    def load(name):
        return json.loads((HERE / "data" / f"{name}.json").read_text())

    return load


@pytest.fixture
def square():
    """Return the ring of a square of 100 m."""
    return [(0.0, 0.0), (100.0, 0.0), (100.0, 100.0), (0.0, 100.0)]
