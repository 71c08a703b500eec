"""Checkpoints of a training: one safetensors file with all that a resumed training needs.

Tensors are the weights, their moving average and the state of the optimiser; counters, losses
and the log are plain data in the metadata.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from bellcrank.errors import InvalidModel, first_line

if TYPE_CHECKING:
    from pathlib import Path

    import torch

CHECKPOINT = "checkpoint.safetensors"
"""Name of the file in the folder of a training."""
METADATA_KEY = "bellcrank"


@dataclass(frozen=True, slots=True, eq=False)
class TrainingTensors:
    """Objects of a training that have tensors as their state.

    Parameters
    ----------
    network, optimiser
        The network and its optimiser.
    average
        Network with the moving average of the weights; None without averaging.
    """

    network: torch.nn.Module
    optimiser: torch.optim.Optimizer
    average: torch.nn.Module | None

    def to_bytes(self, data: dict[str, Any]) -> bytes:
        """Return the content of a checkpoint file with all tensors and plain data."""
        from safetensors.torch import save

        tensors = {f"network.{k}": v for k, v in self.network.state_dict().items()}
        if self.average is not None:
            tensors |= {f"average.{k}": v for k, v in self.average.state_dict().items()}
        for index, state in self.optimiser.state_dict()["state"].items():
            tensors |= {f"optimiser.{index}.{key}": value for key, value in state.items()}
        on_host = {name: value.detach().cpu().contiguous() for name, value in tensors.items()}
        return save(on_host, {METADATA_KEY: json.dumps(data)})

    def load(self, tensors: dict[str, Any]) -> None:
        """Restore the tensors of a checkpoint."""

        def under(prefix: str) -> dict[str, Any]:
            cut = len(prefix)
            return {name[cut:]: value for name, value in tensors.items() if name.startswith(prefix)}

        self.network.load_state_dict(under("network."))
        if self.average is not None:
            self.average.load_state_dict(under("average."))
        states: dict[int, dict[str, Any]] = {}
        for name, value in under("optimiser.").items():
            index, key = name.split(".", 1)
            states.setdefault(int(index), {})[key] = value
        whole = self.optimiser.state_dict()
        self.optimiser.load_state_dict({**whole, "state": states})


def load_checkpoint(tensors: TrainingTensors, path: Path) -> dict[str, Any]:
    """Restore tensors from a checkpoint file, and return its plain data.

    Raises
    ------
    InvalidModel
        If the file is damaged or belongs to another network; the tensors are then undefined.
    """
    from safetensors import SafetensorError, safe_open

    try:
        with safe_open(path, framework="pt") as file:
            data: dict[str, Any] = json.loads(file.metadata()[METADATA_KEY])
            tensors.load({name: file.get_tensor(name) for name in file.keys()})  # noqa: SIM118
    except (SafetensorError, OSError, RuntimeError, KeyError, TypeError, ValueError) as error:
        raise damaged_checkpoint(path, error) from None
    return data


def damaged_checkpoint(path: Path, error: Exception) -> InvalidModel:
    """Return the error for a damaged checkpoint."""
    return InvalidModel(
        f"{path}: damaged ({first_line(error)}); delete it and resume: the training starts again"
    )
