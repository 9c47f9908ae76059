"""Quality of service, by name.

| profile | reliability | durability | depth |
|---|---|---|---|
| `STREAM` | reliable | transient local | 200 |
| `LATEST` | reliable | transient local | 1 |
| `RECENT` | reliable | transient local | 10 |
| `COMMAND` | reliable | volatile | 1 |
| `SENSOR` | best effort | volatile | 10 |
| `DIAGNOSTICS` | reliable | volatile | 100 |
| `CLOCK` | best effort | volatile | 1 |

`STREAM` is for what must arrive whole and in order, also at those who join late: joint states and
the belief. `LATEST` is for what only matters in its newest version: controls.
`RECENT` is for publishers of the same kind whose messages are long, strategies, equilibria and
markers: parts of them get lost under load, and are sent again as long as the message is kept. It is
for odometry as well, of which those who are found a moment late want the first message.
`COMMAND` is for velocities of a real base, which an old one must not move. `SENSOR` is what is
asked for of others: odometry of any base, whatever it offers.

Publishers offer the most that a subscriber can ask for (reliable, transient local), so peers that
ask for less, such as best-effort viewers, match as well. A subscriber that only wants the newest
message asks for `LATEST`; one that must not lose any, for `queued`.
"""

from __future__ import annotations

from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy


def _profile(
    depth: int,
    durability: DurabilityPolicy = DurabilityPolicy.VOLATILE,
    reliability: ReliabilityPolicy = ReliabilityPolicy.RELIABLE,
) -> QoSProfile:
    return QoSProfile(
        history=HistoryPolicy.KEEP_LAST,
        depth=depth,
        reliability=reliability,
        durability=durability,
    )


STREAM = _profile(200, DurabilityPolicy.TRANSIENT_LOCAL)
LATEST = _profile(1, DurabilityPolicy.TRANSIENT_LOCAL)
RECENT = _profile(10, DurabilityPolicy.TRANSIENT_LOCAL)
COMMAND = _profile(1)
SENSOR = _profile(10, reliability=ReliabilityPolicy.BEST_EFFORT)
DIAGNOSTICS = _profile(100)
CLOCK = _profile(1, reliability=ReliabilityPolicy.BEST_EFFORT)

#: Messages that wait for a subscriber that must not lose any.
QUEUE = 10_000


def queued(profile: QoSProfile) -> QoSProfile:
    """What a subscriber asks for that wants all messages of a publisher with this profile."""
    return _profile(QUEUE, profile.durability, profile.reliability)
