"""Networks, by name: what they look at, and how they are built."""

from bellcrank.surrogate.models import mlp, resnet18, resnet50  # noqa: F401  (they register)
from bellcrank.surrogate.models.registry import Architecture, models

__all__ = ["Architecture", "models"]
