"""The axis and the hand of a rotation in space."""

from __future__ import annotations

import json

import numpy as np
import pytest

from bellcrank.machines.bundled import bundled_part
from bellcrank.model import problem_to_dict
from bellcrank.web.quick_calls import motion
from bellcrank.workflows.part_figures import part_figures
from bellcrank.workflows.validation import spec_for


@pytest.mark.slow
def test_a_rotation_in_space_is_right_handed_about_its_axis() -> None:
    design = bundled_part("machine:twist-column")
    assert design is not None
    (figures,) = part_figures(design, spec_for(design))
    axis = np.array(figures["rotation_axis"])
    assert axis == pytest.approx([0.0, 0.0, -1.0], abs=0.02)
    found = motion(json.dumps(problem_to_dict(design.problem)), design.mask_hex)
    assert found["axis"][0] is None  # at rest
    assert found["axis"][-1] == pytest.approx(axis.tolist(), abs=0.02)
    assert found["rotation"][-1] == pytest.approx(figures["rotation_deg"], rel=0.02)
    # The nodes move as by this rotation in the beginning.
    (nodes,) = found["outputs"].values()
    first = np.reshape(found["displacement"][1], (-1, 3))[nodes]
    rest = design.problem.lattice.positions[nodes]
    turned = np.cross(axis, rest - rest.mean(axis=0))
    sideways = first - first.mean(axis=0)
    assert (turned * sideways).sum() > 0.9 * np.linalg.norm(turned) * np.linalg.norm(sideways)
