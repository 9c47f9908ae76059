"""The page of the report: one self-contained HTML file."""

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
    """A section of the page, about one study."""

    study: Study
    scenario: str  # its name
    folder: Path  # of the results
    figures: Mapping[str, Any]
    alone: str  # the command that runs only this study
    calls: Sequence[Mapping[str, Any]]  # that made the runs, with their dates and machines

    @property
    def title(self) -> str:
        """Heading of the section."""
        return f"{self.study.name.capitalize()}: {self.scenario.replace('_', ' ')}"

    @property
    def tables(self) -> list[Table]:
        """Tables of the study, with one of the published costs if there are any."""
        tables = self.study.tables(self.figures)
        known = published.MEAN_COSTS.get(self.scenario)
        if self.study.name == "planning" and known is not None:
            found = {planner: self.figures[planner]["mean_cost"] for planner in known}
            columns = (known[MAP], found[MAP], known[BASELINE], found[BASELINE])
            rows = [
                [name, *(f"{costs[i]:.0f}" for costs in columns)]
                for i, name in enumerate(self.study.players)
            ]
            header = ["player", "aligned, published", "here", "baseline, published", "here"]
            tables.insert(1, Table("mean costs next to the published ones", header, rows))
        return tables

    @property
    def picture(self) -> str:
        """The figure of the study as a data URL."""
        content = (self.folder / f"{self.study.name}.png").read_bytes()
        return f"data:image/png;base64,{base64.b64encode(content).decode()}"


def render(claims: Sequence[Claim], sections: Sequence[Section], few: int | None) -> str:
    """Render the page as HTML; `few` is the number of runs if claims need more of them."""
    environment = Environment(
        loader=PackageLoader("gameinfer_ros.experiments.report", "."),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    template = environment.get_template("page.html.j2")
    return template.render(claims=claims, sections=sections, few=few)
