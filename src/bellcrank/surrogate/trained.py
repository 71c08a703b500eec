"""Trained networks: in memory, and as files that know what they are for.

Weights are safetensors. Their metadata say architecture, view, normalisation and how well the
network did, and carry the whole problem, so that a mask numbered otherwise can be translated.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.errors import InvalidFile, InvalidModel, UnknownName, first_line
from bellcrank.model.storage import write_bytes
from bellcrank.surrogate.backend import autocast, find_device, find_precision, import_torch
from bellcrank.surrogate.identity import METADATA_KEY, Identity, architecture_of, read_identity

if TYPE_CHECKING:
    import os
    from collections.abc import Callable

    import torch
    from numpy.typing import NDArray

    from bellcrank.surrogate.feeding import Feeder

BATCH = {"cpu": 64, "cuda": 4096}
"""Designs that a network looks at in one go: what fits caches, or keeps a GPU busy."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class TrainedModel(Identity):
    """A network that predicts the efficiency of designs on one lattice.

    Parameters
    ----------
    architecture, problem, view, mean, deviation, record
        As in `bellcrank.surrogate.identity.Identity`.
    network
        With its weights, ready to predict.
    """

    network: torch.nn.Module

    def predict(
        self,
        packed: NDArray[np.uint8],
        *,
        device: str = "auto",
        precision: str = "float32",
    ) -> NDArray[np.float64]:
        """Predict efficiencies.

        Parameters
        ----------
        packed : (n, bytes) uint8
            Masks over the beams of `problem`.
        device, precision
            As `bellcrank.surrogate.backend` has them.

        Returns
        -------
        (n,) float64

        Raises
        ------
        InvalidDataset
            If masks have not one bit for each beam.
        InvalidSettings
            If there is no such device or precision.
        """
        from bellcrank.surrogate.feeding import feeder_of

        where = find_device(device)
        network = self.network.to(where)
        exactness = find_precision(precision, where)
        found = run_network(network, feeder_of(self.view, where), packed, exactness)
        return self.efficiencies(found)

    def to_bytes(self) -> bytes:
        """Return the content of a file: weights in safetensors, the rest in its metadata."""
        import_torch()
        from safetensors.torch import save

        tensors = {
            name: value.detach().cpu().contiguous()
            for name, value in self.network.state_dict().items()
        }
        return save(tensors, {METADATA_KEY: json.dumps(self.describe())})

    def write(self, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
        """Write the model, whole or not at all.

        Raises
        ------
        OutputExists, StorageError
        """
        write_bytes(path, self.to_bytes(), overwrite=overwrite)


def batch_of(device: torch.device) -> int:
    """Return how many designs a network on a device looks at in one go."""
    return BATCH.get(device.type, BATCH["cpu"])


def run_network(
    network: torch.nn.Module,
    feeder: Feeder,
    packed: NDArray[np.uint8],
    precision: str,
    tell: Callable[[int, int], None] = lambda _done, _total: None,
) -> NDArray[np.float64]:
    """Return what a network says of designs, batch by batch, without keeping gradients.

    A network in the middle of its training is left as it was found. `tell` is called with how
    many designs it has looked at, of how many.
    """
    import torch

    device = next(network.parameters()).device
    parts = []
    batch = batch_of(device)
    was_training = network.training
    network.eval()
    try:
        with torch.inference_mode(), autocast(device, precision):
            # No design makes an empty batch, so that its masks are looked at too.
            for first in range(0, max(len(packed), 1), batch):
                output = network(feeder.feed(packed[first : first + batch]))
                parts.append(output.float())
                tell(min(first + batch, len(packed)), len(packed))
    finally:
        network.train(was_training)
    joined = torch.cat(parts).cpu()  # once: each time would wait for a GPU
    return np.asarray(joined.numpy(), np.float64)


def read_model(path: str | os.PathLike[str]) -> TrainedModel:
    """Read a trained model.

    Raises
    ------
    InvalidFile
        If there is no such file.
    InvalidModel
        If it is not one of ours, is truncated, or its weights are no numbers or do not fit what
        it says.
    InvalidSettings
        If PyTorch is not installed.
    """
    import_torch()
    from safetensors import SafetensorError
    from safetensors.torch import load

    place = Path(path)
    try:
        content = place.read_bytes()
    except OSError as error:
        raise InvalidFile(f"{path}: cannot be read ({error.strerror})") from None
    try:
        tensors = load(content)
        text = _metadata(content).get(METADATA_KEY)
    except (SafetensorError, ValueError) as error:
        raise InvalidModel(
            f"{path}: not a trained model, or truncated ({first_line(error)})"
        ) from None
    return _rebuild(read_identity(text, str(path)), tensors, str(path))


def _rebuild(identity: Identity, tensors: dict[str, Any], source: str) -> TrainedModel:
    try:
        network = architecture_of(identity.architecture).build(identity.view.shape)
    except UnknownName as error:
        raise InvalidModel(f"{source}: {error}") from None
    try:
        network.load_state_dict(tensors)
    except RuntimeError as error:
        lines = str(error).splitlines()
        raise InvalidModel(
            f"{source}: its weights are not those of {identity.architecture!r} "
            f"({lines[1 if len(lines) > 1 else 0].split(',')[0].strip()})"
        ) from None
    if wrong := [name for name, each in tensors.items() if not each.isfinite().all()]:
        raise InvalidModel(f"{source}: damaged: not all weights in {wrong[0]!r} are numbers")
    network.eval()
    return TrainedModel(**identity.arguments(), network=network)


def _metadata(content: bytes) -> dict[str, str]:
    """Return the metadata in the header of safetensors: eight bytes of length, then JSON."""
    length = int.from_bytes(content[:8], "little")
    header: dict[str, dict[str, str]] = json.loads(content[8 : 8 + length])
    return header.get("__metadata__", {})
