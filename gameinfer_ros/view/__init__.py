"""A page that shows a run while it goes on; needs no ROS."""

from gameinfer_ros.view.answer import Answer
from gameinfer_ros.view.live_run import LiveRun, Mark, Trajectory
from gameinfer_ros.view.view_server import ViewServer

__all__ = ["Answer", "LiveRun", "Mark", "Trajectory", "ViewServer"]
