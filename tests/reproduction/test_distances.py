"""How far designs are from what was learnt."""

from __future__ import annotations

import numpy as np
import pytest

from reproduction.networks import distances
from reproduction.networks.distances import smallest_distances


@pytest.mark.parametrize("beams", [3, 64, 203, 352])
def test_distances_agree_with_counting_beam_by_beam(
    monkeypatch: pytest.MonkeyPatch, beams: int
) -> None:
    monkeypatch.setattr(distances, "CHUNK", 37)  # so that designs fall into several chunks
    rng = np.random.default_rng(beams)
    known = rng.random((200, beams)) < 0.6
    made = rng.random((25, beams)) < 0.6
    made[3] = known[150]
    counted = (made[:, None] != known[None]).sum(axis=2)
    found, nearest = smallest_distances(np.packbits(made, axis=1), np.packbits(known, axis=1))
    assert found.tolist() == counted.min(axis=1).tolist()
    assert nearest.tolist() == counted.argmin(axis=1).tolist()
    assert found[3] == 0


def test_no_designs_have_no_distances() -> None:
    found, _ = smallest_distances(np.empty((0, 5), np.uint8), np.zeros((2, 5), np.uint8))
    assert found.shape == (0,)
