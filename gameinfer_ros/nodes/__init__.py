"""ROS 2 nodes: plumbing around the core. Import each node from its own module."""
