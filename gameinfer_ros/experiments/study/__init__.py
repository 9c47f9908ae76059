"""What all studies share: independent runs, played by workers and stored one by one."""

from gameinfer_ros.experiments.study import statistics
from gameinfer_ros.experiments.study.study import FailedRunError, Key, Row, Rows, Study, numbers
from gameinfer_ros.experiments.study.table import Table, metres, milliseconds

__all__ = [
    "FailedRunError",
    "Key",
    "Row",
    "Rows",
    "Study",
    "Table",
    "metres",
    "milliseconds",
    "numbers",
    "statistics",
]
