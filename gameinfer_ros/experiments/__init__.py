"""Studies and benchmarks of the method; no ROS needed."""
