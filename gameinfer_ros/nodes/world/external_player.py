"""External players: a real base, a tracked person, or a player of another simulator."""

from __future__ import annotations

from collections.abc import Sequence

from nav_msgs.msg import Odometry

from gameinfer_ros.nodes.base.parameter_node import ParameterError
from gameinfer_ros.nodes.world.track import Sample, Track
from msg_adapters import MessageError, odometry

#: Sources of the time of a measurement: the stamp of the message, or its arrival.
STAMP, ARRIVAL = "stamp", "arrival"

#: Upper limit on every odometry timeout, in s.
OLDEST = 60.0


def parse_names(
    parameter: str, players: Sequence[str], lockstep: bool, publish_clock: bool
) -> list[str]:
    """Names of the external players in the parameter `external` of the simulator.

    Args:
        parameter: its value.
        players: names of all players.
        lockstep: whether each step waits for the inputs of all players.
        publish_clock: whether the simulator publishes `/clock`.

    Raises:
        ParameterError: a name is unknown, or external players are not allowed.
    """
    names = [name.strip() for name in parameter.split(",")] if parameter.strip() else []
    for name in names:
        if name not in players:
            raise ParameterError(
                f"external: '{name}' is not allowed: the players are {', '.join(players)}"
            )
    if names and lockstep:
        raise ParameterError(
            f"external: '{parameter}' is not allowed with the time lockstep: external players do "
            "not wait for other nodes; set time to realtime"
        )
    if names and publish_clock:
        raise ParameterError(
            f"external: '{parameter}' is not allowed with publish_clock: external players have "
            "their own clock"
        )
    return names


class ExternalPlayer:
    """A player whose position comes from odometry, at any rate.

    Args:
        time_from: source of the time of a measurement, `STAMP` or `ARRIVAL`.
    """

    def __init__(self, time_from: str) -> None:
        self._by_stamp = time_from == STAMP
        self._track = Track(2 * OLDEST)

    def receive(self, message: Odometry, arrival: float, now: float, timeout: float) -> None:
        """Add a measurement.

        Args:
            message: the measurement.
            arrival: its time of arrival, in s.
            now: the present time, in s.
            timeout: largest difference between its stamp and the present time, in s.

        Raises:
            MessageError: the message is invalid, or its stamp differs by more than `timeout`.
        """
        nanoseconds, pose, twist = odometry.decode(message)
        time = 1e-9 * nanoseconds
        newest = self._track.newest
        if newest is not None and newest.time > now + timeout:
            self._track.clear()  # the clock was set back
        if not self._by_stamp:
            time = arrival
        elif abs(now - time) > timeout:
            off = "behind" if time < now else "ahead of"
            raise MessageError(
                f"header.stamp: {time:.3f} s is {abs(now - time):.1f} s {off} this node's clock, "
                f"but at most {timeout} s (odom_timeout) is allowed: if the clocks do not agree, "
                f"set odom_time to {ARRIVAL}, or use_sim_time for both"
            )
        self._track.add(Sample(time, pose, twist))

    def at(self, time: float, timeout: float) -> Sample | None:
        """State at a time, in s; None if the newest measurement is older than `timeout`, in s."""
        newest = self._track.newest
        if newest is None or time - newest.time > timeout:
            return None
        return self._track.at(time)

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
