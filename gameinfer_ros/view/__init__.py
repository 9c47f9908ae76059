"""The live page of a run, and its web server; no ROS needed."""

from gameinfer_ros.view.live_run import LiveRun, Mark, Trajectory
from gameinfer_ros.view.view_server import Answer, ViewServer

__all__ = ["Answer", "LiveRun", "Mark", "Trajectory", "ViewServer"]
