"""Fixtures of the tests of studies."""

from __future__ import annotations

from pathlib import Path

import pytest
import yaml_text

from gameinfer_ros.scenario import Scenario


@pytest.fixture(scope="session")
def short(two_player: Scenario, tmp_path_factory: pytest.TempPathFactory) -> Path:
    content = two_player.model_dump(mode="json") | {"steps": 12}
    content["inference"]["particles"] = 10
    path = tmp_path_factory.mktemp("scenario") / "short.yaml"
    path.write_text(yaml_text.dump(content))
    return path
