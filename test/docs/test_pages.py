"""What the pages show works as it stands there: every block of every page is run."""

from __future__ import annotations

import re
import runpy
from pathlib import Path

import pytest
from pages import PAGES, ROOT, Block, blocks, commands, name_of, shell_commands
from ros_domain import free_domain
from shadow import Shadow

#: Commands that take minutes are run with fewer runs and samples, and runs with fewer steps. For so
#: few, it takes longer to start workers than to do their work.
SMALLER = {
    r"^\./dev demo$": "./dev demo --steps 10",
    r"gameinfer run(?!.*--steps)": "gameinfer run --steps 10",
    r"(nodes\.simulator .*)": r"\1 -p steps:=10",
    r"--runs \d+": "--runs 1",
    r"(gameinfer check .*)--samples \d+": r"\1--samples 2",
    r"--samples \d{2,}": "--samples 16",
    r"--cases \d+": "--cases 300",
    r"(gameinfer equilibria .*)": r"\1 --samples 16",
    r"(gameinfer (?:prediction|planning)(?: --scenario \S+)?)$": r"\1 --runs 1",
    r"(gameinfer (?:equilibria|check|prediction|planning) .*)": r"\1 --jobs 1",
    r"(benchmarks/bounded_updates\.py .*)": r"\1 --runs 2 --scenario two_player --max-iterations 4",
}

#: Commands that are not run here, and why.
NOT_RUN = {
    "./dev test": "is what runs this test",
    "chmod -R go-rwx keystore": "needs a keystore, which SROS2 makes",
    "./dev exec python -m sphinx -b html docs build/docs": "a step of .ci/run",
    "./dev exec gameinfer bench": "test_bench.py runs it with --quick",
    "./dev exec python benchmarks/stack.py --scenario five_player": "plays whole runs in real time",
    "./dev exec python benchmarks/faults --repetitions 5": "test/faults does most of it once",
    "./dev exec python benchmarks/faults --repetitions 24 --only 'at once'": "likewise",
    "./dev exec python benchmarks/faults --repetitions 1 --only apart --gap 60": "takes minutes",
    "./dev exec python benchmarks/faults --repetitions 5 --only /clock": "likewise",
    "./dev exec python benchmarks/soak.py --time lockstep --steps 100000": "takes most of an hour",
    "./dev exec python benchmarks/soak.py --time realtime --minutes 30": "likewise",
    "./dev exec python benchmarks/fuzz.py --seed 1 --minutes 6": "test/fuzz runs it for a moment",
    "./dev exec gameinfer check --suite --samples 16 --method newton": "see test_suite.py",
    "./dev exec gameinfer check --suite --samples 16 --method iterative_lq": "likewise",
    "./dev exec gameinfer report": "test_report.py runs it with few runs",
    "./dev exec gameinfer report --runs 6 --samples 96": "test_report.py runs half of it",
    "./dev exec gameinfer planning --scenario five_player": "test_report.py plays among five",
    "./dev exec gameinfer planning --ros --runs 5 --out results/ros": "test_planning_study.py does",
    "./dev exec gameinfer planning --runs 5 --out results/core": "likewise",
    "cmp results/ros/runs.csv results/core/runs.csv": "likewise",
    "./dev exec dask scheduler --host 127.0.0.1 --port 8786": "test_workers.py runs a cluster",
    "./dev exec dask worker tcp://127.0.0.1:8786 --nthreads 1 --nworkers 2": "likewise",
    "./dev exec gameinfer planning --runs 20 --backend dask --scheduler tcp://127.0.0.1:8786": (
        "likewise"
    ),
    "./dev exec gameinfer run --view --control --scenario five_player": "as with --view",
    "./dev exec gameinfer run --external human_1": "test_external_human.py runs it",
    "./dev exec python examples/external_human.py": "likewise, beside it",
    "./dev exec gameinfer run --scenario two_player --external robot": "likewise",
    "./dev exec python examples/external_base.py": "likewise, beside it",
    "./dev exec gameinfer run --scenario two_player --external robot --ros-args "
    "-r robot/cmd_vel:=/cmd_vel -r robot/odom:=/odometry/map": "needs a base",
    "./dev exec gameinfer run --external human_1 --external human_2 --ros-args "
    "-p use_sim_time:=true": "needs a bag of people",
    "rviz2 -d config/gameinfer.rviz": "opens a window; test_viewers.py checks the configuration",
    'eval "$(register-python-argcomplete gameinfer)"': "test_completion.py does",
    "source /opt/ros/jazzy/setup.bash": "of a native Jazzy",
    "rosdep install --from-paths . --ignore-src "
    "--skip-keys 'python3-rosbags-pip mcap-ros2-support'": "of a native Jazzy",
    "python3 -m venv --system-site-packages venv && touch venv/COLCON_IGNORE && "
    ". venv/bin/activate": "of a native Jazzy",
    "pip install 'pydantic>=2.6' 'joblib>=1.4' 'mcap>=1.1' 'rosbags>=0.11' 'numpy<2'": (
        "of a native Jazzy"
    ),
    "python3 -m colcon build && source install/setup.bash": "a step of .ci/run",
}

#: Commands that go on until Ctrl-C, each in a terminal of its own.
NODE = "python -m gameinfer_ros.nodes."


def is_of_ros2(command: str) -> bool:
    """Whether test_ros2_commands.py is there for it."""
    return command.startswith("ros2 ")


@pytest.mark.parametrize("page", [p for p in PAGES if blocks(p)], ids=name_of)
def test_a_page_works_as_it_stands_there(
    page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shadow = Shadow(tmp_path)
    monkeypatch.chdir(tmp_path)
    for number, block in enumerate(blocks(page)):
        if block.file:
            (tmp_path / block.file).write_text(block.text)
        elif block.language == "python":
            code = block.text.replace("domain_id=42", f"domain_id={free_domain()}")
            file = tmp_path / f"block_{number}.py"
            file.write_text(code)
            runpy.run_path(str(file), run_name="__main__")
        elif block.language == "sh":
            run(block, shadow)


#: Commands that have been run on some page: the second one need not show the same again.
have_been_run: set[str] = set()


def run(block: Block, shadow: Shadow) -> None:
    """Run the commands of a block; what it sets holds for those that follow."""
    settings: list[str] = []
    nodes: list[str] = []
    for command in commands(block.text):
        if command in NOT_RUN or command in have_been_run or is_of_ros2(command):
            continue
        if re.fullmatch(r"(export )?\w+=\S+", command):
            settings.append(smaller(command))
        elif command.startswith(NODE):
            nodes.append(smaller(command))
        else:
            shadow.run("\n".join([*settings, smaller(command)]))
            have_been_run.add(command)
    if nodes:
        given = dict(setting.split("=") for setting in settings)
        for name, value in given.items():
            nodes = [node.replace(f"${name}", value) for node in nodes]
        shadow.run_together(nodes, until="done: ")


def smaller(command: str) -> str:
    for pattern, replacement in SMALLER.items():
        command = re.sub(pattern, replacement, command)
    return command


#: What may stand behind the first fence of a block; outputs are text.
FENCES = {
    *("sh", "python", "yaml", "text", "{eval-rst}", "{toctree}"),
    "{literalinclude} ../examples/external_human.py",
    *("{code-block} python", "{code-block} yaml"),
}


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_every_block_is_of_a_kind_that_this_test_knows(page: Path) -> None:
    fences = re.findall(r"^\s*```(.*)$", page.read_text(encoding="utf-8"), re.MULTILINE)
    assert not any(fences[1::2]), "every other fence ends a block"
    assert set(fences[::2]) <= FENCES
    for block in blocks(page):
        assert block.file or block.language != "yaml", f"give it a caption: {block.text}"


def test_what_is_said_not_to_be_run_is_shown_somewhere() -> None:
    assert not set(NOT_RUN) - set(shell_commands())


def test_what_is_said_to_be_made_smaller_is_shown_somewhere() -> None:
    for pattern in SMALLER:
        assert any(re.search(pattern, command) for command in shell_commands()), pattern


def test_links_of_the_readme_lead_somewhere() -> None:
    """Sphinx checks those of all other pages."""
    links = re.findall(r"\]\(([^)#]+)(?:#([^)]*))?\)", (ROOT / "README.md").read_text("utf-8"))
    assert links
    for target, heading in links:
        assert (ROOT / target).exists(), target
        if heading:
            headings = re.findall(r"^#+ (.*)$", (ROOT / target).read_text("utf-8"), re.MULTILINE)
            assert heading in [re.sub(r"[^\w-]", "", h.lower().replace(" ", "-")) for h in headings]
