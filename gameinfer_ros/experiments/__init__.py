"""Studies of what the method does, without ROS."""
