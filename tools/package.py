"""Build wheel and sdist, have twine check them, look into them, install the wheel into a fresh environment and plan with it: ``make package``.

``--lowest`` installs the oldest dependencies that ``pyproject.toml`` allows (``requirements/lowest.lock``; some of them have wheels for Python 3.11
only) and runs the quick tests with them; otherwise those of ``requirements/run.lock``.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import subprocess
import sys
import tarfile
import tempfile
import zipfile
from pathlib import Path

from packaging.metadata import Metadata

ROOT = Path(__file__).parents[1]
NEEDED = {
    "pbpp/py.typed",
    "missions/py.typed",
    "mavlink_bridge/py.typed",
    "mavlink_bridge/cli/data/maze-fence.waypoints",
}
# Where dependencies matter; the code of `protocol` imports none of them.
QUICK_TESTS = (
    "pbpp",
    "missions",
    *(f"mavlink_bridge/{room}" for room in ("mavlink", "backup", "tlog", "logbook")),
)
PIP = ("-m", "pip", "install", "--quiet", "--disable-pip-version-check", "--no-deps")
START, TARGET = "40.071374,-105.229930", "40.0720926,-105.2286152"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--lowest", action="store_true")
    lowest = parser.parse_args().lowest
    dist = ROOT / "dist"
    shutil.rmtree(dist, ignore_errors=True)
    run(sys.executable, "-m", "hatchling", "build", "-d", str(dist), cwd=ROOT)
    (wheel,), (sdist,) = dist.glob("*.whl"), dist.glob("*.tar.gz")
    names = look_into_wheel(wheel)
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        check_as_an_index_does(place, wheel, sdist)
        look_into_sdist(sdist, names, place)
        python = install(wheel, place, "lowest" if lowest else "run")
        plan(python, place)
        if lowest:
            test(python, place)
    print(f"good: {wheel.name}, {sdist.name}")


def run(*command: str, cwd: Path, **options: str) -> str:
    done = subprocess.run(
        command, cwd=cwd, capture_output=True, text=True, check=False, env={**os.environ, **options}
    )
    if done.returncode:
        sys.exit(f"{' '.join(command)}\n{done.stdout}{done.stderr}")
    return done.stdout


def look_into_wheel(wheel: Path) -> set[str]:
    """Check the metadata, and that what is needed is there; return the names of all files."""
    with zipfile.ZipFile(wheel) as archive:
        names = set(archive.namelist())
        (info,) = {name.split("/")[0] for name in names if ".dist-info/" in name}
        text = archive.read(f"{info}/METADATA")
        entries = archive.read(f"{info}/entry_points.txt").decode()
    Metadata.from_email(text, validate=True)
    assert f"{info}/licenses/LICENSE" in names, "no LICENSE"
    assert "pbpp = mavlink_bridge.cli:main" in entries, entries
    assert names >= NEEDED, f"not in the wheel: {NEEDED - names}"
    foreign = {
        name for name in names if name.split("/")[0] not in {"pbpp", "missions", "mavlink_bridge", info}
    }
    assert not foreign, f"does not belong into the wheel: {foreign}"
    return names


def check_as_an_index_does(place: Path, *files: Path) -> None:
    """Let twine judge the files: what an index would refuse, and whether the README is shown."""
    python = environment(sys.executable, place / "twine", "release")
    print(
        run(
            str(python), "-m", "twine", "--no-color", "check", "--strict", *map(str, files), cwd=place
        ).strip()
    )


def look_into_sdist(sdist: Path, names: set[str], place: Path) -> None:
    """Check that the sdist makes the same wheel."""
    with tarfile.open(sdist) as archive:
        archive.extractall(place / "sdist", filter="data")
    (source,) = (place / "sdist").iterdir()
    run(sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(place / "again"), cwd=source)
    (again,) = (place / "again").glob("*.whl")
    with zipfile.ZipFile(again) as archive:
        assert set(archive.namelist()) == names, set(archive.namelist()) ^ names
    for needed in (
        "LICENSE",
        "README.md",
        "Makefile",
        "Containerfile",
        "tests/conftest.py",
        "examples/plan_a_file.py",
        "docs/conf.py",
    ):
        assert (source / needed).is_file(), f"not in the sdist: {needed}"


def environment(base: str, folder: Path, lock: str) -> Path:
    """Make a virtual environment with what a lock holds; return its interpreter."""
    run(base, "-m", "venv", str(folder), cwd=ROOT)
    python = folder / ("Scripts" if os.name == "nt" else "bin") / "python"
    run(str(python), *PIP, "--require-hashes", "-r", str(ROOT / "requirements" / f"{lock}.lock"), cwd=folder)
    return python


def install(wheel: Path, place: Path, lock: str) -> Path:
    """Install the wheel and the dependencies of a lock into an environment of its own; return its interpreter."""
    base = oldest_python() if lock == "lowest" else sys.executable
    python = environment(base, place / "env", lock)
    run(str(python), *PIP, str(wheel), cwd=place)
    run(str(python), "-m", "pip", "check", "--disable-pip-version-check", cwd=place)
    print(
        run(
            str(python), "-m", "pip", "list", "--format=freeze", "--disable-pip-version-check", cwd=place
        ).replace("\n", " ")
    )
    return python


def oldest_python() -> str:
    """Return an interpreter of the oldest version that is supported: the oldest dependencies have wheels for it."""
    for name in (sys.executable, "python3.11"):
        asked = [name, "-c", "import sys, venv, ensurepip; sys.exit(sys.version_info[:2] != (3, 11))"]
        if shutil.which(name) and subprocess.run(asked, capture_output=True, check=False).returncode == 0:
            return name
    print("skipped: the oldest dependencies need Python 3.11, which is not here")
    sys.exit(0)


def plan(python: Path, place: Path) -> None:
    """Run the command far from the checkout."""
    shutil.copy(ROOT / "tests" / "fields" / "yard-fence.waypoints", place / "fence.waypoints")
    pbpp = str(python.with_name("pbpp"))
    clean = {
        "XDG_CONFIG_HOME": str(place / "config"),
        "XDG_STATE_HOME": str(place / "state"),
    }
    print(run(pbpp, "--version", cwd=place, **clean).strip())
    options = ["plan", "--fence", "fence.waypoints", "--start", START, "--target", TARGET]
    told = run(
        pbpp,
        *options,
        "-o",
        "m.plan",
        "-o",
        "m.waypoints",
        "--plot",
        "m.png",
        "--plot",
        "m.html",
        "--json",
        cwd=place,
        **clean,
    )
    document = json.loads(told)
    assert document["status"] == "ok", document
    assert all((place / name).stat().st_size > 100 for name in document["outputs"])
    looked = json.loads(run(pbpp, "doctor", "--json", cwd=place, **clean))
    assert looked["status"] == "ok", looked
    driven = json.loads(run(pbpp, "demo", "--speedup", "20", "--out", "demo", "--json", cwd=place, **clean))
    assert (driven["arrived"], driven["breaches"], driven["verified"]) == (True, 0, True), driven


def test(python: Path, place: Path) -> None:
    """Run the quick tests of the sdist, on its own code."""
    (source,) = (place / "sdist").iterdir()
    folders = [str(Path("tests") / name) for name in QUICK_TESTS]
    done = subprocess.run(
        [python, "-m", "pytest", "-q", "-n", "4", "--dist", "worksteal", "-m", "not campaign", *folders],
        cwd=source,
        check=False,
    )
    if done.returncode:
        sys.exit(done.returncode)


if __name__ == "__main__":
    main()
