"""Comparison of models of the lattice with its measurements, and effects of its uncertainties."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from bellcrank.mechanics import FrameEvaluator
from reproduction.measured.lattice import (
    MODELS,
    Force,
    Model,
    Sample,
    data,
    displacement_of,
    elongations,
    mirrored,
    problem_of,
    spacing,
)

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    Floats = NDArray[np.float64]
    Respond = Callable[[Force], Floats]

BASE = Model(kind="frame", clamped=True)
"""The model whose sample is varied."""


class Outputs(NamedTuple):
    """The measured vertical displacements of two nodes under one force, m."""

    nodes: tuple[int, ...]
    force: Force
    values: Floats
    uncertainty: Floats
    mean: float
    """Weighted by the inverse squares of the uncertainties."""


class Gradients(NamedTuple):
    """Measured products of the elongations of struts under two forces, m^2."""

    name: str
    forces: tuple[Force, ...]
    values: Floats
    uncertainty: Floats


@cache
def outputs() -> Outputs:
    """Return the measured displacements."""
    given = data()["measured_displacements"]
    values, uncertainty = (np.array(given[key]) for key in ("vertical_m", "uncertainty_m"))
    weight = uncertainty**-2.0
    return Outputs(
        tuple(given["outputs"]), (given["load"]["node"], tuple(given["load"]["force"])),
        values, uncertainty, float((weight * values).sum() / weight.sum()),
    )  # fmt: skip


@cache
def gradients() -> tuple[Gradients, ...]:
    """Return the two measured data sets."""
    return tuple(
        Gradients(
            each["name"], tuple((node, tuple(force)) for node, force in each["forces"]),
            np.array(each["values"]), np.array(each["uncertainty"]),
        )
        for each in data()["measured_gradients"]
    )  # fmt: skip


def products(respond: Respond, measured: Gradients, *, nonlinear: bool) -> Floats:
    """Return (M,) the products of the elongations under the two forces of a data set, m^2."""
    first, second = (elongations(respond(force), nonlinear=nonlinear) for force in measured.forces)
    found: Floats = first * second
    return found


def root_mean_square(difference: Floats) -> float:
    """Return the root of the mean square."""
    return float(np.sqrt(np.mean(np.square(difference))))


def agreement(respond: Respond, *, nonlinear: bool) -> dict[str, Any]:
    """Return the outputs of a model, and its gradients compared with both data sets."""
    measured = outputs()
    vertical = respond(measured.force)[list(measured.nodes), 1]
    found: dict[str, Any] = {
        "outputs_mm": (1e3 * vertical).tolist(),
        "deviation": ((vertical - measured.values) / measured.uncertainty).tolist(),
    }
    for each in gradients():
        model = products(respond, each, nonlinear=nonlinear)
        found[each.name] = {
            "rms": root_mean_square(model - each.values),
            "r": float(np.corrcoef(model, each.values)[0, 1]),
            "within": float(np.mean(np.abs(model - each.values) <= each.uncertainty)),
            "values": model.tolist(),
        }
    return found


def matching_modulus(model: Model, sample: Sample) -> float:
    """Return Young's modulus with which the mean output is the measured one, MPa.

    It is found from the outputs alone; the gradients have no part in it.
    """
    measured = outputs()
    for _ in range(3):
        vertical = displacement_of(model, sample, measured.force)[list(measured.nodes), 1]
        sample = replace(sample, young=sample.young * float(vertical.mean()) / measured.mean)
    return sample.young


def compared(model: Model) -> dict[str, Any]:
    """Return the agreement of a model with the modulus of the source, and with a matching one."""
    sample = Sample()
    matching = replace(sample, young=matching_modulus(model, sample))
    return {
        "young_MPa": matching.young,
        **{
            key: agreement(
                lambda force, sample=each: displacement_of(model, sample, force),  # type: ignore[misc]
                nonlinear=model.nonlinear,
            )
            for key, each in (("nominal", sample), ("matching", matching))
        },
    }


EFFECTS: dict[str, tuple[str, Model, Sample, float]] = {
    "base": ("frames, clamped, linear", BASE, Sample(), 0.0),
    "free": ("supports free to turn", replace(BASE, clamped=False), Sample(), 0.0),
    "nonlinear": ("large displacements", replace(BASE, nonlinear=True), Sample(), 0.0),
    "joint": ("joints of 0.6 mm that do not bend", BASE, Sample(joint=0.6), 0.0),
    "sheet": ("sheet: joints as drawn", replace(BASE, kind="sheet"), Sample(), 0.0),
    "width": ("struts 0.1 mm wider", BASE, Sample(width=2.1), 0.0),
    "thickness": ("struts 0.1 mm thicker", BASE, Sample(thickness=2.1), 0.0),
    "young": ("modulus 5 % lower", BASE, Sample(young=0.95 * 0.55), 0.0),
    "offset": ("weights 1 mm beside the node", BASE, Sample(), 1e-3),
}
"""Name, model, sample, and distance of the weights from their node in m."""


def effect(name: str) -> dict[str, Any]:
    """Return the outputs and gradients with one change."""
    title, model, sample, offset = EFFECTS[name]

    def respond(force: Force) -> Floats:
        return displacement_of(model, sample, force, moment=offset * force[1][1])

    return _summary(title, agreement(respond, nonlinear=model.nonlinear))


def own_weight(density: float) -> dict[str, Any]:
    """Return them for weights on the lattice that its own weight has already deformed.

    Parameters
    ----------
    density
        g / cm^3.
    """
    model = replace(BASE, nonlinear=True)
    sample = Sample(density=density)
    # A force of the weights that is too small to matter leaves the own weight.
    rest = displacement_of(model, sample, (outputs().force[0], (0.0, -1e-9)))

    def measured_by(force: Force) -> Floats:
        return elongations(displacement_of(model, sample, force), nonlinear=True) - elongations(
            rest, nonlinear=True
        )

    given = outputs()
    vertical = (displacement_of(model, sample, given.force) - rest)[list(given.nodes), 1]
    found: dict[str, Any] = {"outputs_mm": (1e3 * vertical).tolist()}
    for each in gradients():
        first, second = (measured_by(force) for force in each.forces)
        found[each.name] = {"rms": root_mean_square(first * second - each.values)}
    return _summary(f"large displacements, own weight of {density:g} g/cm³", found)


def scattered(samples: int, width: float, position: float, seed: int = 0) -> list[dict[str, Any]]:
    """Return them for lattices with random widths of struts, and random positions of nodes.

    Parameters
    ----------
    samples
        Number of lattices of each kind.
    width
        Standard deviation of each width, as a part of it.
    position
        Standard deviation of both coordinates of each node, mm.
    """
    rng = np.random.default_rng(seed)
    return [
        _scattered(f"widths with a standard deviation of {100.0 * width:g} %", samples, rng,
                   width, 0.0),
        _scattered(f"nodes with a standard deviation of {position:g} mm", samples, rng,
                   0.0, position),
    ]  # fmt: skip


def _scattered(
    title: str, samples: int, rng: np.random.Generator, width: float, position: float
) -> dict[str, Any]:
    metre = 1e-3 * spacing()
    found = []
    for _ in range(samples):
        base = problem_of(Sample(), outputs().force)
        widths = base.beam_widths * (1.0 + width * rng.standard_normal(len(base.beam_widths)))
        shift = position / spacing() * rng.standard_normal(base.lattice.positions.shape)
        problem = base.with_geometry(base.lattice.positions + shift, widths)
        rest = FrameEvaluator(problem).at_rest(problem.initial)
        assert rest is not None

        def respond(force: Force, rest: Any = rest) -> Floats:
            load = rest.fields(1)[0]
            load[force[0], :2] = force[1]
            motion: Floats = metre * rest.solve(load)[:, :2]
            return motion

        found.append(agreement(respond, nonlinear=False))
    vertical = np.array([each["outputs_mm"] for each in found])
    return {
        "title": title,
        "output_mm": float(vertical.mean()),
        "output_sd_mm": float(vertical.std()),
        **{
            each.name: {
                "rms": float(np.mean([row[each.name]["rms"] for row in found])),
                "rms_sd": float(np.std([row[each.name]["rms"] for row in found])),
            }
            for each in gradients()
        },
    }


def _summary(title: str, found: dict[str, Any]) -> dict[str, Any]:
    """Return the mean output and the errors."""
    return {
        "title": title,
        "output_mm": float(np.mean(found["outputs_mm"])),
        **{each.name: {"rms": found[each.name]["rms"]} for each in gradients()},
    }


def noise() -> dict[str, Any]:
    """Return what the measurements say about their own errors, without any model.

    The two forces of the first data set are mirror images, apart from their size, so that a strut
    and its mirror image have the same product in every linear model of a symmetric lattice. The
    second data set has the squares of elongations under the force on one node, from which the
    size of these products follows.
    """
    first, second = gradients()
    image = mirrored()
    difference = first.values - first.values[image]
    pairs = image != np.arange(len(image))
    squares = np.clip(second.values, 0.0, None)
    by_second = 0.5 * np.sqrt(squares * squares[image])
    bars = products(
        lambda force: displacement_of(MODELS["bars"], Sample(), force), second, nonlinear=False
    )
    share = np.square(bars - second.values)
    worst = np.argsort(-share)[:2]
    return {
        "stated_rms": [root_mean_square(each.uncertainty) for each in (first, second)],
        "mirror_sd": root_mean_square(difference[pairs]) / np.sqrt(2.0),
        "mirror_floor": root_mean_square(difference) / 2.0,
        "between": root_mean_square(by_second - np.abs(first.values)),
        "between_r": float(np.corrcoef(by_second, np.abs(first.values))[0, 1]),
        "negative_squares": int((second.values < 0.0).sum()),
        "largest_negative": float(-second.values.min()),
        "worst_struts": [data()["beams"][k] for k in worst],
        "worst_share": float(share[worst].sum() / share.sum()),
    }
