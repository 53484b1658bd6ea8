"""Tasks on the workers of a dask scheduler on loopback: the same as here, whatever becomes of a worker, and only with our own version."""

from __future__ import annotations

import re
import shutil
import time
from concurrent.futures import Future
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from types import SimpleNamespace

import pytest
from dataset.every_row import every_row
from distributed import KilledWorker
from many import work
from many.dask_processes import dask_cluster, other_version
from typer.testing import CliRunner

from mavlink_bridge.cli.app import app
from mavlink_bridge.dataset.build import build, log_files
from mavlink_bridge.dataset.store import Dataset
from mavlink_bridge.errors import ClusterError, LostWorkerError
from mavlink_bridge.many import Task, open_workers, parcel
from mavlink_bridge.many.cluster import Cluster, check_versions, open_cluster
from mavlink_bridge.many.parcel import Refused, open_parcel, parcel_of
from mavlink_bridge.many.task import Outcome

OWN = version("pbpp-rover")


YARD = Path(__file__).parents[3] / "examples" / "yard"


def timeless(text: str) -> str:
    """Return results without how long planning took."""
    return re.sub(r'"planning_s": [\d.]+', "", text)


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

        table = tmp_path / "plans.csv"
        start, target = "40.071374,-105.229930", "40.07228,-105.22907"
        table.write_text(
            f'fence,start,target\n{YARD}/fence.waypoints,"{start}","{target}"\nnone.plan,"{start}","{target}"\n'
        )
        checks = [
            "check",
            str(YARD / "drawn.waypoints"),
            str(tmp_path / "none.plan"),
            "--fence",
            str(YARD / "fence.waypoints"),
            "--json",
        ]
        plans = ["plan", "--batch", str(table), "--vehicle", str(YARD / "rover.parm"), "--home", start]
        for arguments in (checks, plans):
            one, other = run(*arguments, "--jobs", "1"), run(*arguments, "--cluster", cluster.address)
            assert (other.exit_code, timeless(other.stdout)) == (one.exit_code, timeless(one.stdout))

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
def test_the_same_with_processes_and_with_one_two_and_four_workers_one_of_which_is_killed(
    logs, tmp_path, monkeypatch
):
    names = sorted(map(str, logs.glob("*.tlog")))[::2]
    here = run("replay", *names, "--json", "--jobs", "1")
    assert run("replay", *names, "--json", "--jobs", "2").stdout == here.stdout
    folder = tmp_path / "logs"
    folder.mkdir()
    data = (logs / "no-fence.tlog").read_bytes()
    for number in range(40):
        (folder / f"{number:02}.tlog").write_bytes(data[: len(data) - 500 * number])
    assert run("logs", "build", str(folder), "-o", str(tmp_path / "here"), "--jobs", "2").exit_code == 0
    with dask_cluster(tmp_path, 1) as cluster:
        for count in (1, 2, 4):
            while len(cluster.workers) < count:
                cluster.add_worker()
            cluster.wait_for(count)
            there = run("replay", *names, "--json", "--cluster", cluster.address)
            assert (there.exit_code, there.stdout) == (here.exit_code, here.stdout)

        monkeypatch.setattr("mavlink_bridge.dataset.build._A_TASK", 1)  # so that each worker has some
        victim = cluster.workers[0]

        def kill_one(progress):
            if progress.read == 3:
                victim.kill()

        with open_workers(cluster=cluster.address) as workers:
            progress = build(Dataset(tmp_path / "there"), log_files([folder]), workers, kill_one)
        assert victim.wait(timeout=10) != 0
        assert (progress.read, progress.bad) == (40, [])
        assert every_row(tmp_path / "there") == every_row(tmp_path / "here")


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


def test_errors_name_the_files_that_the_reader_knows(tmp_path):
    (tmp_path / "empty.txt").touch()
    task = Task(None, (tmp_path / "empty.txt",))
    sent = open_parcel(work.read, parcel_of(task, with_content=True))
    assert str(sent.error) == f"{tmp_path / 'empty.txt'} is empty"
    details = open_parcel(work.refuse, parcel_of(task, with_content=True)).error.details
    assert details == {"file": str(tmp_path / "empty.txt"), "line": 3}
    there = parcel_of(task, with_content=False)
    assert isinstance(open_parcel(work.read, there).error, ValueError)
    (tmp_path / "empty.txt").write_text("now longer")
    assert open_parcel(work.read, there) == Refused()


def test_a_file_that_cannot_be_read_is_left_to_the_function(tmp_path):
    packed = parcel_of(
        Task(None, (tmp_path, tmp_path / "none")), with_content=True
    )  # a folder has no content
    assert [file.content for file in packed.files] == [None, None]


class FakeClient:
    """A client whose futures end as a test says."""

    def __init__(self, own: str = OWN) -> None:
        self.status = "running"
        self.submitted: list[Future] = []
        self.trouble: Exception | None = None
        self._own = own

    def get_executor(self, **_options):
        return self

    def nthreads(self):
        if self.trouble is not None:
            raise self.trouble
        return {"tcp://a": 2}

    def run(self, *_arguments, workers, on_error):
        return dict.fromkeys(workers, self._own)

    def submit(self, function, *arguments):
        if self.trouble is not None:
            raise self.trouble
        self.submitted.append(Future())
        return self.submitted[-1]

    def shutdown(self, *, wait):
        assert not wait

    def close(self):
        self.status = "closed"


@pytest.mark.parametrize(
    ("error", "kind", "text"),
    [
        (ValueError("odd"), ValueError, "odd"),
        (KilledWorker("a task", None, 3), LostWorkerError, "4 workers died at it; it may need more memory"),
        (
            KilledWorker("a task", SimpleNamespace(address="tcp://a"), 3),
            LostWorkerError,
            "the last one tcp://a",
        ),
    ],
)
def test_what_dask_says_of_a_task_is_its_error(error, kind, text):
    cluster = Cluster(FakeClient(), "tcp://s:1")
    future = cluster.submit(work.square, Task(1))
    future.set_exception(error)
    outcome = cluster.outcome(future, work.square, Task(1))
    assert isinstance(outcome.error, kind)
    assert text in str(outcome.error)


def test_what_ends_a_run_on_a_cluster():
    client = FakeClient()
    cluster = Cluster(client, "tcp://s:1")
    assert cluster.count() == 2
    refused = cluster.submit(work.square, Task(1))
    refused.set_result(Refused("0.0.9"))
    with pytest.raises(ClusterError, match="a worker that joined has pbpp-rover 0"):
        cluster.outcome(refused, work.square, Task(1))
    unseen = cluster.submit(work.square, Task(1))
    unseen.set_result(Refused())
    assert cluster.outcome(unseen, work.square, Task(1)) is client.submitted[-1]
    cluster.drop(client.submitted[-1:])
    with pytest.raises(ClusterError, match="tcp://s:1 is lost"):
        cluster.outcome(client.submitted[-1], work.square, Task(1))
    cluster.mend()
    client.trouble = RuntimeError("a bug")
    with pytest.raises(RuntimeError, match="a bug"):
        cluster.submit(work.square, Task(1))
    client.status = "connecting"
    with pytest.raises(ClusterError, match="tcp://s:1 is lost"):
        cluster.submit(work.square, Task(1))
    client.trouble = OSError("closed")
    with pytest.raises(ClusterError, match="tcp://s:1 is lost"):
        Cluster(client, "tcp://s:1")
    cluster.close()
    with pytest.raises(ClusterError, match="refused: tcp://a has pbpp-rover 0"):
        Cluster(FakeClient("0.0.9"), "tcp://s:1")


def test_a_scheduler_without_workers_says_how_to_start_some(monkeypatch):
    class Idle(FakeClient):
        def wait_for_workers(self, count, timeout):
            raise TimeoutError

    monkeypatch.setattr("mavlink_bridge.many.cluster.Client", lambda *_arguments, **_options: Idle())
    with pytest.raises(ClusterError, match="tcp://s:1 has no workers") as caught:
        open_cluster("tcp://s:1")
    assert "dask worker tcp://s:1" in caught.value.details["advice"]
