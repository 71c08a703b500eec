"""Tables of the record of the measured lattice for the documentation."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from reproduction.measured.comparison import gradients
from reproduction.measured.study import AREA, SHORT, title_of

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

Row = tuple[str, ...]


def output_rows(figures: Mapping[str, Any]) -> Iterator[Row]:
    """Yield model, mean output, deviations in uncertainties, and the matching modulus."""
    for name, row in figures["models"].items():
        nominal = row["nominal"]
        deviations = " and ".join(f"{each:+.2f}" for each in nominal["deviation"])
        yield (
            SHORT[name], title_of(name), f"{-np.mean(nominal['outputs_mm']):.4f}", deviations,
            "yes" if max(map(abs, nominal["deviation"])) <= 1.0 else "no",
            f"{row['young_MPa']:.4f}",
        )  # fmt: skip


def gradient_rows(figures: Mapping[str, Any]) -> Iterator[Row]:
    """Yield model, and for both data sets errors with both moduli, and the correlation."""
    for name, row in figures["models"].items():
        cells = []
        for each in gradients():
            cells += [f"{AREA * row[key][each.name]['rms']:.3f}" for key in ("nominal", "matching")]
            cells.append(f"{row['matching'][each.name]['r']:.4f}")
        yield SHORT[name], title_of(name), *cells


def effect_rows(figures: Mapping[str, Any]) -> Iterator[Row]:
    """Yield change, mean output with its change in percent, and both errors."""
    base = figures["effects"][0]["output_mm"]
    for row in figures["effects"]:
        change = f"{100.0 * (row['output_mm'] / base - 1.0):+.2f}"
        if "output_sd_mm" in row:
            change += f" ± {-100.0 * row['output_sd_mm'] / base:.2f}"
        errors = []
        for each in gradients():
            found = row[each.name]
            spread = f" ± {AREA * found['rms_sd']:.2f}" if "rms_sd" in found else ""
            errors.append(f"{AREA * found['rms']:.2f}{spread}")
        yield row["title"], f"{-row['output_mm']:.4f}", change, *errors


def noise_rows(figures: Mapping[str, Any]) -> Iterator[Row]:
    """Yield measures of the errors of the measurement."""
    found = figures["noise"]
    first, second = (AREA * each for each in found["stated_rms"])
    yield "stated uncertainties, 5 g and 10 g (root mean square)", f"{first:.2f}"
    yield "stated uncertainties, 10 g twice (root mean square)", f"{second:.2f}"
    yield (
        "5 g and 10 g: standard deviation of a strut, from its mirror image",
        (f"{AREA * found['mirror_sd']:.2f}"),
    )
    yield (
        "5 g and 10 g: least error of any symmetric linear model",
        (f"{AREA * found['mirror_floor']:.2f}"),
    )
    yield (
        "5 g and 10 g, from 10 g twice: root mean square difference",
        (f"{AREA * found['between']:.2f}"),
    )
