"""A player that somebody else moves: a real base, a person that is tracked, another simulator."""

from __future__ import annotations

from nav_msgs.msg import Odometry

from gameinfer_ros.nodes.world.track import Sample, Track
from msg_adapters import MessageError, odometry

#: Where the time of a measurement comes from.
STAMP, ARRIVAL = "stamp", "arrival"

#: How old a measurement may be at most, whatever is asked for, in s; so long they are kept.
OLDEST = 60.0


class ExternalPlayer:
    """Knows where a player is from odometry, which comes at a rate of its own.

    Args:
        time_from: whether a measurement is of the time of its stamp, or of its arrival.
    """

    def __init__(self, time_from: str) -> None:
        self._by_stamp = time_from == STAMP
        self._track = Track(2 * OLDEST)

    def receive(self, message: Odometry, arrival: float, now: float, timeout: float) -> None:
        """Take in a measurement.

        Args:
            message: the measurement.
            arrival: when it arrived, in s.
            now: the time now, in s.
            timeout: how far its stamp may be off, in s.

        Raises:
            MessageError: it cannot be used, or its stamp is off.
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
                f"and {timeout} s (odom_timeout) are allowed: if the two clocks do not agree, set "
                f"odom_time to {ARRIVAL}, or use_sim_time for both"
            )
        self._track.add(Sample(time, pose, twist))

    def at(self, time: float, timeout: float) -> Sample | None:
        """Where the player is at a time; None if that is not known to within `timeout` s."""
        newest = self._track.newest
        if newest is None or time - newest.time > timeout:
            return None
        return self._track.at(time)

    def age(self, time: float) -> float | None:
        """How old the newest measurement is at a time, in s; None if there is none."""
        newest = self._track.newest
        return None if newest is None else time - newest.time

    def absence(self, time: float) -> str:
        """In words, why nobody knows where the player is."""
        age = self.age(time)
        return "no odometry yet" if age is None or age < 0 else f"no odometry for {age:.1f} s"

    def forget(self) -> None:
        """Forget all measurements: their clock has begun anew."""
        self._track.clear()
