"""Files are created exclusively, replaced whole, and kept under a second name."""

from __future__ import annotations

import errno
import os
import re
import stat
from pathlib import Path

import pytest

from missions.errors import MissionFormatError
from missions.formats import files
from missions.formats.files import create_exclusively, keep_aside, write_file

posix = pytest.mark.skipif(os.name != "posix", reason="permissions and links as POSIX has them")


def test_a_file_is_new_or_replaced_and_nothing_else_stays(tmp_path):
    path = tmp_path / "a.plan"
    write_file(path, b"one")
    write_file(path, b"two")
    assert path.read_bytes() == b"two"
    assert names(tmp_path) == ["a.plan"]


@posix
@pytest.mark.parametrize("umask", [0o022, 0o077, 0o002])
def test_a_new_file_has_the_permissions_of_any_new_file(tmp_path, umask):
    before = os.umask(umask)
    try:
        write_file(tmp_path / "a.plan", b"one")
    finally:
        os.umask(before)
    assert mode_of(tmp_path / "a.plan") == 0o666 & ~umask


@posix
@pytest.mark.parametrize("mode", [0o600, 0o640, 0o664, 0o444])
def test_a_replaced_file_keeps_its_permissions(tmp_path, mode):
    path = tmp_path / "a.plan"
    path.write_bytes(b"one")
    path.chmod(mode)
    write_file(path, b"two")
    assert (path.read_bytes(), mode_of(path)) == (b"two", mode)


@posix
def test_planted_links_lead_nowhere(tmp_path, monkeypatch):
    precious = tmp_path / "precious"
    precious.write_bytes(b"precious")
    folder = tmp_path / "out"
    folder.mkdir()
    monkeypatch.setattr(
        files.secrets, "token_hex", lambda _: "known"
    )  # even where somebody foresees the name
    for name in (".a.plan.part", ".pbpp-known.part"):
        (folder / name).symlink_to(precious)
    with pytest.raises(MissionFormatError, match="cannot be written: File exists"):
        write_file(folder / "a.plan", b"new")
    assert precious.read_bytes() == b"precious"
    assert not (folder / "a.plan").exists()
    with pytest.raises(FileExistsError):
        create_exclusively(folder / ".a.plan.part")


@posix
@pytest.mark.parametrize("aim", ["precious", "nowhere"])
def test_a_link_is_replaced_and_what_it_leads_to_is_left_alone(tmp_path, aim):
    (tmp_path / "precious").write_bytes(b"precious")
    path = tmp_path / "a.plan"
    path.symlink_to(tmp_path / aim)
    write_file(path, b"new")
    assert not path.is_symlink()
    assert path.read_bytes() == b"new"
    assert (tmp_path / "precious").read_bytes() == b"precious"
    assert not (tmp_path / "nowhere").exists()


@posix
def test_what_is_no_file_is_not_replaced(tmp_path):
    (tmp_path / "folder.plan").mkdir()
    os.mkfifo(tmp_path / "pipe.plan")
    for name, why in (("folder.plan", "Is a directory"), ("pipe.plan", "it is not a regular file")):
        with pytest.raises(MissionFormatError, match=f"{name} cannot be written: {why}"):
            write_file(tmp_path / name, b"new")
    assert names(tmp_path) == ["folder.plan", "pipe.plan"]


@pytest.mark.parametrize("failing", ["write", "make_way"])
def test_what_fails_leaves_the_old_file_and_no_other(tmp_path, monkeypatch, failing):
    path = tmp_path / "a.plan"
    path.write_bytes(b"one")

    def fail(*_):
        raise OSError(errno.ENOSPC, "No space left on device")

    if failing == "write":
        monkeypatch.setattr(files.os, "fsync", fail)
    with pytest.raises(MissionFormatError, match="No space left"):
        write_file(path, b"two", fail)
    assert (path.read_bytes(), names(tmp_path)) == (b"one", ["a.plan"])


def test_an_interrupt_leaves_no_unfinished_file(tmp_path):
    def interrupt():
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write_file(tmp_path / "a.plan", b"two", interrupt)
    assert names(tmp_path) == []


@pytest.mark.parametrize("links", [True, False])
def test_second_names_are_free_ones(tmp_path, monkeypatch, links):
    path = tmp_path / "a.plan"
    path.write_bytes(b"mine")
    (tmp_path / "a.plan.bak").write_bytes(b"older")
    if os.name == "posix":
        path.chmod(0o640)
        (tmp_path / "a.plan.bak2").symlink_to(tmp_path / "nowhere")
    else:
        (tmp_path / "a.plan.bak2").write_bytes(b"old")
    if not links:  # as on a memory card

        def refuse(*_):
            raise OSError(errno.EPERM, "Operation not permitted")

        monkeypatch.setattr(Path, "hardlink_to", refuse)
    aside = keep_aside(path)
    write_file(path, b"ours")
    assert aside == tmp_path / "a.plan.bak3"
    assert aside.read_bytes() == b"mine"
    assert (tmp_path / "a.plan.bak").read_bytes() == b"older"
    assert not (tmp_path / "nowhere").exists()
    if os.name == "posix":
        assert mode_of(aside) == 0o640


ROOT = Path(__file__).parents[3]
WRITERS = ("missions/formats/files.py", "mavlink_bridge/backup/kept_file.py", "mavlink_bridge/tlog/writer.py")
WRITING = re.compile(
    r"\.write_text\(|\.write_bytes\(|savefig\((?!image)|mkstemp|NamedTemporaryFile|os\.open\(|shutil\.(copy|move)"
    r"|open\([^)]*[\"'][rb]*[wa][b+]*[\"']"
)


@pytest.mark.parametrize("package", ["pbpp", "missions", "mavlink_bridge"])
def test_nothing_else_creates_files(package):
    found = {
        f"{path.relative_to(ROOT).as_posix()}: {line.strip()}"
        for path in (ROOT / package).rglob("*.py")
        for line in path.read_text(encoding="utf-8").splitlines()
        if WRITING.search(line) and path.relative_to(ROOT).as_posix() not in WRITERS
    }
    assert (
        found
        <= {
            # What is handed a descriptor that was created exclusively, the list of our own in the state folder, and no file at all.
            'mavlink_bridge/cli/kept_files.py: return os.fdopen(create_exclusively(path), "w", encoding="utf-8", newline="\\n")',
            'mavlink_bridge/cli/kept_files.py: with known.open("a", encoding="utf-8") as file:',
            'mavlink_bridge/backup/vehicle_lock.py: file: IO[bytes] = path.open("a+b")',  # locked, and told who has it
            'mavlink_bridge/dataset/store.py: lock = (self.folder / _LOCK).open("ab")',  # locked, and stays empty
            # In a temporary folder; what becomes a result is put in place as a whole.
            'mavlink_bridge/cli/plan_batch.py: with lines.open("w", encoding="ascii", newline="\\n") as file:',
            "mavlink_bridge/many/parcel.py: paths[file.path].write_bytes(file.content)",
            "mavlink_bridge/console/reading.py: path.write_bytes(data)",
            'mavlink_bridge/cli/app.py: nowhere = Path(os.devnull).open("w", encoding="utf-8")  # noqa: SIM115 - for as long as the program runs',
            "mavlink_bridge/cli/failing.py: os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())",
        }
    )


def mode_of(path):
    return stat.S_IMODE(path.stat().st_mode)


def names(folder):
    return sorted(path.name for path in folder.iterdir())
