"""Quality of service profiles.

Publishers of states, inputs and plans offer reliable and transient local, so that they match
subscribers that request less, such as best-effort viewers. A subscriber that needs only the newest
message requests `LATEST`; one that must not lose any requests `queued`.
"""

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


#: Topics of which all messages must arrive in order, even at late subscribers: joint states and
#: beliefs.
STREAM = _profile(200, DurabilityPolicy.TRANSIENT_LOCAL)

#: Topics of which only the newest message matters: controls and the start of a run.
LATEST = _profile(1, DurabilityPolicy.TRANSIENT_LOCAL)

#: The same for long messages: strategies, equilibria and markers. Under load, parts of them get
#: lost, and are sent again only while the publisher stores the message. Also for odometry, so that
#: subscribers that are discovered slightly late receive the first message.
RECENT = _profile(10, DurabilityPolicy.TRANSIENT_LOCAL)

#: Velocity commands. They are not stored, because an old command must not move a base.
COMMAND = _profile(1)

#: Subscriptions to odometry of any base, whatever it offers.
SENSOR = _profile(10, reliability=ReliabilityPolicy.BEST_EFFORT)

#: Statuses. They are stored, so that a recorder that is discovered slightly late receives those of
#: the first steps.
DIAGNOSTICS = _profile(100, DurabilityPolicy.TRANSIENT_LOCAL)

#: Subscriptions to statuses of any node, whatever it offers.
ANY_DIAGNOSTICS = _profile(100)

#: Simulated time.
CLOCK = _profile(1, reliability=ReliabilityPolicy.BEST_EFFORT)

#: Depth of the queue of a subscriber that must not lose messages.
QUEUE = 10_000


def queued(profile: QoSProfile) -> QoSProfile:
    """Profile of a subscriber that must receive all messages of a publisher with `profile`."""
    return _profile(QUEUE, profile.durability, profile.reliability)
