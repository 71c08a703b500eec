"""Write the mean of the weights of networks: ``python -m tools.mean_network A B --out FILE``.

Networks that were trained on from the same weights with different data can be averaged weight by
weight; the mean has smaller errors than each of them (Wortsman et al., ICML 2022, "Model soups").
The bundled network is such a mean (docs/surrogate.md).
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

import numpy as np
from safetensors import safe_open
from safetensors.numpy import load_file, save_file

KEY = "bellcrank"
"""Key of the description in the file of a network."""


def read_description(network: Path) -> dict[str, Any]:
    """Return the description of a network: architecture, picture, record of its training."""
    with safe_open(network, "numpy") as file:
        found: dict[str, Any] = json.loads(file.metadata()[KEY])
    return found


def write_mean(networks: list[Path], out: Path) -> None:
    """Write the mean of the weights of networks with equal names and shapes.

    The description is that of the last network, with the records of the others in ``mean_of``.
    """
    weights = [load_file(network) for network in networks]
    *others, description = [read_description(network) for network in networks]
    description["record"]["mean_of"] = [each["record"] for each in others]
    shapes = [{name: array.shape for name, array in each.items()} for each in weights]
    if any(each != shapes[0] for each in shapes):
        raise ValueError("networks of different shapes")
    mean = {
        name: np.asarray(
            np.mean([np.asarray(each[name], dtype=np.float64) for each in weights], axis=0)
        ).astype(array.dtype)
        for name, array in weights[-1].items()
    }
    save_file(mean, out, metadata={KEY: json.dumps(description)})


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("networks", nargs="+", type=Path)
    parser.add_argument("--out", type=Path, required=True)
    given = parser.parse_args()
    write_mean(given.networks, given.out)
