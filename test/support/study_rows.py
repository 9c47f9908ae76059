"""Rows of studies."""

from __future__ import annotations

from collections.abc import Iterable

from gameinfer_ros.experiments.study import Study


def rows_of(study: Study, seeds: Iterable[int]) -> list[dict[str, str]]:
    """What a journal would contain of these runs."""
    return [
        {"seed": str(seed), **{name: str(value) for name, value in study.play((seed,)).items()}}
        for seed in seeds
    ]
