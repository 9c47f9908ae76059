"""Inference: a belief over the equilibria that the humans may play."""

from gameinfer_ros.inference.belief import NO_PARTICLE, Belief, MapEquilibrium
from gameinfer_ros.inference.observation import GaussianObservation
from gameinfer_ros.inference.particles import Particles
from gameinfer_ros.inference.seeds import ConstantSeeds, CosineSeeds, SeedDistribution
from gameinfer_ros.inference.settings import MOST_PARTICLES, BeliefSettings, check_particles
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
    "Particles",
    "SeedDistribution",
    "check_particles",
    "predict",
]
