"""Quality of service, by name.

| profile | reliability | durability | depth |
|---|---|---|---|
| `STREAM` | reliable | transient local | 200 |
| `LATEST` | reliable | transient local | 1 |
| `COMMAND` | reliable | volatile | 1 |
| `DIAGNOSTICS` | reliable | volatile | 100 |
| `CLOCK` | best effort | volatile | 1 |

`STREAM` is for what must arrive whole and in order, also at those who join late: joint states and
the belief. `LATEST` is for what only matters in its newest version: controls, strategies,
equilibria, markers. `COMMAND` is for velocities of a real base, which an old one must not move.

Publishers offer the most that a subscriber can ask for (reliable, transient local), so peers that
ask for less, such as best-effort viewers, match as well. A subscriber that only wants the newest
message of a stream asks for `LATEST`.
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
COMMAND = _profile(1)
DIAGNOSTICS = _profile(100)
CLOCK = _profile(1, reliability=ReliabilityPolicy.BEST_EFFORT)
