"""Components of the simulator."""
