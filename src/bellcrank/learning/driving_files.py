"""What a network-driven search leaves in its folder: a record, the best design, a picture."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.model import Design, unpack_mask, write_design
from bellcrank.model.storage import write_text
from bellcrank.storage import check_free
from bellcrank.storage.files import make_folder

if TYPE_CHECKING:
    from pathlib import Path

    from bellcrank.learning.driven import Driven, Made
    from bellcrank.plots.driven import DrivenSearch

RECORD = "driven.json"
DESIGN = "design.json"
PICTURE = "driven.png"
DRAWN = "checked"
"""The offers in the picture."""


def keep_driven(driven: Driven, folder: Path) -> None:
    """Write the record, the best design that was made, and a picture.

    Parameters
    ----------
    folder
        New or empty.

    Raises
    ------
    OutputExists
        If it holds something already.
    StorageError
        If it cannot be written.
    """
    from bellcrank.plots.driven import draw_driven

    check_free(folder)
    make_folder(folder)
    write_text(folder / RECORD, json.dumps(driven.to_dict(), indent=1) + "\n")
    if driven.best is not None:
        write_design(best_design(driven, driven.best), folder / DESIGN)
    draw_driven(picture_of(driven), folder / PICTURE)


def best_design(driven: Driven, best: Made) -> Design:
    """Return a design that was made, with the efficiency that the mechanics gives it."""
    found = {
        "by": (
            "search by the mechanics, screened by a network"
            if driven.exact
            else "search driven by a network, checked by the mechanics"
        ),
        "predicted": best.predicted,
        "chain": best.chain,
        "offer": driven.offers[best.offer],
        "distance": best.distance,
        "settings": driven.settings,
    }
    return Design(
        problem=driven.problem,
        mask=unpack_mask(best.mask, driven.problem.lattice.beam_count),
        efficiency=best.truth.efficiency,
        provenance={**driven.provenance, "found": found},
    )


def picture_of(driven: Driven, offer: str = DRAWN) -> DrivenSearch:
    """Return what there is to draw of the designs offered by one rule."""
    from bellcrank.plots.driven import DrivenSearch

    made = driven.offered(offer)
    compared = driven.offered(offer, by_network=False)
    networks = " + ".join(driven.settings["networks"])
    made_by = "by mechanics, screened by" if driven.exact else "designed by"
    known = all(each.distance is not None for each in made)
    return DrivenSearch(
        title=f"{driven.problem.name} {made_by} {networks}",
        note=f"{len(made)} chains of {driven.steps} steps; {driven.offers[offer]}",
        true=np.array([_number(each.truth.efficiency) for each in made]),
        predicted=np.array([_number(each.predicted) for each in made]),
        mechanics=np.array([_number(each.truth.efficiency) for each in compared]),
        distance=np.array([each.distance for each in made], np.int64) if known else None,
        exact=driven.exact,
    )


def _number(value: float | None) -> float:
    return float("nan") if value is None else value
