"""The label of a bag: the settings of its run."""

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, fields

from pydantic import TypeAdapter, ValidationError
from typing_extensions import Self

#: Key of the label among the custom data of a bag.
KEY = "gameinfer_ros"
#: Name of the scenario file in the folder of a bag.
SCENARIO_FILE = "scenario.yaml"


@dataclass(frozen=True)
class BagLabel:
    """The settings of a recorded run, and the names of its topics.

    Attributes:
        scenario: name of the scenario.
        planner: kind of planner.
        time: `lockstep` or `realtime`.
        seed: seed of the run.
        particles: number of particles at the start; 0 for that of the scenario.
        external: names of the external players.
        namespace: namespace of all nodes.
        ros_args: further arguments of all nodes after --ros-args.
        topics: name of each topic in the bag, by its relative name.
        lost: number of messages that were published but not recorded, by relative name of the
            topic; empty during the recording.
    """

    scenario: str
    planner: str
    time: str
    seed: int
    particles: int = 0
    external: list[str] = field(default_factory=list)
    namespace: str = "/"
    ros_args: list[str] = field(default_factory=list)
    topics: dict[str, str] = field(default_factory=dict)
    lost: dict[str, int] = field(default_factory=dict)

    @property
    def title(self) -> str:
        """Title of the run."""
        return f"{self.scenario}, planner {self.planner}, seed {self.seed}"

    def encode(self) -> dict[str, str]:
        """Convert the label to custom data of a bag."""
        return {KEY: json.dumps(asdict(self))}

    @classmethod
    def decode(cls, custom_data: Mapping[str, str]) -> Self:
        """Convert the custom data of a bag to its label.

        Raises:
            ValueError: there is no label, or its fields do not match those of this version.
        """
        if KEY not in custom_data:
            raise ValueError(
                f"custom_data: '{KEY}' is missing: it was not written by gameinfer run --record"
            )
        content = json.loads(custom_data[KEY])
        names = {f.name for f in fields(cls)}
        if not isinstance(content, dict) or set(content) != names:
            raise ValueError(
                f"custom_data.{KEY}: {content!r} is not allowed: its fields must be "
                f"{', '.join(sorted(names))}"
            )
        try:
            label = TypeAdapter(cls).validate_python(content)
        except ValidationError as error:
            first = error.errors()[0]
            raise ValueError(
                f"custom_data.{KEY}.{first['loc'][0]}: {first['input']!r} is not allowed: "
                f"{first['msg']}"
            ) from None
        for name in ("seed", "particles"):
            if not 0 <= getattr(label, name) < 2**63:
                raise ValueError(
                    f"custom_data.{KEY}.{name}: {getattr(label, name)} is not allowed: it must be "
                    f"a whole number from 0 to {2**63 - 1}"
                )
        return label


def lost_words(lost: Mapping[str, int]) -> str:
    """Description of the messages that are missing in a bag, from their numbers by topic."""
    counts = ", ".join(f"{count} of {topic}" for topic, count in sorted(lost.items()))
    return f"messages lost while recording: {counts}"
