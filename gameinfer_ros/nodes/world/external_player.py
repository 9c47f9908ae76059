"""External players: a real base, a tracked person, or a player of another simulator."""

from collections.abc import Callable

from nav_msgs.msg import Odometry

from gameinfer_ros.nodes.base.game_node import GameNode
from gameinfer_ros.nodes.base.parameter_node import ParameterError
from gameinfer_ros.nodes.world.track import Sample, Track
from msg_adapters import MessageError, odometry, qos

#: Sources of the time of a measurement: the stamp of the message, or its arrival.
STAMP, ARRIVAL = "stamp", "arrival"

#: Upper limit on every odometry timeout, in s.
OLDEST = 60.0


class ExternalPlayer:
    """A player whose position comes from odometry, at any rate.

    `time_from` is `STAMP` or `ARRIVAL`; `timeout` returns the largest age of a measurement, in s.
    """

    def __init__(
        self, node: GameNode, name: str, time_from: str, timeout: Callable[[], float]
    ) -> None:
        self._node, self._by_stamp, self._timeout = node, time_from == STAMP, timeout
        self._track = Track(2 * OLDEST)
        node.subscribe(Odometry, f"{name}/odom", self._receive, qos.SENSOR, sole=True)

    def _receive(self, message: Odometry, waited: float) -> None:
        nanoseconds, pose, twist = odometry.decode(message)
        time, now, timeout = 1e-9 * nanoseconds, 1e-9 * self._node.now, self._timeout()
        newest = self._track.newest
        if newest is not None and newest.time > now + timeout:
            self._track.clear()  # the clock was set back
        if not self._by_stamp:
            time = now if self._node.get_parameter("use_sim_time").value else now - waited
        elif abs(now - time) > timeout:
            off = "behind" if time < now else "ahead of"
            raise MessageError(
                f"header.stamp: {time:.3f} s is {abs(now - time):.1f} s {off} this node's clock, "
                f"but at most {timeout} s (odom_timeout) is allowed: if the clocks do not agree, "
                f"set odom_time to {ARRIVAL}, or use_sim_time for both"
            )
        self._track.add(Sample(time, pose, twist))

    def at(self, time: float) -> Sample | None:
        """State at a time, in s; None if the newest measurement is too old."""
        age = self.age(time)
        return None if age is None or age > self._timeout() else self._track.at(time)

    def age(self, time: float) -> float | None:
        """Age of the newest measurement at a time, in s; None if there is none."""
        newest = self._track.newest
        return None if newest is None else time - newest.time

    def absence(self, time: float) -> str:
        """Description of why the position at a time, in s, is unknown."""
        age = self.age(time)
        return "no odometry yet" if age is None or age < 0 else f"no odometry for {age:.1f} s"

    def forget(self) -> None:
        """Discard all measurements."""
        self._track.clear()


def external_players(
    node: GameNode, names: str, publish_clock: bool, time_from: str, timeout: Callable[[], float]
) -> dict[int, ExternalPlayer]:
    """Create the external players that the parameter `external` of the simulator names, by index.

    Raises:
        ParameterError: a name is unknown, or external players are not allowed.
    """
    players = node.players.names
    chosen = [name.strip() for name in names.split(",")] if names.strip() else []
    for name in chosen:
        if name not in players:
            raise ParameterError(
                f"external: '{name}' is not allowed: the players are {', '.join(players)}"
            )
    if chosen and node.lockstep:
        raise ParameterError(
            f"external: '{names}' is not allowed with the time lockstep: external players do "
            "not wait for other nodes; set time to realtime"
        )
    if chosen and publish_clock:
        raise ParameterError(
            f"external: '{names}' is not allowed with publish_clock: external players have "
            "their own clock"
        )
    return {players.index(name): ExternalPlayer(node, name, time_from, timeout) for name in chosen}
