"""The animation of a run shows what happened, at the speed at which it did."""

from __future__ import annotations

import io
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from rich.console import Console

from gameinfer_ros.commands import cli
from gameinfer_ros.games import Game, Goal, QuadraticInput, Unicycle, Vehicles
from gameinfer_ros.names import colours
from gameinfer_ros.runs import animation
from gameinfer_ros.runs.animation import FRAME, Animation
from gameinfer_ros.runs.record import RunRecord

SILENT = Console(file=io.StringIO())


def make_record(states: int = 12, dt: float = 0.1) -> RunRecord:
    """A robot on a straight line, and a human on a circle about (1, 0)."""
    dynamics = {"robot": Unicycle(), "human_1": Unicycle()}
    goal = Goal(
        weights=(1, 1, 0, 0), goals={"robot": (3, 2, 0, 0)}, active_from=0, players=("robot",)
    )
    game = Game(dynamics, [QuadraticInput(weights=(1, 1)), goal], dt, 5)
    record = RunRecord(Vehicles(game))
    for k in range(states):
        turn = 0.2 * k
        human = [1 + np.cos(turn), np.sin(turn), turn + np.pi / 2, 0.0]
        record.states.append(np.array([0.1 * k - 1, 0.5, 0.0, 1.0, *human]))
        record.beliefs[k], record.maps[k] = {2: 1 - 0.05 * k, 5: 0.05 * k}, 2
    record.inputs += [np.zeros(4)] * (states - 1)
    return record


def durations(file: Path) -> list[int]:
    """How long each frame of a GIF is shown, in ms."""
    with Image.open(file) as image:
        found = []
        for k in range(image.n_frames):
            image.seek(k)
            found.append(image.info["duration"])
    return found


@pytest.mark.parametrize(
    ("states", "dt", "wanted"),
    [
        (12, 0.1, [100] * 12),  # one for each state
        (1, 0.1, [100]),
        (5, 0.25, [250] * 5),
        (5, 0.07, [70] * 5),
        (21, 0.02, [100] * 5),  # the states 0, 5, 10, 15 and 20
        (24, 0.02, [100] * 6),  # and the last one, 23
    ],
)
def test_frames_are_shown_at_the_speed_of_the_run(
    states: int, dt: float, wanted: list[int], tmp_path: Path
) -> None:
    animation.draw(make_record(states, dt), tmp_path / "run.GIF", "a title", SILENT)
    assert durations(tmp_path / "run.GIF") == wanted


def test_players_are_drawn_where_the_record_says() -> None:
    record = make_record()
    moving = Animation(record, "a title")
    assert moving.steps == list(range(12))
    assert moving.seconds == pytest.approx(FRAME)
    for step in (0, 7, 11, 3):
        picture = moving.frame(step)
        assert moving.ways.get_title() == f"t = {0.1 * step:.2f} s"
        positions = record.vehicles.positions(np.array(record.states))
        for i, (x, y) in enumerate(positions[step]):
            heading = record.states[step][4 * i + 2]
            nose = moving.bodies[i].get_xy()[0] - [x, y]
            assert np.arctan2(nose[1], nose[0]) == pytest.approx(
                np.arctan2(np.sin(heading), np.cos(heading))
            )
            np.testing.assert_allclose(
                np.transpose(moving.paths[i].get_data()), positions[: step + 1, i]
            )
            # And so it is in the picture, which begins at the top.
            column, row = moving.ways.transData.transform((x, y)).round().astype(int)
            wanted = [round(255 * value) for value in colours.rgb(colours.of_player(i))]
            assert picture[len(picture) - 1 - row, column, :3].tolist() == wanted


def test_the_belief_is_covered_from_now_on() -> None:
    moving = Animation(make_record(), "a title")
    axes = moving.future.axes
    for step in (4, 11):
        picture = moving.frame(step)
        for time in (0.15, 0.35, 0.55, 1.05):
            column, row = axes.transData.transform((time, 0.2)).round().astype(int)
            shown = picture[len(picture) - 1 - row, column, :3].tolist() != [255] * 3
            assert shown == (time < 0.1 * step)


def test_goals_and_players_are_all_inside() -> None:
    record = make_record()
    moving = Animation(record, "a title")
    moving.frame(11)
    places = [*record.vehicles.positions(np.array(record.states)).reshape(-1, 2), (3, 2)]
    (low_x, high_x), (low_y, high_y) = moving.ways.get_xlim(), moving.ways.get_ylim()
    assert all(low_x < x < high_x and low_y < y < high_y for x, y in places)
    stars = [line.get_xydata() for line in moving.ways.lines if line.get_marker() == "*"]
    assert [star.tolist() for star in stars] == [[[3, 2]], []]


def test_a_run_of_one_who_stands_still_without_a_belief_can_be_drawn(tmp_path: Path) -> None:
    game = Game({"robot": Unicycle()}, [QuadraticInput(weights=(1, 1))], 0.1, 5)
    record = RunRecord(Vehicles(game), [np.zeros(4)] * 2, [np.zeros(2)])
    animation.draw(record, tmp_path / "run.gif", "a title", SILENT)
    assert durations(tmp_path / "run.gif") == [100, 100]


def test_a_file_is_small(tmp_path: Path) -> None:
    animation.draw(make_record(101), tmp_path / "run.gif", "a title", SILENT)
    assert (tmp_path / "run.gif").stat().st_size < 3e6


def test_progress_is_shown_on_a_terminal_only(tmp_path: Path) -> None:
    for terminal in (True, False):
        console = Console(file=io.StringIO(), force_terminal=terminal, width=100)
        animation.draw(make_record(3), tmp_path / "run.gif", "a title", console)
        assert ("Drawing the animation" in console.file.getvalue()) == terminal


def test_half_an_animation_is_none(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    draw = Animation.frame

    def interrupted(self: Animation, step: int) -> np.ndarray:
        if step == 5:
            raise KeyboardInterrupt
        return draw(self, step)

    monkeypatch.setattr(Animation, "frame", interrupted)
    with pytest.raises(KeyboardInterrupt):
        animation.draw(make_record(), tmp_path / "run.gif", "a title", SILENT)
    assert not list(tmp_path.iterdir())


# --- ffmpeg --------------------------------------------------------------------------------------


@pytest.mark.skipif(shutil.which("ffmpeg") is None, reason="there is no ffmpeg")
def test_ffmpeg_makes_a_video(tmp_path: Path) -> None:
    animation.draw(make_record(), tmp_path / "run.mp4", "a title", SILENT)
    done = subprocess.run(
        ["ffmpeg", "-i", tmp_path / "run.mp4", "-f", "null", "-"], capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    assert "frame=   12 " in done.stderr


def test_a_failure_of_ffmpeg_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    command = tmp_path / "ffmpeg"
    command.write_text("#!/bin/sh\nexit 3\n")
    command.chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path), prepend=":")
    with pytest.raises(OSError):
        animation.draw(make_record(), tmp_path / "run.mp4", "a title", SILENT)
    assert not (tmp_path / "run.mp4").exists()


# --- The option ----------------------------------------------------------------------------------


@pytest.mark.parametrize("command", [["run"], ["inspect", "a_bag"]])
@pytest.mark.parametrize(
    ("file", "words"),
    [
        ("run.avi", (".gif", ".mp4")),
        ("run", (".gif", ".mp4")),
        ("missing/run.gif", ("folder", "exists")),
        ("folder.gif", ("must be a file",)),
        ("run.mp4", ("ffmpeg", ".gif")),
    ],
)
def test_files_that_cannot_be_made_are_refused_before_anything_runs(
    file: str,
    words: tuple[str, ...],
    command: list[str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    (tmp_path / "folder.gif").mkdir()
    monkeypatch.setenv("PATH", "")  # where there is no ffmpeg
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit, match="2"):
        cli.main([*command, "--animation", file])
    told = capsys.readouterr().err
    for word in ("--animation", f"'{file}'", *words):
        assert word in told
    assert [path.name for path in tmp_path.iterdir()] == ["folder.gif"]


def test_players_with_a_radius_are_drawn_as_large_as_they_are() -> None:
    record = make_record()
    assert not Animation(record, "a title").discs
    players = dict(zip(record.vehicles.names, record.vehicles.dynamics, strict=True))
    terms = [bound.term for bound in record.game.terms[0]]
    large = Vehicles(Game(players, terms, record.game.dt, 5, {"human_1": 0.7}))
    moving = Animation(RunRecord(large, record.states, record.inputs, record.beliefs), "a title")
    assert list(moving.discs) == [1] and moving.discs[1].get_radius() == 0.7
    picture = moving.frame(7)
    (x, y), size = record.vehicles.positions(record.states[7])[1], picture.shape[0]
    np.testing.assert_array_equal(moving.discs[1].get_center(), (x, y))
    # Just within the edge is its colour, made pale; just beyond is nothing.
    red, green, blue = colours.rgb(colours.of_player(1))
    pale = [round(255 * (0.75 + 0.25 * value)) for value in (red, green, blue)]
    for distance, expected in ((0.65, pale), (0.75, [255] * 3)):
        at = moving.ways.transData.transform((x, y - distance))
        column, line = at.round().astype(int)
        np.testing.assert_allclose(picture[size - 1 - line, column, :3], expected, atol=1)
    for low, high, positions in zip(
        *np.transpose([moving.ways.get_xlim(), moving.ways.get_ylim()]),
        record.vehicles.positions(np.array(record.states))[:, 1].T,
        strict=True,
    ):
        assert low < positions.min() - 0.7 and positions.max() + 0.7 < high, "it is cut off"
