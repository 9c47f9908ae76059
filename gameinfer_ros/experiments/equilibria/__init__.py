"""The study of equilibria: how many clusters a game has, and their trajectories."""
