"""What all tests share: settings of hypothesis and the places of recorded data."""

from __future__ import annotations

import os
import signal
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings
from hypothesis.internal.conjecture import providers

_ROOT = Path(__file__).parents[1]

# A fixed seed and no database: a run says the same today and tomorrow. `--hypothesis-profile=search` looks further,
# with new seeds and with the constants of the code under test.
settings.register_profile(
    "default", derandomize=True, database=None, deadline=None, suppress_health_check=[HealthCheck.too_slow]
)
settings.register_profile(
    "search", max_examples=2000, database=None, deadline=None, suppress_health_check=[HealthCheck.too_slow]
)
settings.load_profile("default")


def pytest_configure(config: pytest.Config) -> None:
    """Make runs the same wherever they are started."""
    _keep_examples(config)
    # A shell starts background jobs with SIGINT ignored, and the programs under test would inherit that.
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    # nohup ignores SIGHUP, and so would they.
    if os.name == "posix" and signal.getsignal(signal.SIGHUP) is signal.SIG_IGN:
        signal.signal(signal.SIGHUP, signal.SIG_DFL)


def _keep_examples(config: pytest.Config) -> None:
    """Keep the default examples the same: drawn from the constants of loaded modules, each edit would change them."""
    if config.getoption("--hypothesis-profile", None) is None and hasattr(providers, "_get_local_constants"):
        nothing = providers._local_constants
        providers._get_local_constants = lambda: nothing


@pytest.fixture(scope="session", autouse=True)
def _own_state_folder(tmp_path_factory: pytest.TempPathFactory):
    """Keep what commands remember out of the user's state folder."""
    before = os.environ.get("XDG_STATE_HOME")
    os.environ["XDG_STATE_HOME"] = str(tmp_path_factory.mktemp("state"))
    yield
    del os.environ["XDG_STATE_HOME"]
    if before is not None:
        os.environ["XDG_STATE_HOME"] = before


@pytest.fixture
def state_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A state folder of the test's own."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    return tmp_path / "state"


@pytest.fixture(scope="session")
def logs() -> Path:
    """The recorded telemetry logs."""
    return _ROOT / "sitl_logs"


@pytest.fixture(scope="session")
def fields() -> Path:
    """The fence and mission files that the recordings were made with."""
    return Path(__file__).parent / "fields"
