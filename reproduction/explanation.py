"""Explaining a design: what a network sees in it, what is there, and a picture of both."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.model import Design
from bellcrank.plots.agreements import Measure
from bellcrank.plots.explanation import Explained, draw_explanation
from bellcrank.plots.saving import check_target
from bellcrank.plots.shadings import HeatMap, Shading
from bellcrank.surrogate.explaining import Explanation, explain
from bellcrank.surrogate.predictor import load_model
from bellcrank.surrogate.regions import overlap_of_regions

if TYPE_CHECKING:
    import os

    from bellcrank.surrogate.occlusion import Block
    from bellcrank.surrogate.trained import TrainedModel

WORDS = {
    "screening": ("screening", "all"),
    "network": ("network", "all"),
    "gradient": ("gradient", "all"),
    "white": ("white block", "present"),
    "black": ("black block", "absent"),
}
"""Measures that are drawn, what they are called there, and the flips that they are judged by: a
white block removes what is there, a black one adds what is not."""
POINTS = ("screening", "network", "gradient")
"""Measures that are drawn as points too."""


def explain_design(
    design: Design,
    model: str | os.PathLike[str] | None = None,
    picture: str | os.PathLike[str] | None = None,
    *,
    block: Block | None = None,
    device: str = "auto",
    overwrite: bool = False,
) -> Explanation:
    """Ask a network and the mechanics what each beam of a design is good for, and draw it.

    A design for a part has the stiffness of its struts. Networks know one stiffness: such a
    design is explained with that one, as the design of the explanation says.

    Parameters
    ----------
    design
        With a unique, stable response.
    model
        File of a trained model, or the folder of a training; by default the one that comes with
        bellcrank.
    picture
        Where to; None draws nothing.
    block
        To hide parts of the picture with; see `bellcrank.surrogate.explaining.explain`.
    device
        Where the network computes.
    overwrite
        Whether to replace the picture.

    Raises
    ------
    InvalidModel
        If the network has learnt something else, or is damaged.
    InvalidFile
        If there is no such file.
    InvalidSettings
        If the design has no unique response, the picture's suffix names no format, or a block is
        given although the network looks at no pictures.
    OutputExists, StorageError
    """
    if picture is not None:
        check_target(picture, overwrite=overwrite)
    network, known = _learnt(design, model)
    found = explain(network, known, block, device=device)
    if picture is not None:
        draw_explanation(as_drawn(found), picture, overwrite=overwrite)
    return found


def _learnt(design: Design, path: str | os.PathLike[str] | None) -> tuple[TrainedModel, Design]:
    """Return the network, and the design with the stiffness that it has learnt."""
    problem = design.problem
    network = load_model(problem, path, any_stiffness=True)
    known = replace(problem, stiffness=network.problem.stiffness)
    return network, Design(known, design.mask)


def as_drawn(found: Explanation) -> Explained:
    """Return an explanation as `bellcrank.plots` draws it."""
    there, said = found.regions()
    drawn = found.present
    overlap = overlap_of_regions(there[drawn], said[drawn])["vital"]
    shared = "" if overlap is None else f"{100 * overlap:.0f} % of the vital beams shared"
    problem = found.design.problem
    return Explained(
        design=found.design,
        title=f"{problem.name}: what {found.architecture} sees, and what is there",
        note=(
            f"efficiency {found.efficiency:.3f} by mechanics, {found.predicted:.3f} predicted · "
            f"{found.design.beam_count} beams · {len(found.beams)} flips"
        ),
        beams=found.beams,
        exact=found.exact,
        changes=(
            Shading("Each flip, by mechanics", "the exact change", found.exact),
            Shading("Each flip, by the network", "the predicted change", found.network),
            Shading("Gradient of the network", "of the prediction by presence", found.slope),
        ),
        regions=(
            Shading("Regions, by mechanics", "what removing a beam does", there),
            Shading("Regions, by the network", shared or "what it takes them to be", said),
        ),
        maps=_maps(found),
        measures=_measures(found),
    )


def _maps(found: Explanation) -> tuple[HeatMap, ...]:
    seen = found.occlusion
    if seen is None:
        return ()
    size = f"of {seen.block.size} x {seen.block.size} pixels"
    return (
        HeatMap("A white block", f"{size}, hides beams", seen.white, seen.low, seen.high),
        HeatMap("A black block", f"{size}, hides holes", seen.black, seen.low, seen.high),
    )


def _measures(found: Explanation) -> tuple[Measure, ...]:
    values, agreements = found.measures(), found.correlations()
    told = []
    for name, (label, subset) in WORDS.items():
        if name in values:
            one = agreements[name][subset]
            points = np.asarray(values[name]) if name in POINTS else None
            told.append(Measure(label, one.pearson, one.spearman, one.recall, points))
    return tuple(told)
