"""Check that the lock files install whatever a registry has published since: ``make locks``.

For each Python found, the locked files are fetched once by their hashes. A local index is made of them, with an empty newer wheel of each name
beside: what a registry looks like some months later. Then every lock is installed from that index alone (a dry run), with the options that the
Makefile uses, by the oldest pip that the project supports, one that resolves extras anew under ``--require-hashes``, and the newest.
"""

from __future__ import annotations

import hashlib
import os
import re
import shutil
import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parents[1]
LOCKS = ("run", "dev")
# 22.3 is the oldest with --dry-run that Python 3.11 was released with; 23.2.1 (Python 3.11.5 to 3.11.7) looks for a newer coverage[toml]; then the newest.
PIPS = ("pip==22.3", "pip==23.2.1", "pip")
NEWER = "9999.0"


class Python(NamedTuple):
    """One interpreter of the project's versions."""

    path: Path
    version: tuple[int, int, int]

    def __str__(self) -> str:
        return f"Python {'.'.join(map(str, self.version))}"


def main() -> None:
    options = [
        option for option in sys.argv[1:] if option != "--quiet"
    ]  # pip then says what it would install
    pythons = found_pythons()
    failures: list[str] = []
    checked = 0
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        pips = [fetch_pip(wanted, place / "pips" / str(number)) for number, wanted in enumerate(PIPS)]
        for python in pythons:
            index = place / f"index-{'.'.join(map(str, python.version))}"
            make_index(python, ROOT / "requirements" / "dev.lock", index)  # which holds all of run.lock
            for pip in pips:
                if not starts(python, pip, place / "env"):
                    print(f"{python}: {pip.name} does not run on it")
                    continue
                for lock in LOCKS:
                    checked += 1
                    failures += dry_run(python, pip, lock, index, options, place / "env")
            shutil.rmtree(index)
    print("\n".join(failures) or f"good: {checked} installs from locks, none of them resolved anything")
    sys.exit(bool(failures) or not checked)


def found_pythons() -> list[Python]:
    """Return one interpreter of each version from 3.11 on that has venv: on PATH, and those of pyenv."""
    folders = [Path(folder) for folder in os.environ.get("PATH", "").split(os.pathsep) if folder]
    pyenv = Path(os.environ.get("PYENV_ROOT", "~/.pyenv")).expanduser() / "versions"
    folders += sorted(pyenv.glob("*/bin"))
    found: dict[tuple[int, int, int], Python] = {}
    for folder in folders:
        for path in sorted(folder.glob("python3*")):
            if not re.fullmatch(r"python3(\.\d+)?", path.name):
                continue
            asked = "import sys, venv, ensurepip; print(*sys.version_info[:3])"
            told = subprocess.run([path, "-c", asked], capture_output=True, text=True, check=False)
            if told.returncode == 0:
                major, minor, micro = map(int, told.stdout.split())
                found.setdefault((major, minor, micro), Python(path, (major, minor, micro)))
    return sorted(
        (python for version, python in found.items() if version >= (3, 11)), key=lambda one: one.version
    )


def fetch_pip(wanted: str, folder: Path) -> Path:
    """Return pip's own wheel, which Python can run as it is."""
    run(sys.executable, "-m", "pip", "download", "--quiet", "--no-deps", "-d", str(folder), wanted)
    (wheel,) = folder.glob("pip-*.whl")
    return wheel


def starts(python: Python, pip: Path, env: Path) -> bool:
    """Return whether a pip runs on an interpreter at all: pip 22.3 does not on 3.12, which has no pkgutil.ImpImporter."""
    return (
        subprocess.run(
            [new_env(python, env), f"{pip}/pip", "list"], capture_output=True, check=False
        ).returncode
        == 0
    )


def make_index(python: Python, lock: Path, index: Path) -> None:
    """Add to an index the locked files for an interpreter and, of each name, an empty newer wheel."""
    with tempfile.TemporaryDirectory() as folder:
        run(
            str(python.path), "-m", "pip", "download", "--quiet", "--disable-pip-version-check", "--no-deps",
            "--require-hashes", "-d", folder, "-r", str(lock),
        )  # fmt: skip
        for file in Path(folder).iterdir():
            name = re.match(r"(.+?)-\d", file.name)
            assert name, file.name
            package = index / normalized(name[1])
            package.mkdir(parents=True, exist_ok=True)
            shutil.move(file, package / file.name)
    for name in re.findall(r"^([\w.-]+)==", lock.read_text(), re.MULTILINE):
        package = index / normalized(name)
        package.mkdir(parents=True, exist_ok=True)
        write_empty_wheel(package, normalized(name).replace("-", "_"))
    for package in index.iterdir():
        links = (f'<a href="{file.name}#sha256={digest(file)}">{file.name}</a>' for file in package.iterdir())
        text = "\n".join(links)
        (package / "index.html").write_text(f"<!DOCTYPE html><html><body>\n{text}\n</body></html>\n")


def normalized(name: str) -> str:
    """Return a project's name as indexes write it (PEP 503)."""
    return re.sub(r"[-_.]+", "-", name).lower()


def digest(file: Path) -> str:
    return hashlib.sha256(file.read_bytes()).hexdigest()


def write_empty_wheel(folder: Path, name: str) -> None:
    """Write a wheel without a module, of a version newer than any."""
    info = f"{name}-{NEWER}.dist-info"
    with zipfile.ZipFile(folder / f"{name}-{NEWER}-py3-none-any.whl", "w") as wheel:
        wheel.writestr(f"{info}/METADATA", f"Metadata-Version: 2.1\nName: {name}\nVersion: {NEWER}\n")
        wheel.writestr(f"{info}/WHEEL", "Wheel-Version: 1.0\nRoot-Is-Purelib: true\nTag: py3-none-any\n")
        wheel.writestr(f"{info}/RECORD", "")


def dry_run(python: Python, pip: Path, lock: str, index: Path, options: list[str], env: Path) -> list[str]:
    """Return what went wrong with an install into a new environment, from the local index alone."""
    clean = {key: value for key, value in os.environ.items() if not key.startswith("PIP_")}
    file = ROOT / "requirements" / f"{lock}.lock"
    done = subprocess.run(
        [new_env(python, env), f"{pip}/pip", "install", *options, "--dry-run", "--no-cache-dir", "--index-url", index.as_uri(), "-r", file],
        capture_output=True, text=True, check=False, env={**clean, "PIP_CONFIG_FILE": os.devnull},
    )  # fmt: skip
    what = f"{python}, {pip.stem.split('-py')[0]}, {lock}.lock"
    if done.returncode:
        return [f"{what}: {done.stderr.strip()[-600:]}"]
    if "Would install" not in done.stdout or NEWER in done.stdout:
        return [f"{what}: took what was published later: {done.stdout.strip()[-600:]}"]
    print(f"{what}: good")
    return []


def new_env(python: Python, env: Path) -> Path:
    """Return the interpreter of a new environment without pip."""
    if env.exists():
        shutil.rmtree(env)
    run(str(python.path), "-m", "venv", "--without-pip", str(env))
    return env / ("Scripts" if os.name == "nt" else "bin") / "python"


def run(*command: str) -> None:
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        sys.exit(f"{' '.join(command)}\n{done.stdout}{done.stderr}")


if __name__ == "__main__":
    main()
