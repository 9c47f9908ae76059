"""Defaults and limits that commands name before they import what uses them."""

#: Address and port of the page of a run; other machines cannot reach this address.
VIEW_HOST, VIEW_PORT = "127.0.0.1", 8642

#: A node is started again at most this often within this time, in s.
RESPAWN_LIMIT, RESPAWN_WITHIN = 3, 60.0
