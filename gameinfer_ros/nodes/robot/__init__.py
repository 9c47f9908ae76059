"""Components of the robot planner."""
