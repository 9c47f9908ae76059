"""What happens to orchestrators, and who follows them."""

from __future__ import annotations

import random
import resource
import signal
import subprocess
import sys
import time
from functools import partial
from pathlib import Path

from bystander import environment
from faulty_run import NODES, FaultyRun
from promise import promise
from trial import Fault, Figures, RunTrial, a_run, until

#: A run that ends by itself is over by then, in s.
_WHOLE_RUN = 15.0


def gets(signal_name: str, folder: Path) -> Figures:
    """All nodes end, and nothing is left."""
    number = signal.Signals[signal_name]
    with a_run(folder) as trial:
        begin = time.monotonic()
        expected = -9 if number == signal.SIGKILL else 130
        promise(trial.run.ends_by(number) == expected, "the exit code is another one")
        trial.run.until_gone()
        trial.figures["all_gone_s"] = time.monotonic() - begin
    return trial.figures


def is_interrupted_at_any_time(folder: Path) -> Figures:
    """It ends, whatever it is about: starts, plays, writes results, or has ended by itself."""
    trial = RunTrial(folder, steps=30)
    try:
        time.sleep(moment := random.uniform(0.0, _WHOLE_RUN))
        trial.run.nodes()
        begin = time.monotonic()
        code = trial.run.ends_by(signal.SIGINT)
        # While Python itself starts, it ends in a way of its own.
        promise(code in (0, 130) or moment < 1.0, f"the exit code is {code} after {moment:.1f} s")
        promise(trial.run.stderr == "" or moment < 1.0, f"it complains: {trial.run.stderr}")
        trial.judge()
        trial.nothing_is_left()
        return {**trial.figures, "all_gone_s": time.monotonic() - begin}
    finally:
        trial.stops_watching()
        trial.run.end()


def is_followed_by_a_run(folder: Path) -> Figures:
    """The next run in the same domain plays, though the one before was killed just now."""
    with a_run(folder) as trial:
        trial.run.ends_by(signal.SIGKILL)
        trial.stops_watching()
        begin = time.monotonic()
        after = FaultyRun(folder / "after", "--steps", 20, domain=trial.domain)
        try:
            promise(after.exit_code() == 0, f"the next run does not play: {after.stderr}")
            trial.figures["next_run_s"] = time.monotonic() - begin
        finally:
            after.end()
    return trial.figures


def is_followed_by_a_replay(folder: Path) -> Figures:
    """A replay in the same domain plays, though the run was killed just now."""
    with a_run(folder) as trial:
        trial.run.ends_by(signal.SIGKILL)
        begin = time.monotonic()
        command = [sys.executable, "-m", "gameinfer_ros", "replay", str(trial.bag)]
        refused = []
        while True:
            with environment(
                ROS_DOMAIN_ID=str(trial.domain), ROS_AUTOMATIC_DISCOVERY_RANGE="LOCALHOST"
            ):
                done = subprocess.run(command, capture_output=True, text=True, timeout=300)
            took = trial.figures["replay_s"] = time.monotonic() - begin
            if "Steps with a belief in the bag" in done.stdout:
                break
            refused.append(
                f"after {took:.1f} s: {done.stderr.strip()} "
                f"{trial.witness.publishers('joint_state') + trial.witness.publishers('belief')}"
            )
            promise(took < 60.0, f"no replay plays: {refused}")
        promise(not refused, f"a replay refuses: {refused}; one plays after {took:.1f} s")
    return trial.figures


def meets_another(folder: Path) -> Figures:
    """The second says that there is a first, which is not disturbed."""
    with a_run(folder) as trial:
        begin = time.monotonic()
        second = FaultyRun(folder / "second", domain=trial.domain)
        try:
            promise(second.exit_code() == 2, "the exit code is another one")
            promise("another run is in the ROS domain" in second.stderr, "it does not say why")
        finally:
            second.end()
        slowest = min(trial.account.speeds(begin, time.monotonic()), default=0.0)
        promise(slowest > 0.05, "the first run is disturbed")
        trial.until_moves(time.monotonic())
    return trial.figures


def meets_that_of_another_user(folder: Path) -> Figures:
    """Who sees others publish what it does ends, and says so; nobody moves by the inputs of two."""
    with a_run(folder) as trial:
        trial.stops_watching()
        trial.mixed = True
        (folder / "theirs").mkdir(mode=0o700)
        with environment(TMPDIR=str(folder / "theirs")):
            second = FaultyRun(folder / "second", domain=trial.domain)
        both = (trial.run, second)
        try:
            until(lambda: any(run.process.poll() is not None for run in both), "one ends")
            ended = next(run for run in both if run.process.poll() is not None)
            promise(ended.exit_code() == 1, f"it ends by {ended.exit_code()}: {ended.stderr}")
            told = "somebody else publishes" in ended.stderr
            promise(told, f"it does not say why: {ended.stderr}")
            second.nodes()
            if second.process.poll() is None:
                second.ends_by(signal.SIGINT)
            second.until_gone()
        finally:
            second.end()
    return trial.figures


def fills_the_disk(what: str, folder: Path) -> Figures:
    """The bag can be read up to there; nodes go on without their logs."""
    with a_run(folder) as trial:
        run, step = trial.run, trial.run.step
        if what == "the logs":
            for node in NODES:
                resource.prlimit(run.pid(node), resource.RLIMIT_FSIZE, (0, 0))
            run.until_goes_on()
            trial.until_moves(time.monotonic())
        else:
            (file,) = trial.bag.glob("*.mcap")
            size = file.stat().st_size + random.randrange(2000)
            resource.prlimit(run.process.pid, resource.RLIMIT_FSIZE, (size, size))
            promise(run.exit_code() == 1, "the exit code is another one")
            promise("the bag cannot be written" in run.stderr, f"it does not say why: {run.stderr}")
            trial.figures["steps_until_told"] = float(run.step - step)
    return trial.figures


FAULTS: dict[str, Fault] = {
    **{
        f"orchestrator: {name}": partial(gets, name)
        for name in ("SIGINT", "SIGTERM", "SIGHUP", "SIGKILL")
    },
    "orchestrator: Ctrl-C at any time from its start on": is_interrupted_at_any_time,
    "orchestrator: SIGKILL, then another run": is_followed_by_a_run,
    "orchestrator: SIGKILL, then a replay": is_followed_by_a_replay,
    "a second orchestrator in the domain": meets_another,
    "a second orchestrator, of another user": meets_that_of_another_user,
    "disk full: the bag": partial(fills_the_disk, "the bag"),
    "disk full: the logs": partial(fills_the_disk, "the logs"),
}
