"""Handles a terminal that is closed while the process writes to it."""

import os
import select
import sys


def leave() -> bool:
    """Redirect output to the null device if its terminal is closed; returns whether it is."""
    outputs = [stream.fileno() for stream in (sys.__stdout__, sys.__stderr__) if stream]
    poll = select.poll()
    for output in outputs:
        poll.register(output, 0)
    closed = [output for output, event in poll.poll(0) if event & select.POLLHUP]
    for output in closed:
        null = os.open(os.devnull, os.O_WRONLY)
        os.dup2(null, output)
        os.close(null)
    return bool(closed)
