"""Workers: processes that may die, here and on a Dask cluster."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

import pytest
from dask_cluster import dask_cluster
from tasks import Task, die, fail, process_id, square, square_unless_it_is_three

from gameinfer_ros.commands import cli
from gameinfer_ros.experiments import machine
from gameinfer_ros.experiments.study import FailedRunError
from gameinfer_ros.experiments.study.workers import Workers, WorkersError

SQUARES = {number: number**2 for number in range(8)}


@pytest.fixture(scope="module")
def cluster(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    with dask_cluster(tmp_path_factory.mktemp("dask")) as address:
        yield address


@pytest.fixture(params=["processes", "dask"])
def workers(request: pytest.FixtureRequest) -> Workers:
    if request.param == "dask":
        return Workers(scheduler=request.getfixturevalue("cluster"))
    return Workers(jobs=2)


def tasks(folder: Path) -> list[Task]:
    return [Task(number, str(folder)) for number in SQUARES]


def calls(folder: Path) -> dict[int, int]:
    return {
        number: len((folder / f"called-{number}").read_text().splitlines()) for number in SQUARES
    }


def test_every_result_comes_once(workers: Workers, tmp_path: Path) -> None:
    results = list(workers.results(square, tasks(tmp_path)))
    assert len(results) == len(SQUARES)
    assert {task.number: result for task, result in results} == SQUARES
    assert set(calls(tmp_path).values()) == {1}


def test_the_run_of_a_worker_that_dies_is_repeated(workers: Workers, tmp_path: Path) -> None:
    results = list(workers.results(square_unless_it_is_three, tasks(tmp_path)))
    assert (tmp_path / "killed").exists()
    assert len(results) == len(SQUARES)
    assert {task.number: result for task, result in results} == SQUARES
    # Only what was going on was lost, and not what had ended.
    assert sum(calls(tmp_path).values()) <= len(SQUARES) + 4


def test_workers_that_die_again_and_again_end_it(
    workers: Workers, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Workers, "LONGEST", 2)
    with pytest.raises(WorkersError, match=r"8 runs remain, the first is Task\(number=\d"):
        list(workers.results(die, tasks(tmp_path)))


def test_an_error_of_a_run_names_the_run(workers: Workers, tmp_path: Path) -> None:
    wanted = r"run Task\(number=\d.* failed: ZeroDivisionError\('task \d'\)\n(.|\n)*in fail"
    with pytest.raises(FailedRunError, match=wanted):
        list(workers.results(fail, tasks(tmp_path)))


def test_a_study_on_a_cluster_gives_the_same_results(
    short: Path, cluster: str, tmp_path: Path
) -> None:
    command = ["prediction", "--scenario", str(short), "--runs", "3", "--out"]
    there = [str(tmp_path / "there"), "--backend", "dask", "--scheduler", cluster]
    assert cli.main([*command, *there]) == 0
    assert cli.main([*command, str(tmp_path / "here"), "--jobs", "1"]) == 0
    here = (tmp_path / "here/runs.csv").read_bytes()
    assert (tmp_path / "there/runs.csv").read_bytes() == here
    assert "workers of a Dask cluster" in (tmp_path / "there/study.json").read_text()


def test_a_cluster_of_one_worker_is_used(tmp_path: Path) -> None:
    with dask_cluster(tmp_path, workers=1) as address:
        results = list(Workers(scheduler=address).results(process_id, tasks(tmp_path)))
    (worker,) = {pid for _, pid in results}
    assert worker != os.getpid()


def test_workers_of_another_version_are_refused(
    cluster: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    list(Workers(scheduler=cluster).results(process_id, [Task(0, "")]))  # now they are up
    # Process ids stand for versions, because they differ.
    monkeypatch.setattr(machine, "version", os.getpid)
    wanted = rf"has version \d+ of gameinfer_ros, but this machine has {os.getpid()}"
    with pytest.raises(WorkersError, match=wanted):
        list(Workers(scheduler=cluster).results(process_id, [Task(0, "")]))


def test_one_job_needs_no_other_process(tmp_path: Path) -> None:
    results = list(Workers(jobs=1).results(square, tasks(tmp_path)))
    assert [task.number for task, _ in results] == list(SQUARES)


def test_a_scheduler_that_does_not_answer_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Workers, "PATIENCE", 1)
    with pytest.raises(WorkersError, match=r"no Dask scheduler answers at tcp://127\.0\.0\.1:9"):
        list(Workers(scheduler="tcp://127.0.0.1:9").results(square, [Task(0, "")]))


def test_an_address_that_is_none_is_refused() -> None:
    with pytest.raises(WorkersError, match="no Dask scheduler answers at nonsense:x"):
        list(Workers(scheduler="nonsense:x").results(square, [Task(0, "")]))
