"""Checkpoints: all that a training needs to go on as if nothing had happened.

One safetensors file holds the weights, their running average and the optimiser's figures; its
metadata hold the counters, the losses and the log.
"""

from __future__ import annotations

import json
from dataclasses import asdict, replace
from typing import TYPE_CHECKING, Any

from bellcrank.errors import InvalidModel, first_line
from bellcrank.surrogate.progress import EpochRecord, LossMeter

if TYPE_CHECKING:
    from pathlib import Path

    from bellcrank.surrogate.training import Training

METADATA_KEY = "bellcrank"


def checkpoint_bytes(training: Training) -> bytes:
    """Return the content of a checkpoint."""
    from safetensors.torch import save

    tensors = {f"network.{k}": v for k, v in training.model.network.state_dict().items()}
    if training.average is not None:
        tensors |= {f"average.{k}": v for k, v in training.average.state_dict().items()}
    for index, state in training.optimiser.state_dict()["state"].items():
        tensors |= {f"optimiser.{index}.{key}": value for key, value in state.items()}
    told = {
        "step": training.step,
        "seconds": training.seconds,
        "mean": training.model.mean,
        "deviation": training.model.deviation,
        **training.losses.to_dict(),
        "log": [asdict(epoch) for epoch in training.log],
    }
    on_host = {name: value.detach().cpu().contiguous() for name, value in tensors.items()}
    return save(on_host, {METADATA_KEY: json.dumps(told)})


def restore(training: Training, path: Path) -> None:
    """Bring a training that was just built to where a checkpoint says.

    Raises
    ------
    InvalidModel
        If the checkpoint is damaged, or of another network; the training is of no use then.
    """
    from safetensors import SafetensorError, safe_open

    try:
        with safe_open(path, framework="pt") as file:
            told = json.loads(file.metadata()[METADATA_KEY])
            tensors = {name: file.get_tensor(name) for name in file.keys()}  # noqa: SIM118
        _load(training, tensors)
        training.step, training.seconds = int(told["step"]), float(told["seconds"])
        training.model = replace(
            training.model,
            mean=float(told.get("mean", training.model.mean)),
            deviation=float(told.get("deviation", training.model.deviation)),
        )
        training.losses = LossMeter.from_dict(told)
        training.log = [EpochRecord(**epoch) for epoch in told["log"]]
    except (SafetensorError, OSError, RuntimeError, KeyError, TypeError, ValueError) as error:
        reason = first_line(error)
        raise InvalidModel(
            f"{path}: damaged ({reason}); delete it and resume: training begins again"
        ) from None


def _load(training: Training, tensors: dict[str, Any]) -> None:
    def under(prefix: str) -> dict[str, Any]:
        cut = len(prefix)
        return {name[cut:]: value for name, value in tensors.items() if name.startswith(prefix)}

    training.model.network.load_state_dict(under("network."))
    if training.average is not None:
        training.average.load_state_dict(under("average."))
    states: dict[int, dict[str, Any]] = {}
    for name, value in under("optimiser.").items():
        index, key = name.split(".", 1)
        states.setdefault(int(index), {})[key] = value
    whole = training.optimiser.state_dict()
    training.optimiser.load_state_dict({**whole, "state": states})
