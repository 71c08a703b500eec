"""Acceptance rule and costs of Markov chains, used by Python code and compiled for the kernel."""

from __future__ import annotations

import math


def metropolis_accepts(log_ratio: float, uniform: float) -> bool:
    """Whether to accept a proposal, with probability min(1, exp(log_ratio)).

    Parameters
    ----------
    log_ratio
        Logarithm of the ratio of probabilities (Metropolis et al. 1953), times the ratio of the
        proposal probabilities where these differ (Hastings, Biometrika 57, 97, 1970).
    uniform
        Random number in [0, 1).
    """
    return log_ratio >= 0.0 or uniform < math.exp(log_ratio)


def exponential_cost(efficiency: float) -> float:
    """Return exp(-efficiency)."""
    return math.exp(-efficiency)


def negative_cost(efficiency: float) -> float:
    """Return -efficiency."""
    return -efficiency
