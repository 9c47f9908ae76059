"""A table on disk that grows run by run, and survives a crash of its writer."""

import csv
import os
from collections.abc import Iterable
from pathlib import Path

from gameinfer_ros.experiments.study.study import Key, Row


class JournalError(ValueError):
    """A file is not a valid journal; the message names the file and the line."""


class Journal:
    """A CSV file with one row per run, written as soon as the run ends.

    If the writer is killed, the file is valid up to its last complete line; the next journal that
    opens the file drops an incomplete line. The `key_columns` identify a run; a later row of the
    same run replaces an earlier one.

    Attributes:
        rows: the row of each run, as text, by the run's key.

    Raises:
        JournalError: the file has other columns or an invalid line.
        OSError: the file cannot be read.
    """

    def __init__(self, path: Path, key_columns: tuple[str, ...], columns: tuple[str, ...]) -> None:
        self._path, self._key_columns = path, key_columns
        self._columns = (*key_columns, *columns)
        self.rows: dict[Key, dict[str, str]] = {}
        if path.exists():
            self._read()

    def append(self, key: Key, row: Row) -> None:
        """Add the row of a run, also on disk."""
        values = [*key, *(row[column] for column in self._columns[len(key) :])]
        text = [repr(value) if isinstance(value, float) else str(value) for value in values]
        header = () if self._path.exists() else (self._columns,)
        _write(self._path, "a", (*header, text))
        self.rows[key] = dict(zip(self._columns, text, strict=True))

    def sort(self) -> None:
        """Rewrite the file with one row per run, ordered by key."""
        self.rows = {key: self.rows[key] for key in sorted(self.rows)}
        draft = self._path.with_suffix(".draft")
        _write(draft, "w", (self._columns, *(row.values() for row in self.rows.values())))
        os.replace(draft, self._path)

    def _read(self) -> None:
        content = self._path.read_bytes()
        whole = content[: content.rfind(b"\n") + 1]
        if len(whole) < len(content):  # the last writer was killed while it wrote a line
            with self._path.open("r+b") as file:
                file.truncate(len(whole))
        if not whole:
            self._path.unlink()
            return
        lines = csv.reader(whole.decode("utf-8").splitlines())
        header = tuple(next(lines))
        if header != self._columns:
            different = sorted(set(header) ^ set(self._columns))
            raise JournalError(
                f"{self._path}: the columns differ from those of this study: {different[:5]}"
            )
        for number, line in enumerate(lines, 2):
            if len(line) != len(header):
                raise JournalError(
                    f"{self._path}: line {number} has {len(line)} values instead of {len(header)}"
                )
            row = dict(zip(header, line, strict=True))
            try:
                key: Key = (int(row["seed"]), *(row[name] for name in self._key_columns[1:]))
            except ValueError:
                raise JournalError(
                    f"{self._path}: line {number}: seed: '{row['seed']}' is not allowed: it must "
                    "be a whole number"
                ) from None
            self.rows[key] = row


def _write(path: Path, mode: str, lines: Iterable[Iterable[str]]) -> None:
    with path.open(mode, newline="", encoding="utf-8") as file:
        csv.writer(file, lineterminator="\n").writerows(lines)
