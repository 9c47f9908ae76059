"""The arguments of setup.py."""

from __future__ import annotations

import runpy
from typing import Any

import pytest
from pages import ROOT


def setup_arguments() -> dict[str, Any]:
    given: dict[str, Any] = {}
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(ROOT)
        patch.setattr("setuptools.setup", lambda **arguments: given.update(arguments))
        runpy.run_path(str(ROOT / "setup.py"))
    return given
