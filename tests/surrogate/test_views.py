"""Views lose nothing: each beam can be read back."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest

from bellcrank.errors import InvalidDataset
from bellcrank.surrogate.views import views

from .helpers import random_masks

if TYPE_CHECKING:
    from bellcrank.model import Problem


@pytest.mark.parametrize("name", list(views))
def test_every_view_turns_masks_into_bytes_of_its_shape(name: str, problem: Problem) -> None:
    view = views[name](problem)
    masks = random_masks(problem, 5)
    seen = view.arrays(np.packbits(masks, axis=1))
    assert seen.shape == (5, *view.shape)
    assert seen.dtype == np.uint8
    assert 0.99 < seen.max() * view.scale <= 1.0
    again = views[name](problem, **view.to_dict())
    assert np.array_equal(again.arrays(np.packbits(masks, axis=1)), seen)
    with pytest.raises(InvalidDataset, match="packed: expected masks of 28 bytes"):
        view.arrays(np.zeros((2, 5), np.uint8))


def test_bits_are_the_mask(problem: Problem) -> None:
    masks = random_masks(problem, 5)
    assert np.array_equal(views["bits"](problem).arrays(np.packbits(masks, axis=1)), masks)
