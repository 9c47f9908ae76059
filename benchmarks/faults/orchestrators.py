"""What happens to orchestrators, and who follows them."""

from __future__ import annotations

import random
import signal
import subprocess
import sys
import time
from contextlib import ExitStack
from functools import partial
from pathlib import Path

from bystander import environment
from faulty_run import NODES, FaultyRun
from full_disk import fill_up, log_writer
from promise import promise
from run_command import DEADLINE
from trial import LEAST, Fault, Figures, RunTrial, a_run

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


def gets_two(folder: Path) -> Figures:
    """It ends as by one of them, as when a terminal is closed and its session is ended."""
    with a_run(folder) as trial:
        run, begin = trial.run, time.monotonic()
        first, second = random.sample((signal.SIGHUP, signal.SIGTERM), 2)
        run.process.send_signal(first)
        time.sleep(random.uniform(0.0, 0.002))
        run.process.send_signal(second)
        code, order = run.exit_code(), f"{first.name} and {second.name}"
        promise(code == 130, f"the exit code is {code} after {order}: {run.stderr}")
        promise(not run.leftovers(), f"nodes are left after {order}: {run.leftovers()}")
        trial.figures["all_gone_s"] = time.monotonic() - begin
    return trial.figures


def is_interrupted_at_any_time(folder: Path) -> Figures:
    """It ends, whatever it is about: starts, plays, writes results, or has ended by itself."""
    with ExitStack() as endings:
        start, moment = time.monotonic(), random.uniform(0.0, _WHOLE_RUN)
        number = random.choice((signal.SIGINT, signal.SIGTERM, signal.SIGHUP))
        trial = RunTrial(folder, steps=30)
        endings.callback(trial.run.end)
        endings.callback(trial.stops_watching)
        run = trial.run
        while time.monotonic() < start + moment:
            trial.look_at_processes()
            time.sleep(0.05)
        begin, said = time.monotonic(), run.stdout.splitlines()[-1:]
        run.process.send_signal(number)
        # It may have been about to start nodes.
        while run.process.poll() is None:
            promise(time.monotonic() < begin + DEADLINE, f"it goes on after {number.name}")
            trial.look_at_processes()
            time.sleep(0.05)
        code, when = run.exit_code(), f"by {number.name} at {moment:.1f} s, after {said}"
        # While Python itself starts, it ends in a way of its own.
        promise(code in (0, 130) or moment < 1.0, f"the exit code is {code} {when}")
        promise(run.stderr == "" or moment < 1.0, f"it complains {when}: {run.stderr}")
        trial.judge(LEAST if run.step >= 20 else 0)
        trial.nothing_is_left()
        return {**trial.figures, "all_gone_s": time.monotonic() - begin}


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


def meets_another(user: str, folder: Path) -> Figures:
    """The second starts no node and says why, and the first is not disturbed."""
    # Runs of one user find each other by their locks, and those of two only by their messages.
    own = {} if user == "the same" else {"TMPDIR": str(folder)}
    code, why = (1, "somebody else publishes joint_state") if own else (2, "another run is in the")
    with a_run(folder) as trial:
        begin = time.monotonic()
        folder.chmod(0o700)
        with environment(**own):
            second = FaultyRun(folder / "second", domain=trial.domain)
        try:
            while second.process.poll() is None:
                promise(time.monotonic() < begin + DEADLINE, "it goes on")
                promise(not second.nodes(), "it starts nodes")
                time.sleep(0.05)
            told = second.stderr
            promise(second.exit_code() == code, f"it ends by {second.exit_code()}: {told}")
            promise(why in told, f"it does not say why: {told}")
        finally:
            second.end()
        slowest = min(trial.account.speeds(begin, time.monotonic()), default=0.0)
        promise(slowest > 0.05, "the first run is disturbed")
        trial.until_resumes(time.monotonic())
        promise(trial.run.stderr == "", f"the first run complains: {trial.run.stderr}")
    return trial.figures


def fills_the_disk(what: str, folder: Path) -> Figures:
    """The bag can be read up to there; nodes go on without their logs."""
    with a_run(folder) as trial:
        run, step = trial.run, trial.run.step
        if what == "the logs":
            with (
                environment(ROS_AUTOMATIC_DISCOVERY_RANGE="LOCALHOST"),
                log_writer(trial.domain) as let_each_log,
            ):
                for node in NODES:
                    fill_up(run.pid(node), 0)
                logs = {node: run.log(node) for node in NODES}
                let_each_log()
            # At its first change each has told its log, so that it would have told the second.
            told = all("is 7 now" in log or "is 0.7 now" in log for log in logs.values())
            promise(told, f"logs could not be written before: {logs}")
            trial.until_resumes(time.monotonic())
            run.until_goes_on()
            written = [node for node in NODES if run.log(node) != logs[node]]
            promise(not written, f"logs could be written: {written}")
        else:
            (file,) = trial.bag.glob("*.mcap")
            fill_up(run.process.pid, file.stat().st_size + random.randrange(2000))
            promise(run.exit_code() == 1, "the exit code is another one")
            promise("the bag cannot be written" in run.stderr, f"it does not say why: {run.stderr}")
            trial.figures["steps_until_told"] = float(run.step - step)
    return trial.figures


FAULTS: dict[str, Fault] = {
    **{
        f"orchestrator: {name}": partial(gets, name)
        for name in ("SIGINT", "SIGTERM", "SIGHUP", "SIGKILL")
    },
    "orchestrator: SIGHUP and SIGTERM together": gets_two,
    "orchestrator: a signal at any time from its start on": is_interrupted_at_any_time,
    "orchestrator: SIGKILL, then another run": is_followed_by_a_run,
    "orchestrator: SIGKILL, then a replay": is_followed_by_a_replay,
    "a second orchestrator in the domain": partial(meets_another, "the same"),
    "a second orchestrator, of another user": partial(meets_another, "another"),
    "disk full: the bag": partial(fills_the_disk, "the bag"),
    "disk full: the logs": partial(fills_the_disk, "the logs"),
}
