"""Fixtures of the tests of the page."""

from __future__ import annotations

from page_server import asked, live_run, server
from run_command import start

__all__ = ["asked", "live_run", "server", "start"]
