"""Designs of one task by hand and by machine, side by side, in the model and as parts."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.errors import InvalidSettings
from bellcrank.model import Design, Stiffness, find_problem, gallery_design
from bellcrank.part import PartSpec
from bellcrank.plots import Motion, style
from reproduction.checking import analyse_all
from reproduction.formatting import count, number
from reproduction.pictures.charts import Chart, Series
from reproduction.pictures.sheets import Sheet, draw_sheet
from reproduction.searching import best_design, design_of, respond, run_chains

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from reproduction.registry import Figures
    from reproduction.result_store import ResultStore

BY = {
    "hand": "By hand",
    "paper": "By the paper's rule",
    "default": "By the default search",
    "part": "For 2 mm struts",
}
"""Designs, and what stands over them."""
SHORT = {"hand": "hand", "paper": "paper's rule", "default": "default", "part": "2 mm struts"}
MODELS = {
    "discrete": ("discrete model", style.INK),
    "frame": ("nonlinear frame", style.BEST),
    "plane": ("printed outline", style.BUILT),
}
PUBLISHED = "the paper"


@dataclass(frozen=True, slots=True, kw_only=True)
class Duel:
    """A task, and how hard machines try.

    Parameters
    ----------
    problem
        Built in, with a design by hand.
    paper_steps, paper_chains
        Of the paper's search.
    steps, chains
        Of the default one.
    levels
        Of finite elements.
    width
        Of the struts, mm, on a lattice unit of 10 mm.
    """

    problem: str
    paper_steps: int = 20_000
    paper_chains: int = 8
    steps: int = 20_000
    chains: int = 4
    seed: int = 0
    levels: tuple[str, ...] = ("frame", "plane")
    width: float = 2.0


def run(settings: Duel, store: ResultStore) -> Figures:
    """Search, and look at all designs at all levels."""
    problem = find_problem(settings.problem)
    found: dict[str, Design] = {}
    for by in ("hand", "part"):
        known = gallery_design("human" if by == "hand" else "machine", settings.problem)
        if known is not None:
            found[by] = known
    for by, search, steps, chains in (
        ("paper", "paper", settings.paper_steps, settings.paper_chains),
        ("default", "basin-hopping", settings.steps, settings.chains),
    ):
        told = {"search": search, "steps": steps, "seed": settings.seed}
        ran = run_chains(store, f"{by}-chain", problem, told, chains)
        found[by] = best_design(problem, ran).design
    designs = {by: found[by] for by in BY if by in found}
    parts = analyse_all(store, designs, PartSpec(width=settings.width), settings.levels)
    return {
        "problem": settings.problem,
        "width": settings.width,
        "searches": {
            "paper": {"chains": settings.paper_chains, "steps": settings.paper_steps},
            "default": {"chains": settings.chains, "steps": settings.steps},
        },
        "designs": {by: {**_told(design), **parts[by]} for by, design in designs.items()},
    }


def _told(design: Design) -> dict[str, Any]:
    response = respond(design)
    stiffness = design.problem.stiffness
    return {
        "mask": design.mask_hex,
        "beams": design.beam_count,
        "stiffness": [stiffness.bond, stiffness.angle],
        "discrete": {
            "efficiency": response.efficiency if response.is_admissible else None,
            "status": response.status.label,
        },
    }


def design_from(figures: Mapping[str, Any], by: str) -> Design:
    """Return a design of the record."""
    told = figures["designs"][by]
    bond, angle = told["stiffness"]
    problem = find_problem(figures["problem"])
    return design_of(replace(problem, stiffness=Stiffness(bond, angle)), told["mask"])


def efficiency(figures: Mapping[str, Any], by: str, model: str) -> float | None:
    """Return an efficiency of the record, if it has one."""
    if by not in figures["designs"]:
        raise InvalidSettings(f"designs: no design by {by!r}")
    value = figures["designs"][by].get(model, {}).get("efficiency")
    return None if value is None else float(value)


def levels_in(figures: Mapping[str, Any]) -> list[str]:
    """Return which models the record has figures of."""
    return [
        model
        for model in MODELS
        if any(model in told for told in figures["designs"].values())
    ]  # fmt: skip


def draw(
    figures: Mapping[str, Any], path: Path, title: str, published: tuple[float, float]
) -> None:
    """Draw the designs in motion, and bars of their efficiencies.

    Parameters
    ----------
    published
        By hand and by machine, in the paper.
    """
    motions = []
    for by in figures["designs"]:
        design = design_from(figures, by)
        response = respond(design)
        motions.append(Motion(design, response.displacement, response.efficiency, name=BY[by]))
    order = [by for by in BY if by in figures["designs"]]
    models = levels_in(figures)
    wide = 0.8 / len(models)
    series = [
        _bars(
            np.arange(len(order)) + (k - 0.5 * (len(models) - 1)) * wide,
            [efficiency(figures, by, model) for by in order],
            MODELS[model],
            0.94 * wide,
            frozenset(i for i, by in enumerate(order) if model in figures["designs"][by]),
        )
        for k, model in enumerate(models)
    ]
    places = np.array([len(order), len(order) + 1.0])
    series.append(_bars(places, list(published), (PUBLISHED, style.HUMAN), 0.55))
    names = [*(SHORT[by] for by in order), "paper, hand", "paper, machine"]
    tallest = max(float(np.max(each.y)) for each in series)
    searches = figures["searches"]
    chart = Chart(
        f"Efficiency in the model and by finite elements (struts {figures['width']:g} mm wide on "
        "10 mm), beside what the paper reports",
        "", "efficiency", series, names=names, legend="upper right",
        limits_y=(None, 1.12 * tallest),
    )  # fmt: skip
    draw_sheet(
        Sheet(
            title=title,
            note=f"paper's rule: the best of {count(searches['paper']['chains'], 'chain')} of "
            f"{count(searches['paper']['steps'], 'proposal')}; default search: of "
            f"{count(searches['default']['chains'], 'chain')} of "
            f"{count(searches['default']['steps'], 'proposal')}",
            motions=motions,
            charts=[chart],
            height=2.1,
        ),
        path,
        overwrite=True,
    )


def _bars(
    places: Any,
    values: list[float | None],
    looks: tuple[str, str],
    width: float,
    known: frozenset[int] = frozenset(),
) -> Series:
    """Return bars; those that are known to have no efficiency are of designs that snap."""
    name, colour = looks
    drawn = np.array([0.0 if value is None else value for value in values])
    labels = [("snaps" if k in known else "") if value is None else number(value)
              for k, value in enumerate(values)]  # fmt: skip
    return Series(places, drawn, name=name, kind="bars", colour=colour, width=width, labels=labels)


def runs(figures: Mapping[str, Any]) -> str:
    """Say how much was searched."""
    searches = figures["searches"]
    return " and ".join(
        f"{count(searches[by]['chains'], 'chain')} of {count(searches[by]['steps'], 'proposal')} "
        f"{words}"
        for by, words in (("paper", "by the paper's rule"), ("default", "by the default search"))
    )


def _end(status: str) -> str:
    """Say how a path without an efficiency ends."""
    return "snaps" if status == "snapped" else "finds no equilibrium"


def in_all_models(figures: Mapping[str, Any], by: str) -> str:
    """Write the efficiencies of a design in all models."""
    return ", ".join(
        f"{number(efficiency(figures, by, model))} {MODELS[model][0]}"
        if efficiency(figures, by, model) is not None
        else f"{_end(figures['designs'][by][model]['status'])} as {MODELS[model][0]}"
        for model in levels_in(figures)
        if model in figures["designs"][by]
    )
