"""A table on disk that grows run by run."""

from __future__ import annotations

import csv
import os
from pathlib import Path

from gameinfer_ros.experiments.study.study import Key, Row


class JournalError(ValueError):
    """A file does not hold what a journal would; the message names it and the line."""


class Journal:
    """A CSV file with a row for each run, written as soon as the run has ended.

    What is on disk is complete up to the last whole line, whenever the writer is killed. A line
    that was being written then is dropped by the next one to open the file.

    Args:
        path: the file; it is made with the first row.
        key_columns: columns that say which run a row is of. A later row replaces an earlier one.
        columns: the others.

    Attributes:
        rows: what the file says of each run, as text, by the run's key.

    Raises:
        JournalError: the file has other columns or a broken line.
        OSError: it cannot be read.
    """

    def __init__(self, path: Path, key_columns: tuple[str, ...], columns: tuple[str, ...]) -> None:
        self._path, self._key_columns = path, key_columns
        self._columns = (*key_columns, *columns)
        self.rows: dict[Key, dict[str, str]] = {}
        if path.exists():
            self._read()

    def __contains__(self, key: Key) -> bool:
        """Whether there is a row about the run with this key."""
        return key in self.rows

    def append(self, key: Key, row: Row) -> None:
        """Add what came of a run, here and on disk."""
        values = [*key, *(row[column] for column in self._columns[len(key) :])]
        text = [repr(value) if isinstance(value, float) else str(value) for value in values]
        fresh = not self._path.exists()
        with self._path.open("a", newline="", encoding="utf-8") as file:
            writer = csv.writer(file, lineterminator="\n")
            if fresh:
                writer.writerow(self._columns)
            writer.writerow(text)
        self.rows[key] = dict(zip(self._columns, text, strict=True))

    def sort(self) -> None:
        """Put the rows on disk in the order of their keys, each of them once."""
        self.rows = {key: self.rows[key] for key in sorted(self.rows)}
        draft = self._path.with_suffix(".draft")
        with draft.open("w", newline="", encoding="utf-8") as file:
            writer = csv.writer(file, lineterminator="\n")
            writer.writerow(self._columns)
            writer.writerows(row.values() for row in self.rows.values())
        os.replace(draft, self._path)

    def _read(self) -> None:
        content = self._path.read_bytes()
        whole = content[: content.rfind(b"\n") + 1]
        if len(whole) < len(content):  # the last writer was killed in the middle of a line
            with self._path.open("r+b") as file:
                file.truncate(len(whole))
        if not whole:
            self._path.unlink()
            return
        lines = csv.reader(whole.decode("utf-8").splitlines())
        header = tuple(next(lines))
        if header != self._columns:
            odd = sorted(set(header) ^ set(self._columns))
            raise JournalError(
                f"{self._path}: has other columns than this study; they differ in {odd[:5]}"
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
                    f"{self._path}: line {number} has the seed '{row['seed']}', which is no number"
                ) from None
            self.rows[key] = row
