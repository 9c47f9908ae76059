"""A recorded run, which tests of bags share."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import recorded_run
from forking import forked_nodes
from run_command import start

__all__ = ["forked_nodes", "start"]


@pytest.fixture(scope="session")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Results of a run, with its bag in `bag`."""
    folder = tmp_path_factory.mktemp("recorded")
    recorded_run.play(folder)
    return folder


@pytest.fixture
def copy(run: Path, tmp_path: Path) -> Callable[..., Path]:
    """Copies the bag with changes, as `write_copy` does."""

    def make(*arguments: Any, **label: Any) -> Path:
        target = tmp_path / "copy"
        recorded_run.write_copy(run / "bag", target, *arguments, **label)
        return target

    return make
