"""ROS 2 nodes: thin wrappers around the core. Import each node from its own module."""
