"""What the simulator reports about the players in `/diagnostics`."""

from __future__ import annotations

from collections.abc import Sequence

from gameinfer_ros.nodes.world.world import World
from msg_adapters import diagnostics


def absences(world: World, names: Sequence[str]) -> list[str]:
    """The missing external players, each with the reason."""
    return [f"{names[i]} ({why})" for i, why in world.missing.items()]


def missing_odometry(world: World, names: Sequence[str]) -> str:
    """The external players whose odometry is missing, in words; empty if there are none."""
    missing = [names[i] for i in world.missing]
    return f"no odometry of {', '.join(missing)}" if missing else ""


def silent(world: World, names: Sequence[str]) -> list[str]:
    """Simulated players whose input for the present step has not arrived."""
    return [names[i] for i, p in world.simulated.items() if not p.is_ready(world.step)]


def last_step(
    world: World, names: Sequence[str], now: float
) -> tuple[str, dict[str, object], bytes]:
    """Message, values and level of the report on the previous step.

    Args:
        world: the world.
        names: names of all players.
        now: the present time, in s.
    """
    figures: dict[str, object] = {"step": world.step - 1, "late_steps": world.late_steps}
    if world.missing:
        figures["idle"] = missing_odometry(world, names)
    for i, player in world.simulated.items():
        figures[f"{names[i]}/late_steps"] = player.late_steps
        if player.latency_ms is not None:
            figures[f"{names[i]}/latency_ms"] = f"{player.latency_ms:.2f}"
    for i, external in world.external.items():
        age = external.age(now)
        figures[f"{names[i]}/odom_age_s"] = "none" if age is None else f"{age:.3f}"
    troubles = []
    if world.missing:
        troubles.append(f"missing: {'; '.join(absences(world, names))}")
    if world.late:
        troubles.append(f"late: {', '.join(names[i] for i in world.late)}")
    level = diagnostics.WARN if troubles else diagnostics.OK
    return "; ".join(troubles) or "all controls in time", figures, level
