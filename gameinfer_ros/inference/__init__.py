"""Inference: a belief over the equilibrium that the others play."""

from gameinfer_ros.inference.belief import (
    MOST_PARTICLES,
    NO_PARTICLE,
    Belief,
    BeliefSettings,
    MapEquilibrium,
    check_particles,
)
from gameinfer_ros.inference.observation import GaussianObservation
from gameinfer_ros.inference.seeds import ConstantSeeds, CosineSeeds, SeedDistribution
from gameinfer_ros.inference.transition import predict

__all__ = [
    "MOST_PARTICLES",
    "NO_PARTICLE",
    "Belief",
    "BeliefSettings",
    "ConstantSeeds",
    "CosineSeeds",
    "GaussianObservation",
    "MapEquilibrium",
    "SeedDistribution",
    "check_particles",
    "predict",
]
