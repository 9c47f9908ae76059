"""The study of planning: does it pay to align with the equilibrium that others play?"""
