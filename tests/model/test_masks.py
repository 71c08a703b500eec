from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bellcrank.errors import InvalidFile
from bellcrank.model import pack_mask, unpack_mask


@given(st.lists(st.booleans(), min_size=1, max_size=100))
def test_masks_survive_packing(mask):
    assert unpack_mask(pack_mask(mask), len(mask)).tolist() == mask


@given(st.lists(st.booleans(), min_size=1, max_size=100))
def test_packed_masks_are_packbits_in_hexadecimal(mask):
    assert bytes.fromhex(pack_mask(mask)) == np.packbits(mask).tobytes()


def test_capital_digits_are_read_too():
    assert unpack_mask("F0", 8).tolist() == [True] * 4 + [False] * 4


@pytest.mark.parametrize(
    ("text", "beams", "message"),
    [
        ("ff", 9, "expected 4 hexadecimal digits for 9 beams, got 2"),
        ("ffff", 8, "expected 2 hexadecimal digits for 8 beams, got 4"),
        ("fg", 8, "expected hexadecimal digits, got 'g' at position 1"),
        ("f ff", 16, "expected hexadecimal digits, got ' ' at position 1"),
        ("ff90", 10, r"marks beam 11, but the lattice has only 10 beams \(0 to 9\)"),
    ],
)
def test_masks_of_other_lattices_are_refused(text, beams, message):
    with pytest.raises(InvalidFile, match=message):
        unpack_mask(text, beams)
