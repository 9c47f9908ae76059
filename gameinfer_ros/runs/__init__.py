"""Runs: their seeds, the closed loop without ROS, and records with figures and animations."""
