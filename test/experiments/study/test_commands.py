"""The commands of the studies, as a user starts them."""

from __future__ import annotations

import json
import os
import shlex
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
import yaml_text
from scenario_content import edited

from gameinfer_ros.commands import cli

#: Few, to be quick, but enough to interrupt a study.
RUNS = 20
#: Files of a study that are text.
STORED = ("study.json", "scenario.yaml", "runs.csv", "figures.json")

#: Runs commands where no part of ROS can be imported, and prints their exit codes.
WITHOUT_ROS = """
import json, sys
class Refuse:
    def find_spec(self, name, path=None, target=None):
        if name.split(".")[0] in {"rclpy", "std_msgs", "sensor_msgs", "geometry_msgs"}:
            raise ImportError(f"{name} is not to be imported")
sys.meta_path.insert(0, Refuse())
from gameinfer_ros.commands import cli
print([cli.main(line) for line in json.loads(sys.argv[1])])
"""


def start(*args: str) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, *args],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        start_new_session=True,
    )


def planning(scenario: Path, jobs: int) -> list[str]:
    """A study of planning, without the folder that it is to be in."""
    count = ["--runs", str(RUNS), "--jobs", str(jobs)]
    return ["planning", "--scenario", str(scenario), *count, "--out"]


@pytest.fixture(scope="module")
def whole(short: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a study that was not interrupted."""
    folder = tmp_path_factory.mktemp("whole")
    assert cli.main([*planning(short, jobs=1), str(folder)]) == 0
    return folder


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
def test_an_interrupted_study_can_be_resumed(
    number: signal.Signals, short: Path, whole: Path, tmp_path: Path
) -> None:
    parts = str(tmp_path / "parts")
    study = start("-m", "gameinfer_ros", *planning(short, jobs=2), parts)
    journal = tmp_path / "parts/runs.csv"
    deadline = time.monotonic() + 120
    try:
        while not journal.exists() or journal.read_text().count("\n") < 4:
            assert study.poll() is None and time.monotonic() < deadline
            time.sleep(0.01)
    finally:
        os.killpg(study.pid, number)
        output, _ = study.communicate(timeout=30)
    if number != signal.SIGKILL:
        assert study.returncode == 130
        assert "Interrupted. All finished runs are kept." in output
        assert f"To resume, repeat the command with --out {parts}." in output
        assert "Traceback" not in output
    kept = journal.read_text().splitlines()
    assert 4 <= len(kept) < 1 + 2 * RUNS
    assert cli.main([*planning(short, jobs=1), parts]) == 0
    assert journal.read_bytes() == (whole / "runs.csv").read_bytes()
    assert set(kept[1:-1]) <= set(journal.read_text().splitlines())
    times = (tmp_path / "parts/times.csv").read_text().splitlines()
    assert len(times) == len(journal.read_text().splitlines()) == 1 + 2 * RUNS


def test_studies_need_no_ros(short: Path, tmp_path: Path) -> None:
    counts = {"equilibria": "--samples", "check": "--samples", "prediction": "--runs"}
    counts["planning"] = "--runs"
    lines = [
        [name, "--scenario", str(short), count, "2", "--jobs", "1", "--out", str(tmp_path / name)]
        for name, count in counts.items()
    ]
    lines.append(["report", "--out", "/dev/null/x"])  # all of it takes long
    done = start("-c", WITHOUT_ROS, json.dumps(lines))
    output, _ = done.communicate(timeout=240)
    assert output.splitlines()[-1] == "[0, 0, 0, 0, 2]", output
    for name in counts:
        assert {"figures.json", "runs.csv", "scenario.yaml", "study.json", f"{name}.png",
                f"{name}.pdf"} <= {path.name for path in (tmp_path / name).iterdir()}  # fmt: skip


def test_what_is_stored_is_the_same_wherever_it_is_made(short: Path, tmp_path: Path) -> None:
    stored = []
    for place, out_option in (("here", ["--out", "{}"]), ("elsewhere", ["--out={}"])):
        scenario = tmp_path / place / "short.yaml"
        scenario.parent.mkdir()
        scenario.write_text(short.read_text())
        folder = tmp_path / place / "my results"

        def command(scenario: str, out: str, out_option: list[str] = out_option) -> list[str]:
            options = ["--samples", "2", "--jobs", "1", *(o.format(out) for o in out_option)]
            return ["-m", "gameinfer_ros", "equilibria", "--scenario", scenario, *options]

        done = start(*command(str(scenario), str(folder)))
        output, _ = done.communicate(timeout=240)
        assert done.returncode == 0, output
        texts = {name: (folder / name).read_text() for name in STORED}
        assert not any(str(tmp_path) in text for text in texts.values())
        study = json.loads(texts.pop("study.json"))
        (call,) = study["calls"]
        # The command is kept without folders of the machine.
        expected = ["python", *command("short.yaml", "my results")]
        assert shlex.split(call.pop("command")) == expected
        del call["date"], call["machine"]
        stored.append((texts, study))
    assert stored[0] == stored[1]


@pytest.mark.parametrize(
    ("args", "words"),
    [
        (["--scenario", "nowhere"], "nowhere: is neither a file nor one of the scenarios"),
        (["--backend", "dask"], "--backend dask and --scheduler ADDRESS require each other"),
        (["--scheduler", "tcp://127.0.0.1:1"], "--backend dask and --scheduler ADDRESS require"),
        (["--backend", "dask", "--scheduler", "x"], "--jobs 1 is not allowed with --scheduler"),
        (["--out", "/dev/null/x"], "/dev/null/x"),
    ],
)
def test_bad_input_is_named(
    args: list[str], words: str, short: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    command = ["prediction", "--scenario", str(short), "--runs", "1", "--jobs", "1", *args]
    assert cli.main(command) == 2
    assert words in capsys.readouterr().err


@pytest.mark.parametrize(
    ("args", "words"),
    [
        (["--runs", "0"], "'0' is not allowed: it must be a whole number from 1 to"),
        (["--jobs", "0"], "'0' is not allowed: it must be a whole number from 1 to"),
        (["--ros-args", "-r", "__ns:=/x"], "--ros-args is only allowed for run, not for planning"),
        (["--seed", "-1"], "'-1' is not allowed: it must be a whole number from 0 to"),
        (["--backend", "threads"], "threads"),
    ],
)
def test_bad_options_are_named(
    args: list[str], words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit, match="2"):
        cli.main(["planning", *args])
    assert words in capsys.readouterr().err


def test_runs_of_the_core_and_of_the_nodes_do_not_share_a_folder(
    short: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    command = ["planning", "--scenario", str(short), "--runs", "1", "--jobs", "1", "--out"]
    assert cli.main([*command, str(tmp_path)]) == 0
    assert cli.main([*command, str(tmp_path), "--ros"]) == 2
    assert "made_by is 'core' there, but 'nodes' here" in capsys.readouterr().err


def test_k_means_gives_as_many_clusters_as_it_is_told(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    command = ["equilibria", "--scenario", "two_player", "--samples", "12", "--jobs", "1"]
    for extra, count in (([], 2), (["--k-means", "3"], 3)):
        assert cli.main([*command, "--out", str(tmp_path), "--json", *extra]) == 0
        figures = json.loads(capsys.readouterr().out)
        assert len(figures["clusters"]) == count
        assert sum(cluster["size"] for cluster in figures["clusters"]) <= 12


def test_a_study_warns_of_headings_that_look_like_degrees(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path, heading = tmp_path / "degrees.yaml", [-1.0, 0.0, 200.0, 0.0]
    content = edited(lambda c: c["players"]["robot"].update(initial=heading))
    content["costs"][3]["goals"]["robot"] = heading
    path.write_text(yaml_text.dump(content))
    line = ["check", "--scenario", str(path), "--samples", "1", "--jobs", "1", "--json", "--out"]
    cli.main([*line, str(tmp_path / "out")])
    captured = capsys.readouterr()
    assert f"{path}: warning: players.robot.initial: theta is 200 rad" in captured.err
    assert f"{path}: warning: costs[3].goals.robot: theta is 200 rad" in captured.err
    assert json.loads(captured.out.splitlines()[-1])["samples"] == 1
