"""Tables of the figures of a benchmark."""

from collections.abc import Iterable, Iterator, Mapping
from typing import Any

from rich import box
from rich.table import Table

_BY_PLAYERS = ("lq_pass_ms", "lq_pass_mflop", "rollout_ms", "iteration_ms")
_OF_BELIEF = ("first", "median", "p99", "max", "max_after_ten")
_SOLVES = ("cold", "warm", "alone")


def tables(figures: Mapping[str, Any]) -> Iterator[Table]:
    """Format the figures that `gameinfer_ros.experiments.benchmark.bench.measure` returned."""
    about = ("machine", "compile_s", "memory_mb")
    rows = {f"{name} {key}": value for name in about for key, value in figures[name].items()}
    rows |= {name: figures[name] for name in ("dgemm_gflops", "dgemm_speed_up_of_two_threads")}
    yield _table("machine", {name: {"": value} for name, value in rows.items()})
    yield _table("belief, ms per update", figures["belief_step_ms"], _OF_BELIEF)
    for kind, of_kind in (("unicycles", figures), ("flat games", figures["flat"])):
        yield from _tables_of_games(kind, of_kind)


def _tables_of_games(kind: str, figures: Mapping[str, Any]) -> Iterator[Table]:
    growth = figures["growth"]
    passes = {name: figures[name] for name in _BY_PLAYERS}
    passes["update_ms per iteration"] = growth["players"]
    yield _table(f"{kind}: one particle, by players", turned(passes))
    solves = {
        f"{name}, {players} players": solve
        for name in _SOLVES
        for players, solve in figures[name].items()
    }
    yield _table(f"{kind}: one particle solved", solves)
    yield _table(f"{kind}: one iteration, by players", figures["reference"])
    counts = {f"ms, {n} thread(s)": ms for n, ms in growth["particles"].items()}
    yield _table(f"{kind}: update of 3 players, by particles", turned(counts))
    horizon = {"ms per particle and iteration": growth["horizon"]}
    yield _table(f"{kind}: update of 3 players, by steps", turned(horizon))


def turned(table: Mapping[str, Mapping[str, Any]]) -> dict[str, dict[str, Any]]:
    """Transpose a table: its columns become rows."""
    columns = next(iter(table.values()))
    return {column: {name: row[column] for name, row in table.items()} for column in columns}


def _table(title: str, rows: Mapping[str, Mapping[str, Any]], columns: Iterable[str] = ()) -> Table:
    columns = tuple(columns) or tuple(next(iter(rows.values())))
    table = Table(title=title, title_justify="left", box=box.SIMPLE_HEAD, min_width=len(title))
    table.add_column(no_wrap=True)
    for column in columns:
        table.add_column(column.replace("_", " "), justify="right")
    for name, values in rows.items():
        table.add_row(name, *(_shown(values[column]) for column in columns))
    return table


def _shown(value: Any) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)
