"""Release this checkout: ``make release VERSION=X.Y.Z`` writes version and changelog, builds and checks the files, commits, tags.

Nothing is pushed and nothing is uploaded; docs/releasing.md says what comes before and after.
"""

from __future__ import annotations

import re
import subprocess
import sys
from datetime import UTC, datetime
from pathlib import Path

ROOT = Path(__file__).parents[1]
_VERSION = re.compile(r'^version = "(\d+)\.(\d+)\.(\d+)"$', re.MULTILINE)
_UNRELEASED = re.compile(r"^## Unreleased\n(.*?)(?=^## |\Z)", re.MULTILINE | re.DOTALL)


def main() -> None:
    version = sys.argv[1] if len(sys.argv) == 2 else ""
    project, changelog = ROOT / "pyproject.toml", ROOT / "CHANGELOG.md"
    before = {path: path.read_text(encoding="utf-8") for path in (project, changelog)}
    if git("status", "--porcelain"):
        sys.exit("commit or put away your changes first: what is released is what is committed")
    if git("tag", "--list", f"v{version}"):
        sys.exit(f"v{version} is released already")
    after = {
        project: with_version(before[project], version),
        changelog: with_release(before[changelog], version, datetime.now(UTC).date().isoformat()),
    }
    write(after)
    try:
        package = [sys.executable, str(ROOT / "tools" / "package.py")]
        if subprocess.run(package, cwd=ROOT, check=False).returncode:
            sys.exit("not released: version and changelog are as before")
        git("commit", "--message", f"Version {version}", "--", project.name, changelog.name)
    except BaseException:
        write(before)
        raise
    git("tag", "--annotate", f"v{version}", "--message", f"PBPP Rover {version}")
    print(f"v{version} is tagged, its files are in dist/. Next: docs/releasing.md, from step 4")


def with_version(project: str, version: str) -> str:
    """Return pyproject.toml with a new version, which must be higher than the one it has."""
    (found,) = _VERSION.finditer(project)
    asked = re.fullmatch(r"(\d+)\.(\d+)\.(\d+)", version)
    if not asked:
        sys.exit(f"VERSION={version}: expected three numbers, as 0.2.0")
    if [int(part) for part in asked.groups()] <= [int(part) for part in found.groups()]:
        sys.exit(f"VERSION={version}: expected more than {'.'.join(found.groups())}")
    return f'{project[: found.start()]}version = "{version}"{project[found.end() :]}'


def with_release(changelog: str, version: str, day: str) -> str:
    """Return CHANGELOG.md with what was unreleased under the version and its day, and a new empty section above it."""
    found = _UNRELEASED.search(changelog)
    if not found or not re.search(r"^- ", found[1], re.MULTILINE):
        sys.exit("CHANGELOG.md has nothing under ## Unreleased")
    return f"{changelog[: found.start()]}## Unreleased\n\n## {version} - {day}\n{changelog[found.start(1) :]}"


def write(texts: dict[Path, str]) -> None:
    for path, text in texts.items():
        path.write_text(text, encoding="utf-8", newline="\n")


def git(*words: str) -> str:
    done = subprocess.run(["git", *words], cwd=ROOT, capture_output=True, text=True, check=False)
    if done.returncode:
        sys.exit(f"git {words[0]}: {done.stderr.strip()}")
    return done.stdout.strip()


if __name__ == "__main__":
    main()
