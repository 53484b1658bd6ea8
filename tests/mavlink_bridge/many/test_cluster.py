"""Tasks on the workers of a dask scheduler on loopback: the same as here, whatever becomes of a worker, and only with our own version."""

from __future__ import annotations

import shutil
import time
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import pytest
from many import work
from many.dask_processes import dask_cluster, other_version
from typer.testing import CliRunner

from mavlink_bridge.cli.app import app
from mavlink_bridge.errors import ClusterError
from mavlink_bridge.many import Task, open_workers, parcel
from mavlink_bridge.many.cluster import check_versions, open_cluster
from mavlink_bridge.many.parcel import Refused, open_parcel, parcel_of
from mavlink_bridge.many.task import Outcome

OWN = version("pbpp-rover")


def run(*arguments: str):
    return CliRunner().invoke(app, list(arguments))


def test_by_hand_with_two_workers_one_of_which_is_killed_and_one_of_another_version(
    logs, tmp_path, monkeypatch
):
    """One cluster for all of it: each takes seconds to start."""
    files = [tmp_path / f"{number}.tlog" for number in range(12)]
    for file in files:
        shutil.copy(logs / "no-fence.tlog", file)
    names = list(map(str, files))
    with dask_cluster(tmp_path, 2) as cluster:
        here = run("replay", *names, "--json", "--jobs", "1")
        there = run("replay", *names, "--json", "--cluster", cluster.address)
        assert (there.exit_code, there.stdout) == (here.exit_code, here.stdout)

        with open_workers(cluster=cluster.address) as workers:
            tasks = [Task((0.05, str(tmp_path))) for _ in range(40)]
            told = []
            for done in workers.results(work.slow, tasks):
                if not told:
                    cluster.workers[0].kill()
                told.append(done)
            assert [done.number for done in told] == list(range(40))
            assert all(done.error is None for done in told)

            # files that a worker does not see are sent: here it is made to think so
            path = tmp_path / "data.txt"
            path.write_text("what is in it")
            (tmp_path / "empty.txt").touch()
            monkeypatch.setattr(parcel, "mark_of", lambda path: (1, 1) if path.exists() else None)
            tasks = [
                Task(None, (path,)),
                Task(None, (tmp_path / "empty.txt",)),
                Task(None, (tmp_path / "none",)),
            ]
            sent = list(workers.results(work.read, tasks))
            assert sent[0].value == (["what is in it"], ["data.txt"])
            assert str(sent[1].error) == f"{tmp_path / 'empty.txt'} is empty"
            assert isinstance(sent[2].error, FileNotFoundError)
            monkeypatch.undo()

            stopped = workers.results(work.slow, (Task((0.01, str(tmp_path))) for _ in range(10_000)))
            assert next(stopped).error is None
            stopped.close()

        cluster.add_worker(path=other_version(tmp_path / "other", "0.0.9"))
        cluster.wait_for(2)
        refused = run("replay", *names, "--cluster", cluster.address)
        assert refused.exit_code == 5
        assert "has pbpp-rover 0.0.9" in refused.stderr
        assert f"this program is pbpp-rover {OWN}" in refused.stderr
        assert f"pbpp-rover[cluster]=={OWN}" in refused.stderr
        assert refused.stdout == ""


@pytest.mark.campaign
@pytest.mark.parametrize("count", [1, 2, 4])
def test_the_same_with_any_number_of_workers(logs, tmp_path, count):
    names = sorted(map(str, logs.glob("*.tlog")))
    with dask_cluster(tmp_path, count) as cluster:
        here = run("replay", *names, "--json", "--jobs", "2")
        there = run("replay", *names, "--json", "--cluster", cluster.address)
    assert (there.exit_code, there.stdout) == (here.exit_code, here.stdout)


def test_versions_that_differ_are_refused_by_name():
    check_versions({"tcp://a": OWN, "tcp://b": OSError("it left")})
    with pytest.raises(
        ClusterError, match=f"tcp://b has pbpp-rover 9; tcp://c has no pbpp-rover.*pbpp-rover {OWN}"
    ) as caught:
        check_versions({"tcp://a": OWN, "tcp://c": PackageNotFoundError("pbpp-rover"), "tcp://b": "9"})
    assert caught.value.details["workers"] == {"tcp://b": "9", "tcp://c": None}


def test_a_worker_that_joins_with_another_version_does_nothing():
    task = Task(3)
    packed = parcel_of(task, with_content=False)
    assert open_parcel(work.square, packed) == Outcome(9)
    assert open_parcel(work.square, parcel.Parcel(task, (), "0.0.9")) == Refused(OWN)


def test_without_a_scheduler_what_to_start(monkeypatch):
    monkeypatch.setattr("mavlink_bridge.many.cluster._CONNECT_S", 0.2)
    begun_s = time.monotonic()
    with pytest.raises(ClusterError, match="no dask scheduler answers at tcp:") as caught:
        open_cluster("tcp://127.0.0.1:9")
    assert "dask scheduler" in caught.value.details["advice"]
    assert time.monotonic() - begun_s < 20


def test_copies_of_one_folder_are_in_one_folder(tmp_path):
    for name in ("a/x.txt", "a/y.txt", "b/x.txt"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(name)
    files = tuple(tmp_path / name for name in ("a/x.txt", "b/x.txt", "a/y.txt"))
    packed = parcel_of(Task(None, files), with_content=True)
    outcome = open_parcel(lambda task: [(file.parent.name, file.read_text()) for file in task.files], packed)
    (one, first), (other, second), (same, third) = outcome.value
    assert (first, second, third) == ("a/x.txt", "b/x.txt", "a/y.txt")
    assert one == same != other
    assert Path(tmp_path / "a/x.txt").exists()
