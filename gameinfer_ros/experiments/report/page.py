"""The page of the report: one HTML file that needs no other."""

from __future__ import annotations

import base64
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from jinja2 import Environment, PackageLoader, StrictUndefined

from gameinfer_ros.experiments.report import published
from gameinfer_ros.experiments.report.claims import Claim
from gameinfer_ros.experiments.study import Study, Table
from gameinfer_ros.names.choices import BASELINE, MAP


class Section(NamedTuple):
    """What the page says of one study.

    Attributes:
        study: the study.
        scenario: name of the scenario.
        folder: where its results are.
        figures: what came of it.
        alone: the command that makes this study by itself.
        calls: the commands that made the runs, when, and on what machine.
    """

    study: Study
    scenario: str
    folder: Path
    figures: Mapping[str, Any]
    alone: str
    calls: Sequence[Mapping[str, Any]]

    @property
    def title(self) -> str:
        """What the chapter is about."""
        return f"{self.study.name.capitalize()}: {self.scenario.replace('_', ' ')}"

    @property
    def tables(self) -> list[Table]:
        """The tables of the study, and one with published values if there are any."""
        tables = self.study.tables(self.figures)
        known = published.MEAN_COSTS.get(self.scenario)
        if self.study.name == "planning" and known is not None:
            rows = [
                [
                    name,
                    str(known[MAP][i]), f"{self.figures[MAP]['mean_cost'][i]:.0f}",
                    str(known[BASELINE][i]), f"{self.figures[BASELINE]['mean_cost'][i]:.0f}",
                ]
                for i, name in enumerate(self.study.players)
            ]  # fmt: skip
            header = ["player", "aligned, published", "here", "baseline, published", "here"]
            tables.insert(1, Table("next to what was published: mean costs", header, rows))
        return tables

    @property
    def picture(self) -> str:
        """The picture as a data URL."""
        content = (self.folder / f"{self.study.name}.png").read_bytes()
        return f"data:image/png;base64,{base64.b64encode(content).decode()}"


def render(claims: Sequence[Claim], sections: Sequence[Section], few: int | None) -> str:
    """The page, as HTML.

    Args:
        claims: all claims.
        sections: all studies.
        few: number of runs if these are so few that chance decides some of the claims.
    """
    environment = Environment(
        loader=PackageLoader("gameinfer_ros.experiments.report", "."),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    return environment.get_template("page.html.j2").render(
        claims=claims, sections=sections, few=few
    )
