"""Defaults and limits that commands name before they import slow modules."""

#: Default address and port of the live page. Other machines cannot reach this address.
VIEW_HOST, VIEW_PORT = "127.0.0.1", 8642

#: A node is restarted at most this many times within this time, in s.
RESPAWN_LIMIT, RESPAWN_WITHIN = 3, 60.0
