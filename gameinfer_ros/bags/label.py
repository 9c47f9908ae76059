"""What a bag says of the run that it holds."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, fields

from pydantic import TypeAdapter, ValidationError
from typing_extensions import Self

#: Key of the label among the custom data of a bag.
KEY = "gameinfer_ros"
#: File beside the messages: the scenario as it was played.
SCENARIO_FILE = "scenario.yaml"


@dataclass(frozen=True)
class BagLabel:
    """How the run of a bag was started, and what its topics are called there.

    Attributes:
        scenario: name of the scenario.
        planner: what the robot did with the belief.
        time: lockstep or realtime.
        seed: all random numbers of the run came of it.
        particles: at the start; 0 for as many as the scenario says.
        external: names of the players that somebody else moved.
        namespace: of all nodes.
        ros_args: further arguments that every node got behind --ros-args.
        topics: name in the bag of each topic, by its relative name.
        lost: how many messages were published but not recorded, by the same; none while the
            recording goes on.
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

    def encode(self) -> dict[str, str]:
        """Custom data of a bag with this label."""
        return {KEY: json.dumps(asdict(self))}

    @classmethod
    def decode(cls, custom_data: Mapping[str, str]) -> Self:
        """The label among the custom data of a bag.

        Raises:
            ValueError: there is none, or it is of another version of this package.
        """
        if KEY not in custom_data:
            raise ValueError(
                f"custom_data: has no '{KEY}': it is no bag that gameinfer run --record wrote"
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
                    "a whole number from 0 on that has 63 bits"
                )
        return label


def lost_words(lost: Mapping[str, int]) -> str:
    """Say what is missing in a bag: numbers of messages by topic."""
    counts = ", ".join(f"{count} of {topic}" for topic, count in sorted(lost.items()))
    return f"messages that did not arrive to be recorded: {counts}"
