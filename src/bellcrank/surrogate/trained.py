"""Trained networks: in memory, and as files that know what they are for.

Weights are safetensors. Their metadata say architecture, view, normalisation and how well the
network did, and carry the whole problem, so that a mask numbered otherwise can be translated.
"""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.errors import InvalidFile, InvalidModel
from bellcrank.model import problem_from_dict, problem_to_dict
from bellcrank.model.storage import write_bytes
from bellcrank.surrogate.backend import autocast, find_device, import_torch
from bellcrank.surrogate.models import models
from bellcrank.surrogate.views import views

if TYPE_CHECKING:
    import os

    import torch
    from numpy.typing import NDArray

    from bellcrank.model import Lattice, Problem
    from bellcrank.surrogate.feeding import Feeder
    from bellcrank.surrogate.views import View

MODEL_SCHEMA = "bellcrank/model/1"
METADATA_KEY = "bellcrank"
BATCH = 256
"""Designs that a network looks at in one go."""
DIGITS = 6
"""Of positions, in a lattice's hash."""


def lattice_hash(lattice: Lattice) -> str:
    """Return the identity of a lattice: its nodes and beams in their order.

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


@dataclass(frozen=True, slots=True, eq=False)
class TrainedModel:
    """A network that predicts the efficiency of designs on one lattice.

    Parameters
    ----------
    architecture
        Name in the registry of models.
    problem
        What it has learnt.
    view
        What it looks at.
    network
        With its weights, ready to predict.
    mean, deviation
        Of the efficiencies that it was trained with; the network's output is in units of
        the latter, from the former.
    record
        How it was trained and how well it does, as plain data.
    """

    architecture: str
    problem: Problem
    view: View
    network: torch.nn.Module
    mean: float
    deviation: float
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
            As `bellcrank.surrogate.backend` has them.

        Returns
        -------
        (n,) float64
        """
        from bellcrank.surrogate.feeding import feeder_of

        where = find_device(device)
        network = self.network.to(where).eval()
        found = run_network(network, feeder_of(self.view, where), packed, precision)
        return self.mean + self.deviation * found

    def to_bytes(self) -> bytes:
        """Return the content of a file: weights in safetensors, the rest in its metadata."""
        import_torch()
        from safetensors.torch import save

        told = {
            "schema": MODEL_SCHEMA,
            "architecture": self.architecture,
            "lattice": lattice_hash(self.problem.lattice),
            "view": self.view.to_dict(),
            "mean": self.mean,
            "deviation": self.deviation,
            "record": self.record,
            "problem": problem_to_dict(self.problem),
        }
        tensors = {
            name: value.detach().cpu().contiguous()
            for name, value in self.network.state_dict().items()
        }
        return save(tensors, {METADATA_KEY: json.dumps(told)})

    def write(self, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
        """Write the model, whole or not at all.

        Raises
        ------
        OutputExists, StorageError
        """
        write_bytes(path, self.to_bytes(), overwrite=overwrite)


def run_network(
    network: torch.nn.Module, feeder: Feeder, packed: NDArray[np.uint8], precision: str
) -> NDArray[np.float64]:
    """Return what a network says of designs, batch by batch, without keeping gradients."""
    import torch

    device = next(network.parameters()).device
    parts = []
    with torch.inference_mode(), autocast(device, precision):
        for first in range(0, len(packed), BATCH):
            output = network(feeder.feed(packed[first : first + BATCH]))
            parts.append(output.float().cpu())
    joined = torch.cat(parts) if parts else torch.empty(0)
    return np.asarray(joined.numpy(), np.float64)


def read_model(path: str | os.PathLike[str]) -> TrainedModel:
    """Read a trained model.

    Raises
    ------
    InvalidFile
        If there is no such file.
    InvalidModel
        If it is not one of ours, is truncated, or its weights do not fit what it says.
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
        told = json.loads(_metadata(content)[METADATA_KEY])
    except (SafetensorError, ValueError, KeyError) as error:
        raise InvalidModel(
            f"{path}: not a trained model of bellcrank, or truncated ({_first_line(error)})"
        ) from None
    if told.get("schema") != MODEL_SCHEMA:
        raise InvalidModel(f"{path}: expected schema {MODEL_SCHEMA!r}, got {told.get('schema')!r}")
    return _rebuild(told, tensors, str(path))


def _rebuild(told: dict[str, Any], tensors: dict[str, Any], source: str) -> TrainedModel:
    problem = problem_from_dict(told["problem"], source)
    if lattice_hash(problem.lattice) != told["lattice"]:
        raise InvalidModel(f"{source}: the lattice in it is not the one that it was trained on")
    architecture = models[told["architecture"]]
    view = views[architecture.view](problem, **told["view"])
    network = architecture.build(view.shape)
    try:
        network.load_state_dict(tensors)
    except RuntimeError as error:
        lines = str(error).splitlines()
        raise InvalidModel(
            f"{source}: its weights are not those of {told['architecture']!r} "
            f"({lines[1 if len(lines) > 1 else 0].strip()})"
        ) from None
    network.eval()
    return TrainedModel(
        told["architecture"], problem, view, network, float(told["mean"]),
        float(told["deviation"]), told["record"],
    )  # fmt: skip


def _metadata(content: bytes) -> dict[str, str]:
    """Return the metadata in the header of safetensors: eight bytes of length, then JSON."""
    length = int.from_bytes(content[:8], "little")
    header: dict[str, dict[str, str]] = json.loads(content[8 : 8 + length])
    return header["__metadata__"]


def _first_line(error: BaseException) -> str:
    return (str(error).strip() or repr(error)).splitlines()[0]
