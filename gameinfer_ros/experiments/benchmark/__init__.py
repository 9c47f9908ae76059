"""Benchmarks of solver and belief, without ROS."""
