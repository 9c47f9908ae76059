"""What the robot planner is made of."""
