"""Benchmarks of the solver and the belief; no ROS needed."""
