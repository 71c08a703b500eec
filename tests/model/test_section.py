"""Cross-sections and materials of frames."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bellcrank.errors import InvalidProblem
from bellcrank.model import Elasticity, Section

size = st.floats(1e-3, 1e3)


@given(size, size)
def test_a_rectangle_has_the_moments_of_a_rectangle(width, thickness):
    section = Section(width, thickness)
    assert section.shape == "rectangle"
    assert section.area == pytest.approx(width * thickness)
    assert section.inertia == pytest.approx(thickness * width**3 / 12.0)
    assert section.inertia_out_of_plane == Section(thickness, width).inertia
    assert section.torsion_constant == Section(thickness, width).torsion_constant
    assert section.shear_coefficient == 5.0 / 6.0


def test_the_moments_of_a_disc_are_integrals_over_it():
    section, radius = Section.round(0.5), 0.25
    ring = (np.arange(100_000) + 0.5) * radius / 100_000
    area = 2.0 * math.pi * ring.mean() * radius
    polar = 2.0 * math.pi * (ring**3).mean() * radius
    assert section.area == pytest.approx(area, rel=1e-9)
    assert section.inertia == pytest.approx(polar / 2.0, rel=1e-9)
    assert section.inertia_out_of_plane == section.inertia
    assert section.torsion_constant == pytest.approx(polar, rel=1e-9)
    assert section.shear_coefficient == 0.9
    assert section.width == section.thickness == 0.5


@pytest.mark.parametrize("ratio", [1.0, 1.3, 2.0, 5.0, 40.0])
def test_the_torsion_constant_of_a_rectangle_is_the_sum_of_the_series(ratio):
    n = np.arange(1, 20_001, 2, dtype=np.float64)
    series = (np.tanh(n * math.pi * ratio / 2.0) / n**5)[::-1].sum()
    expected = 0.2**3 * 0.2 * ratio / 3.0 * (1.0 - 192.0 / math.pi**5 / ratio * series)
    assert Section(0.2, 0.2 * ratio).torsion_constant == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize(
    ("ratio", "beta"),  # Timoshenko and Goodier, table of section 109: J = beta long short^3
    [(1.0, 0.1406), (1.5, 0.196), (2.0, 0.229), (3.0, 0.263), (10.0, 0.312), (1e6, 1.0 / 3.0)],
)
def test_torsion_constants_agree_with_the_tables(ratio, beta):
    assert Section(1.0, ratio).torsion_constant / ratio == pytest.approx(beta, abs=6e-4)


@given(size, size, st.floats(1e-2, 1e2))
def test_scaled_sections_scale_with_powers_of_the_length(width, thickness, factor):
    for section in (Section(width, thickness), Section.round(width)):
        scaled = section.scaled(factor)
        assert scaled.shape == section.shape
        assert scaled.area == pytest.approx(factor**2 * section.area)
        for name in ("inertia", "inertia_out_of_plane", "torsion_constant"):
            assert getattr(scaled, name) == pytest.approx(factor**4 * getattr(section, name))


def test_the_shear_modulus_follows_from_young_and_poisson():
    assert Elasticity(young=1.0, poisson=0.48).shear_modulus == pytest.approx(1.0 / 2.96)


@pytest.mark.parametrize(
    ("build", "message"),
    [
        (lambda: Section(-1.0, 1.0), "section.width: expected a number greater than 0, got -1.0"),
        (lambda: Section(0, 1.0), "section.width: expected a number greater than 0, got 0"),
        (lambda: Section(math.nan, 1.0), "section.width: expected a finite number, got nan"),
        (lambda: Section(1.0, math.inf), "section.thickness: expected a finite number, got inf"),
        (lambda: Section("2", 1.0), "section.width: expected numbers"),
        (lambda: Section(None, 1.0), "section.width: expected numbers"),
        (lambda: Section([1.0, 2.0], 1.0), "section.width: expected a number greater than 0"),
        (lambda: Section(1.0, 1.0, "oval"), "section.shape: expected 'rectangle' or 'round', got"),
        (lambda: Section(1.0, 2.0, "round"), "section.thickness: expected the diameter 1 of a"),
        (lambda: Section.round(-0.2), "section.diameter: expected a number greater than 0"),
        (lambda: Section(1.0, 1.0).scaled(0.0), "factor: expected a number greater than 0"),
        (lambda: Elasticity(0.0, 0.3), "material.young: expected a number greater than 0"),
        (lambda: Elasticity(math.inf, 0.3), "material.young: expected a finite number, got inf"),
        (lambda: Elasticity(None, 0.3), "material.young: expected numbers"),
        (lambda: Elasticity(1.0, 0.51), "material.poisson: expected a ratio greater than -1 and"),
        (lambda: Elasticity(1.0, -1.0), "material.poisson: expected a ratio greater than -1 and"),
        (lambda: Elasticity(1.0, math.nan), "material.poisson: expected a finite number, got nan"),
    ],
)
def test_impossible_sections_and_materials_are_refused(build, message):
    with pytest.raises(InvalidProblem, match=f"^{message}"):
        build()
