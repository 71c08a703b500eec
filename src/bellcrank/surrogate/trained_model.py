"""Trained networks in memory and in files.

A file holds the weights as safetensors. Its metadata hold architecture, view, normalisation,
accuracy and the whole problem, so that masks of a differently numbered lattice can be translated.
"""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.errors import BellcrankError, InvalidFile, InvalidModel, UnknownName, first_line
from bellcrank.model import problem_from_dict, problem_to_dict
from bellcrank.model.storage import write_bytes
from bellcrank.surrogate.backend import autocast, find_device, find_precision, import_torch
from bellcrank.surrogate.views import views

if TYPE_CHECKING:
    import os
    from collections.abc import Callable

    import torch
    from numpy.typing import NDArray

    from bellcrank.model import Lattice, Problem
    from bellcrank.surrogate.models import Architecture
    from bellcrank.surrogate.views import View

MODEL = "model.safetensors"
"""Name of the file in the folder of a training."""
MODEL_SCHEMA = "bellcrank/model/1"
METADATA_KEY = "bellcrank"
DIGITS = 6
"""Decimal places of positions in the hash of a lattice."""
BATCH = {"cpu": 64, "cuda": 4096}
"""Designs in one evaluation of a network: fits caches, or occupies a GPU."""


def lattice_hash(lattice: Lattice) -> str:
    """Return a hash of the nodes and beams of a lattice in their order.

    Examples
    --------
    >>> from bellcrank.model import find_problem
    >>> crane, other = find_problem("crane"), find_problem("anti-parallel")
    >>> lattice_hash(crane.lattice) == lattice_hash(other.lattice)
    True
    """
    digest = hashlib.sha256()
    digest.update(np.round(lattice.positions, DIGITS).astype("<f8").tobytes())
    digest.update(lattice.beams.astype("<i8").tobytes())
    return digest.hexdigest()[:16]


def architecture_of(name: str) -> Architecture:
    """Return a registered architecture.

    The registry needs PyTorch and is imported here, after a check that PyTorch is installed.

    Raises
    ------
    UnknownName
        If there is no architecture of that name.
    InvalidSettings
        If PyTorch is not installed.
    """
    import_torch()
    from bellcrank.surrogate.models import models

    return models[name]


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class TrainedModel:
    """A network that predicts the efficiency of designs on one lattice.

    Parameters
    ----------
    architecture
        Name in the registry of models.
    problem
        The problem that it was trained on.
    view
        Input of the network.
    mean, deviation
        Mean and standard deviation of the efficiencies in the training set: an output y of the
        network is the efficiency mean + deviation * y.
    network
        PyTorch module with its weights.
    record
        How it was trained, and its accuracy, as plain data.
    """

    architecture: str
    problem: Problem
    view: View
    mean: float
    deviation: float
    network: torch.nn.Module
    record: dict[str, Any] = field(default_factory=dict)

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
            See `bellcrank.surrogate.backend`.

        Returns
        -------
        (n,) float64

        Raises
        ------
        InvalidDataset
            If the masks have the wrong number of bits.
        InvalidSettings
            If the device or precision is not available.
        """
        where = find_device(device)
        chosen = find_precision(precision, where)
        output = run_network(
            self.network.to(where), self.view.arrays, packed, self.view.scale, chosen
        )
        return self.efficiencies(output)

    def efficiencies(self, output: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the efficiencies (n,) for outputs (n,) of the network."""
        return self.mean + self.deviation * output

    def describe(self) -> dict[str, Any]:
        """Return the metadata of the file as plain data."""
        return {
            "schema": MODEL_SCHEMA,
            "architecture": self.architecture,
            "lattice": lattice_hash(self.problem.lattice),
            "looks_at": architecture_of(self.architecture).view,
            "view": self.view.to_dict(),
            "mean": self.mean,
            "deviation": self.deviation,
            "record": self.record,
            "problem": problem_to_dict(self.problem),
        }

    def to_bytes(self) -> bytes:
        """Return the content of a file: weights as safetensors with metadata."""
        import_torch()
        from safetensors.torch import save

        tensors = {
            name: value.detach().cpu().contiguous()
            for name, value in self.network.state_dict().items()
        }
        return save(tensors, {METADATA_KEY: json.dumps(self.describe())})

    def write(self, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
        """Write the file, whole or not at all.

        Raises
        ------
        OutputExists, StorageError
        """
        write_bytes(path, self.to_bytes(), overwrite=overwrite)


def inputs_of(arrays: NDArray[np.uint8], scale: float, device: torch.device) -> torch.Tensor:
    """Transfer arrays of bytes to a device, and return them times `scale` as a float batch."""
    import torch

    batch = torch.from_numpy(arrays).to(device).float().mul_(scale)
    return batch.contiguous(memory_format=torch.channels_last) if batch.dim() == 4 else batch


def run_network(
    network: torch.nn.Module,
    arrays_of: Callable[[NDArray[np.uint8]], NDArray[np.uint8]],
    designs: NDArray[np.uint8],
    scale: float,
    precision: str,
    report: Callable[[int, int], None] = lambda _done, _total: None,
) -> NDArray[np.float64]:
    """Return the outputs of a network for n designs, batch by batch, without gradients.

    The mode of the network (training or evaluation) is restored.

    Parameters
    ----------
    arrays_of
        Function from a batch of `designs` to the inputs as bytes, such as `View.arrays`.
    designs : (n, ...)
        Packed masks, or whatever `arrays_of` takes.
    scale
        Factor from bytes to inputs.
    precision
        ``float32`` or ``bfloat16``.
    report
        Called with the number of finished designs and their total.

    Returns
    -------
    (n,) float64
    """
    import torch

    device = next(network.parameters()).device
    parts = []
    batch = BATCH.get(device.type, BATCH["cpu"])
    was_training = network.training
    network.eval()
    try:
        with torch.inference_mode(), autocast(device, precision):
            # No designs make one empty batch, so that the shape of the masks is checked.
            for first in range(0, max(len(designs), 1), batch):
                arrays = arrays_of(designs[first : first + batch])
                output = network(inputs_of(arrays, scale, device))
                parts.append(output.float())
                report(min(first + batch, len(designs)), len(designs))
    finally:
        network.train(was_training)
    joined = torch.cat(parts).cpu()  # one transfer: each waits for the GPU
    return np.asarray(joined.numpy(), np.float64)


def read_model(path: str | os.PathLike[str]) -> TrainedModel:
    """Read a trained network.

    Raises
    ------
    InvalidFile
        If the file cannot be read.
    InvalidModel
        If it is not a model of bellcrank, is truncated, or its weights are not finite or do not
        match its metadata.
    InvalidSettings
        If PyTorch is not installed.
    """
    import_torch()
    from safetensors import SafetensorError
    from safetensors.torch import load

    try:
        content = Path(path).read_bytes()
    except OSError as error:
        raise InvalidFile(f"{path}: cannot be read ({error.strerror})") from None
    try:
        tensors = load(content)
        text = _metadata(content).get(METADATA_KEY)
    except (SafetensorError, ValueError) as error:
        raise InvalidModel(
            f"{path}: not a trained model, or truncated ({first_line(error)})"
        ) from None
    if text is None:
        raise InvalidModel(f"{path}: not a model of bellcrank: no metadata {METADATA_KEY!r}")
    return _rebuild(text, tensors, str(path))


def _rebuild(text: str, tensors: dict[str, Any], source: str) -> TrainedModel:
    """Build the network that metadata describe, and load its weights."""
    try:
        data = json.loads(text)
        if data["schema"] != MODEL_SCHEMA:
            raise InvalidModel(f"expected schema {MODEL_SCHEMA!r}, got {data['schema']!r}")
        problem = problem_from_dict(data["problem"], source)
        architecture = architecture_of(data["architecture"])
        view = views[data["looks_at"]](problem, **data["view"])
        mean, deviation = float(data["mean"]), float(data["deviation"])
        record, lattice = dict(data["record"]), data["lattice"]
    except (BellcrankError, UnknownName) as error:
        raise InvalidModel(f"{source}: {error}") from None
    except (ValueError, KeyError, TypeError) as error:
        raise InvalidModel(f"{source}: damaged metadata ({error!r})") from None
    if lattice_hash(problem.lattice) != lattice:
        raise InvalidModel(f"{source}: the lattice does not match its hash {lattice}")
    if not (np.isfinite(mean) and 0.0 < deviation < np.inf):
        raise InvalidModel(
            f"{source}: expected a finite mean and a positive deviation, got {mean} and {deviation}"
        )
    network = architecture.build(view.shape)
    try:
        network.load_state_dict(tensors)
    except RuntimeError as error:
        lines = str(error).splitlines()
        raise InvalidModel(
            f"{source}: its weights are not those of {data['architecture']!r} "
            f"({lines[1 if len(lines) > 1 else 0].split(',')[0].strip()})"
        ) from None
    if wrong := [name for name, each in tensors.items() if not each.isfinite().all()]:
        raise InvalidModel(f"{source}: damaged: weights in {wrong[0]!r} are not finite")
    network.eval()
    return TrainedModel(
        architecture=data["architecture"], problem=problem, view=view, mean=mean,
        deviation=deviation, network=network, record=record,
    )  # fmt: skip


def _metadata(content: bytes) -> dict[str, str]:
    """Return the metadata in the header of safetensors: eight bytes of length, then JSON."""
    length = int.from_bytes(content[:8], "little")
    header: dict[str, dict[str, str]] = json.loads(content[8 : 8 + length])
    return header.get("__metadata__", {})
