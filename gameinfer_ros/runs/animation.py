"""The animation of a run: the moving players, and the belief of the robot."""

from collections.abc import Iterable
from pathlib import Path
from subprocess import CalledProcessError
from typing import Any

import numpy as np
from matplotlib.animation import FFMpegWriter
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.legend import Legend
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, Polygon, Rectangle
from matplotlib.text import Text
from PIL import Image
from rich.console import Console
from rich.progress import track

from gameinfer_ros.games import goal_positions
from gameinfer_ros.names import colours
from gameinfer_ros.names.files import MP4
from gameinfer_ros.runs.picture import draw_belief
from gameinfer_ros.runs.record import RunRecord

#: Width and height of a frame, in inches, and pixels per inch.
SIZE, DPI = (9.0, 4.2), 100

#: Shortest duration of a frame, in s.
FRAME = 0.1

#: Outline of a player at the origin that heads along x, for a size of 1.
_BODY = np.array([[1.0, 0.0], [-0.7, 0.6], [-0.4, 0.0], [-0.7, -0.6]])


class Animation:
    """A figure that shows any step of a run with at least one state."""

    def __init__(self, record: RunRecord, title: str) -> None:
        self._dt = record.game.dt
        every = max(1, round(FRAME / self._dt))
        last = len(record.states) - 1
        #: Steps that are frames: the first one of each frame, and the last one of the run.
        self.steps = [*range(0, last, every), last]
        self.seconds = every * self._dt  # duration of a frame
        poses = record.vehicles.poses(np.array(record.states))
        self._poses = poses[:, : len(record.vehicles)]

        figure = Figure(figsize=SIZE, dpi=DPI, layout="constrained")
        figure.suptitle(title)
        self.ways, belief = figure.subplots(1, 2)
        self.bodies: list[Polygon] = []  # outline of each player; the first corner is the nose
        self.discs: dict[int, Circle] = {}  # of the players with a radius, by index
        self.paths: list[Line2D] = []  # past positions of each player
        self._names: list[Text] = []
        self._draw_players(record)
        draw_belief(belief, record)
        self._end = max(record.beliefs, default=0) * self._dt
        # Covers the later beliefs.
        self.future = belief.add_patch(Rectangle((0, 0), self._end, 1, color="white"))

        # Drawing is slow: the background is drawn once, and each frame redraws the moving artists.
        over_future = [*belief.spines.values(), *belief.findobj(Legend)]
        players = (*self.paths, *self.discs.values(), *self.bodies, *self._names)
        self._moving = [self.future, *over_future, *players, self.ways.title]
        for artist in self._moving:
            artist.set_animated(True)
        self._canvas = FigureCanvasAgg(figure)
        self._canvas.draw()
        self._background = self._canvas.copy_from_bbox(figure.bbox)

    def frame(self, step: int) -> np.ndarray:
        """Draw a step, and return the pixels (height, width, 4) in RGBA."""
        time = step * self._dt
        self.ways.set_title(f"t = {time:.2f} s")
        for i, (x, y, yaw) in enumerate(self._poses[step]):
            known = bool(np.isfinite(x))
            self.bodies[i].set_visible(known)
            self._names[i].set_visible(known)
            along = np.array([np.cos(yaw), np.sin(yaw)])
            across = np.array([-along[1], along[0]])
            self.bodies[i].set_xy([x, y] + self._size * _BODY @ [along, across])
            above = 1.5 * self._size
            if i in self.discs:
                self.discs[i].set_visible(known)
                self.discs[i].set_center((x, y))
                above = max(above, self.discs[i].get_radius() + 0.5 * self._size)
            self._names[i].set_position((x, y + above))
            self.paths[i].set_data(*self._poses[: step + 1, i, :2].T)
        self.future.set_x(time)
        self.future.set_width(max(0.0, self._end - time))
        self._canvas.restore_region(self._background)
        for artist in self._moving:
            artist.draw(self._canvas.get_renderer())
        return np.asarray(self._canvas.buffer_rgba())

    def _draw_players(self, record: RunRecord) -> None:
        """Draw the goals, and create the bodies, names and paths that `frame` moves."""
        axes, goals = self.ways, goal_positions(record.game)
        places = np.concatenate([*goals, self._poses[..., :2].reshape(-1, 2)])
        low, high = np.nanmin(places, axis=0), np.nanmax(places, axis=0)
        self._size = 0.04 * float((high - low).max()) or 0.25
        radii = record.vehicles.radii
        margin = 3 * self._size + radii.max()
        (left, bottom), (right, top) = low - margin, high + margin
        axes.set(aspect="equal", xlim=(left, right), ylim=(bottom, top))
        axes.set(xlabel="x in m", ylabel="y in m", title="t")  # the title reserves space
        for i, name in enumerate(record.vehicles.names):
            colour = colours.of_player(i)
            axes.plot(*goals[i].T, "*", color=colour, markersize=12, fillstyle="none")
            self.paths += axes.plot([], [], color=colour)
            if radii[i] > 0:
                disc = Circle((0, 0), radii[i], color=colour, alpha=0.25)
                self.discs[i] = axes.add_patch(disc)
            self.bodies.append(axes.add_patch(Polygon(_BODY, color=colour)))
            self._names.append(axes.text(0, 0, name, color=colour, ha="center"))


def draw(record: RunRecord, path: Path, title: str, console: Console) -> None:
    """Write an animation of a run, in real time, to a GIF or, by its suffix, an MP4 file.

    A failure or Ctrl-C leaves no file behind.

    Raises:
        OSError: the file cannot be written.
    """
    animation = Animation(record, title)
    steps = track(
        animation.steps, "Drawing the animation ...", console=console, transient=True,
        disable=not console.is_terminal,
    )  # fmt: skip
    frames = (animation.frame(step) for step in steps)
    try:
        if path.suffix.lower() == MP4:
            _write_video(frames, path, animation.seconds)
        else:
            _write_gif(frames, animation.frame(animation.steps[-1]), path, animation.seconds)
    except BaseException as error:
        path.unlink(missing_ok=True)
        if isinstance(error, CalledProcessError):
            raise OSError(f"ffmpeg failed: {error}") from None
        raise


def _write_video(frames: Iterable[np.ndarray], path: Path, seconds: float) -> None:
    # The writer redraws its figure for each frame, so give it one that contains only an image.
    screen = Figure(figsize=SIZE)
    width, height = (round(DPI * inches) for inches in SIZE)
    image = screen.figimage(np.zeros((height, width, 4), dtype=np.uint8))
    make_writer: Any = FFMpegWriter  # typed for whole rates only
    writer = make_writer(fps=1 / seconds)
    with writer.saving(screen, path, DPI):
        for frame in frames:
            image.set_data(frame)
            writer.grab_frame()


def _write_gif(frames: Iterable[np.ndarray], last: np.ndarray, path: Path, seconds: float) -> None:
    # A palette shared by all frames lets each frame be stored as its difference to the one before.
    # The last frame contains all colours. Matplotlib's writer makes a palette per frame.
    palette = Image.fromarray(last).convert("RGB").quantize(method=Image.Quantize.MAXCOVERAGE)
    images = (
        Image.fromarray(frame).convert("RGB").quantize(palette=palette, dither=Image.Dither.NONE)
        for frame in frames
    )
    next(images).save(
        path, save_all=True, append_images=images, duration=round(1000 * seconds), loop=0
    )
