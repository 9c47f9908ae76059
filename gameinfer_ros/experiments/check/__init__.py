"""The check that solutions are local equilibria."""
