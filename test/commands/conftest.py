"""The command `gameinfer` as a shell starts it, with all that takes long to import out of reach."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import pytest
from small_scenario import scenario_file

__all__ = ["scenario_file", "shell"]

#: What help, completion and complaints must do without.
HEAVY = ("joblib", "matplotlib", "msg_adapters", "numba", "numpy", "pydantic", "rclpy", "rich",
         "scipy", "yaml")  # fmt: skip

LIGHT_GAMEINFER = f"""\
#!{sys.executable}
import sys
for name in {HEAVY}:
    sys.modules[name] = None
from gameinfer_ros.commands.gameinfer import main
sys.exit(main())
"""


@pytest.fixture(scope="session")
def shell(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """An environment in which `gameinfer` is found, and can import nothing that takes long."""
    folder = tmp_path_factory.mktemp("bin")
    command = folder / "gameinfer"
    command.write_text(LIGHT_GAMEINFER)
    command.chmod(0o755)
    beside = Path(sys.executable).parent  # register-python-argcomplete is there
    root = Path(__file__).parents[2]
    return {
        **os.environ,
        "COLUMNS": "80",
        "PATH": os.pathsep.join([str(folder), str(beside), os.environ["PATH"]]),
        "PYTHONPATH": os.pathsep.join([str(root), os.environ.get("PYTHONPATH", "")]),
    }
