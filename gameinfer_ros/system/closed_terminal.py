"""A terminal that is closed while we write to it."""

from __future__ import annotations

import os
import select
import sys


def leave() -> bool:
    """Write to nowhere from now on what would go to a closed terminal, where writing fails.

    Returns:
        Whether there is a closed terminal at the end of our output.
    """
    outputs = [stream.fileno() for stream in (sys.__stdout__, sys.__stderr__) if stream]
    poll = select.poll()
    for output in outputs:
        poll.register(output, 0)
    closed = [output for output, event in poll.poll(0) if event & select.POLLHUP]
    for output in closed:
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, output)
        os.close(nowhere)
    return bool(closed)
