"""Bags of recorded runs, readable without ROS."""
