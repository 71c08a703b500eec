"""Trained networks as ONNX: for other programs, and as a faster way to predict on a processor.

The file holds the network and, under the key ``bellcrank`` of its metadata, the same JSON as
the safetensors file of the model: what it looks at, the problem it is for, mean and deviation.
Its input ``design`` is a float batch (n, *shape) of any n, with ink between 0 and 1 for
pictures; its output ``efficiency`` (n,) is in units of the deviation, from the mean.

Examples
--------
>>> from bellcrank.model import find_problem
>>> from bellcrank.surrogate.predictor import Predictor
>>> fast = read_onnx("crane.onnx")  # doctest: +SKIP
>>> Predictor(find_problem("crane"), [fast])  # doctest: +SKIP
"""

from __future__ import annotations

import contextlib
import json
import logging
import os
import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.errors import InvalidFile, InvalidModel, InvalidSettings, first_line
from bellcrank.model.storage import write_bytes
from bellcrank.surrogate.identity import METADATA_KEY, Identity, read_identity

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from bellcrank.surrogate.trained import TrainedModel

INSTALL = "pip install 'bellcrank[onnx]'"
INPUT, OUTPUT = "design", "efficiency"
BATCH = 64
"""Designs that a network looks at in one go: more only leave the processor's caches."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class OnnxModel(Identity):
    """A network in ONNX Runtime; takes the place of a `TrainedModel` wherever one predicts.

    Parameters
    ----------
    architecture, problem, view, mean, deviation, record
        As in `bellcrank.surrogate.identity.Identity`.
    session
        Of ONNX Runtime.
    """

    session: Any

    def predict(
        self, packed: NDArray[np.uint8], *, device: str = "auto", precision: str = "float32"
    ) -> NDArray[np.float64]:
        """Predict efficiencies as `TrainedModel.predict` does, but only on the processor.

        Raises
        ------
        InvalidDataset
            If masks have not one bit for each beam.
        InvalidSettings
            If another device, or another precision than float32, is asked for.
        """
        if device not in ("auto", "cpu") or precision not in ("auto", "float32"):
            raise InvalidSettings(
                f"ONNX Runtime computes on the cpu in float32 here; got {device}, {precision}"
            )
        parts = []
        # No design makes an empty batch, so that its masks are looked at too.
        for first in range(0, max(len(packed), 1), BATCH):
            seen = self.view.look(packed[first : first + BATCH])
            if len(seen):
                inputs = seen.astype(np.float32) * np.float32(self.view.scale)
                parts.append(self.session.run([OUTPUT], {INPUT: inputs})[0])
        found = np.concatenate(parts) if parts else np.empty(0)
        return self.efficiencies(found.astype(np.float64))


def onnx_bytes(model: TrainedModel) -> bytes:
    """Return the content of an ONNX file; takes some seconds.

    Raises
    ------
    InvalidSettings
        If PyTorch or ONNX is not installed.
    """
    from bellcrank.surrogate.backend import import_torch

    torch = import_torch()
    _import("onnx")
    _import("onnxscript")
    network = model.network.cpu().eval()
    # Of two, not one: a batch of one would be taken for a constant.
    example = torch.zeros(2, *model.view.shape)
    with _quiet():
        program = torch.onnx.export(
            network, (example,), dynamo=True, verbose=False, input_names=[INPUT],
            output_names=[OUTPUT], dynamic_shapes=({0: torch.export.Dim("batch")},),
        )  # fmt: skip
    written = program.model_proto
    entry = written.metadata_props.add()
    entry.key, entry.value = METADATA_KEY, json.dumps(model.describe())
    content: bytes = written.SerializeToString()
    return content


def write_onnx(
    model: TrainedModel, path: str | os.PathLike[str], *, overwrite: bool = False
) -> None:
    """Write a model as ONNX, whole or not at all.

    Raises
    ------
    InvalidSettings
        If PyTorch or ONNX is not installed.
    OutputExists, StorageError
    """
    write_bytes(path, onnx_bytes(model), overwrite=overwrite)


def read_onnx(path: str | os.PathLike[str], *, threads: int | None = None) -> OnnxModel:
    """Read what `write_onnx` wrote. Needs no PyTorch.

    Parameters
    ----------
    threads
        To compute with; by default one for each core.

    Raises
    ------
    InvalidFile
        If there is no such file.
    InvalidModel
        If it is not one of ours, or damaged.
    InvalidSettings
        If ONNX Runtime is not installed.
    """
    _import("onnxruntime")
    try:
        content = Path(path).read_bytes()
    except OSError as error:
        raise InvalidFile(f"{path}: cannot be read ({error.strerror})") from None
    return load_onnx(content, str(path), threads=threads)


def in_onnx(model: TrainedModel, *, threads: int | None = None) -> OnnxModel:
    """Return a trained model in ONNX Runtime, without a file; takes some seconds.

    Raises
    ------
    InvalidSettings
        If PyTorch, ONNX or ONNX Runtime is not installed.
    """
    _import("onnxruntime")
    return load_onnx(onnx_bytes(model), model.architecture, threads=threads)


def load_onnx(content: bytes, source: str, *, threads: int | None = None) -> OnnxModel:
    """Return the model in the content of a file.

    Parameters
    ----------
    source
        For messages.

    Raises
    ------
    InvalidModel
        If it is not one of ours, or damaged.
    InvalidSettings
        If ONNX Runtime is not installed.
    """
    runtime = _import("onnxruntime")
    options = runtime.SessionOptions()
    options.log_severity_level = 4  # what goes wrong comes as an exception
    options.intra_op_num_threads = threads or os.cpu_count() or 1
    try:
        session = runtime.InferenceSession(content, options, providers=["CPUExecutionProvider"])
    except Exception as error:  # ONNX Runtime has no common class of its errors
        reason = first_line(error)
        raise InvalidModel(f"{source}: not an ONNX file, or truncated ({reason})") from None
    told = session.get_modelmeta().custom_metadata_map.get(METADATA_KEY)
    identity = read_identity(told, source)
    inputs = {each.name: tuple(each.shape[1:]) for each in session.get_inputs()}
    if inputs != {INPUT: identity.view.shape}:
        raise InvalidModel(
            f"{source}: the network in it looks at {inputs}, not at what it says: "
            f"{identity.view.shape}"
        )
    return OnnxModel(**identity.arguments(), session=session)


@contextlib.contextmanager
def _quiet() -> Iterator[None]:
    """Keep PyTorch's exporter from telling about its own deprecated calls and optional parts."""
    log = logging.getLogger("torch.onnx")
    before = log.level
    log.setLevel(logging.ERROR)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield
    finally:
        log.setLevel(before)


def _import(name: str) -> Any:
    import importlib

    try:
        return importlib.import_module(name)
    except ImportError as missing:
        raise InvalidSettings(f"this needs {name}; install it with: {INSTALL}") from missing
