"""Write the mean of the weights of networks: ``python -m tools.mean_network A B --out FILE``.

Networks that were trained on from the same weights with different data can be averaged weight by
weight; the mean has smaller errors than each of them (Wortsman et al., ICML 2022, "Model soups").
The bundled network is such a mean (docs/surrogate.md).
"""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from bellcrank.surrogate.trained_model import read_model

if TYPE_CHECKING:
    from collections.abc import Sequence

    from bellcrank.surrogate.trained_model import TrainedModel


def mean_of(models: Sequence[TrainedModel]) -> TrainedModel:
    """Return the mean of the weights of networks that were trained on from the same one.

    Its record is that of the last network, with the records of the others in ``mean_of``.

    Raises
    ------
    ValueError
        If the networks have other inputs, outputs or weights.
    """
    import torch

    *others, last = models
    kinds = [{**each.describe(), "record": None} for each in models]
    if any(kind != kinds[-1] for kind in kinds):
        raise ValueError("expected networks of one architecture, problem, picture and scale")
    weights = [each.network.state_dict() for each in models]
    last.network.load_state_dict(
        {
            name: torch.stack([each[name].double() for each in weights]).mean(0).to(value.dtype)
            for name, value in weights[-1].items()
        }
    )
    return replace(last, record={**last.record, "mean_of": [each.record for each in others]})


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("networks", nargs="+", type=Path)
    parser.add_argument("--out", type=Path, required=True)
    given = parser.parse_args()
    mean_of([read_model(network) for network in given.networks]).write(given.out)
