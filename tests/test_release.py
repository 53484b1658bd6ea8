"""Releases: version and changelog as they will be, what is refused, and that a build that fails leaves everything as it was."""

from __future__ import annotations

import importlib.util
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
CHANGELOG = "# Changelog\n\n## Unreleased\n\n### Added\n\n- A thing.\n\n## 0.1.0 - 2026-01-02\n\n- All.\n"
PROJECT = '[project]\nname = "x"\nversion = "0.1.9"\n'


@pytest.fixture
def release():
    spec = importlib.util.spec_from_file_location("release", ROOT / "tools" / "release.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture
def checkout(release, tmp_path, monkeypatch):
    """A repository to release, whose build ends as ``tools/package.py`` says."""
    if shutil.which("git") is None:
        pytest.skip("git is not installed")
    monkeypatch.setattr(release, "ROOT", tmp_path)
    monkeypatch.setattr(sys, "argv", ["release.py", "0.1.10"])
    for name in ("AUTHOR", "COMMITTER"):
        monkeypatch.setenv(f"GIT_{name}_NAME", "A")
        monkeypatch.setenv(f"GIT_{name}_EMAIL", "a@example.org")
    (tmp_path / "tools").mkdir()
    (tmp_path / "tools" / "package.py").write_text("")
    (tmp_path / "pyproject.toml").write_text(PROJECT)
    (tmp_path / "CHANGELOG.md").write_text(CHANGELOG)
    subprocess.run(["git", "init", "-q"], cwd=tmp_path, check=True)
    release.git("add", "--all")
    release.git("commit", "--message", "all")
    return tmp_path


def test_the_version_stands_in_one_place(release):
    (found,) = release._VERSION.findall((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    named = re.compile(r"version\W+" + re.escape(".".join(found)), re.IGNORECASE)
    pages = [
        *ROOT.glob("*.md"),
        ROOT / "CITATION.cff",
        ROOT / "docs" / "conf.py",
        *(ROOT / "docs").rglob("*.md"),
    ]
    assert [page.name for page in pages if named.search(page.read_text(encoding="utf-8"))] == []


def test_this_project_could_be_released(release):
    major, minor, _ = release._VERSION.search((ROOT / "pyproject.toml").read_text(encoding="utf-8")).groups()
    version = f"{major}.{int(minor) + 1}.0"
    project = release.with_version((ROOT / "pyproject.toml").read_text(encoding="utf-8"), version)
    assert f'\nversion = "{version}"\n' in project
    # Just after a release nothing is unreleased.
    changelog = (
        (ROOT / "CHANGELOG.md")
        .read_text(encoding="utf-8")
        .replace("## Unreleased\n", "## Unreleased\n\n- One.\n", 1)
    )
    released = release.with_release(changelog, version, "2030-01-02")
    assert f"## Unreleased\n\n## {version} - 2030-01-02\n\n- One.\n" in released


def test_a_release_is_committed_and_tagged(release, checkout):
    release.main()
    assert (checkout / "CHANGELOG.md").read_text() == (
        "# Changelog\n\n## Unreleased\n\n## 0.1.10 - "
        + release.datetime.now(release.UTC).date().isoformat()
        + "\n\n### Added\n\n- A thing.\n\n## 0.1.0 - 2026-01-02\n\n- All.\n"
    )
    assert release.git("show", "v0.1.10:pyproject.toml").endswith('version = "0.1.10"')
    assert release.git("log", "-1", "--format=%s") == "Version 0.1.10"
    assert release.git("status", "--porcelain") == ""


def test_a_build_that_fails_leaves_all_as_it_was(release, checkout):
    (checkout / "tools" / "package.py").write_text("raise SystemExit(1)")
    release.git("commit", "--all", "--message", "broken")
    with pytest.raises(SystemExit, match="version and changelog are as before"):
        release.main()
    assert (release.git("tag"), release.git("status", "--porcelain")) == ("", "")


def test_a_commit_that_is_refused_leaves_all_as_it_was(release, checkout):
    hook = checkout / ".git" / "hooks" / "pre-commit"
    hook.parent.mkdir(exist_ok=True)
    hook.write_text("#!/bin/sh\nexit 1\n")
    hook.chmod(0o755)
    with pytest.raises(SystemExit, match="git commit"):
        release.main()
    assert (release.git("tag"), release.git("status", "--porcelain")) == ("", "")


def test_changes_that_are_not_committed_are_not_released(release, checkout):
    (checkout / "pyproject.toml").write_text(PROJECT + "\n")
    with pytest.raises(SystemExit, match="commit or put away your changes"):
        release.main()


def test_no_version_is_released_twice(release, checkout):
    release.git("tag", "v0.1.10")
    with pytest.raises(SystemExit, match=r"v0\.1\.10 is released already"):
        release.main()


@pytest.mark.parametrize(
    ("version", "problem"),
    [
        ("", "expected three numbers"),
        ("v0.2.0", "expected three numbers"),
        ("0.1.9", r"expected more than 0\.1\.9"),
    ],
)
def test_a_version_is_three_numbers_and_more_than_before(release, version, problem):
    with pytest.raises(SystemExit, match=problem):
        release.with_version(PROJECT, version)


@pytest.mark.parametrize("changelog", ["# Changelog\n", "## Unreleased\n\n## 0.1.0\n\n- All.\n"])
def test_nothing_new_is_no_release(release, changelog):
    with pytest.raises(SystemExit, match="nothing under ## Unreleased"):
        release.with_release(changelog, "0.2.0", "2030-01-02")
