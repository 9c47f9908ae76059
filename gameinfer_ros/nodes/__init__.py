"""ROS 2 nodes: thin wrappers around the core. Import each node from its own module."""

import signal
import sys

# For `python -m gameinfer_ros.nodes.NAME`, whose arguments Python sets after this import. Until the
# node handles signals, Ctrl-C ends the process: it raises no exception, because a library that is
# being imported may turn that into another error.
_starts = sys.argv[:1] == ["-m"] and any(word.startswith(f"{__name__}.") for word in sys.orig_argv)
if _starts and signal.getsignal(signal.SIGINT) is signal.default_int_handler:
    signal.signal(signal.SIGINT, signal.SIG_DFL)
