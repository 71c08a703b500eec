"""Lattices without order: how good the designs on many jammed packings of discs are."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.errors import InvalidProblem, InvalidSettings
from bellcrank.model import Problem, find_problem
from bellcrank.model.builtin.discs import discs
from bellcrank.plots import Motion, style
from bellcrank.search import read_settings
from reproduction.formatting import count, number, span
from reproduction.pictures.charts import Chart, Level, Series
from reproduction.pictures.sheets import Sheet, draw_sheet
from reproduction.registry import Claim, Figures, Study, register
from reproduction.searching import best_design, design_of, respond, run_chain

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    from reproduction.result_store import ResultStore

ORDERED = "scaling-8"
"""Of about as many nodes and beams, driven and watched at the same places by as much."""
SEARCHES = {"paper": "the paper's rule", "basin-hopping": "the default search"}
COLOURS = {"paper": style.INPUT, "basin-hopping": style.BEST}


@dataclass(frozen=True, slots=True, kw_only=True)
class Settings:
    """How many lattices, and how long they are searched."""

    lattices: int = 60
    steps: int = 4000
    first: int = 1


def run(settings: Settings, store: ResultStore) -> Figures:
    """Search on each lattice, and as often on an ordered one."""
    seeds = range(settings.first, settings.first + settings.lattices)
    found: dict[str, Any] = {}
    for search in SEARCHES:
        told = {"search": search, "steps": settings.steps}
        work = {str(seed): partial(on_discs, seed, told) for seed in seeds}
        disordered = store.compute_all(f"{search}-discs", work)
        again = {str(seed): partial(on_ordered, seed, told) for seed in seeds}
        ordered = store.compute_all(f"{search}-ordered", again)
        found[search] = {
            "discs": [each["efficiency"] for each in disordered.values()],
            "ordered": [each["efficiency"] for each in ordered.values()],
            "best": max(
                ({"seed": int(seed), **each} for seed, each in disordered.items()),
                key=lambda each: each["efficiency"] or -np.inf,
            ),
        }
    known = [value for value in found["paper"]["discs"] if value is not None]
    return {
        "lattices": settings.lattices,
        "usable": len(known),
        "steps": settings.steps,
        "ordered_problem": ORDERED,
        "searches": found,
        "summary": {
            search: {kind: _summary(told[kind]) for kind in ("discs", "ordered")}
            for search, told in found.items()
        },
    }


def _summary(values: Sequence[float | None]) -> dict[str, float]:
    known = np.array([value for value in values if value is not None])
    figures = np.quantile(known, [0.0, 0.1, 0.5, 0.9, 1.0]).tolist()
    told = dict(zip(("least", "low", "median", "high", "largest"), figures, strict=True))
    return {**told, "mean": float(known.mean()), "deviation": float(known.std())}


def on_discs(seed: int, told: Mapping[str, Any]) -> dict[str, Any]:
    """Search on one packing; packings whose output nothing connects give none."""
    try:
        problem = discs(seed)
    except InvalidProblem:
        return {"efficiency": None, "mask": None}
    return _searched(problem, told, 0)


def on_ordered(seed: int, told: Mapping[str, Any]) -> dict[str, Any]:
    """Search on the ordered lattice, from another seed."""
    return _searched(find_problem(ORDERED), told, seed)


def _searched(problem: Problem, told: Mapping[str, Any], seed: int) -> dict[str, Any]:
    settings = read_settings({**told, "chains": 1, "seed": seed})
    try:
        chosen = best_design(problem, [run_chain(problem, settings)])
    except InvalidSettings:  # none of the designs is one stable piece
        return {"efficiency": None, "mask": None}
    return {"efficiency": chosen.efficiency_after, "mask": chosen.design.mask_hex}


def draw(figures: Mapping[str, Any], path: Path) -> None:
    """Draw the best of the designs, and how efficiencies are spread."""
    best = figures["searches"]["basin-hopping"]["best"]
    design = design_of(discs(best["seed"]), best["mask"])
    still = np.zeros((design.problem.lattice.node_count, 2))
    full = design.problem.full_design()
    response = respond(design)
    charts = []
    values = [
        value
        for told in figures["searches"].values()
        for kind in ("discs", "ordered")
        for value in told[kind]
        if value is not None
    ]
    bins = int(np.clip(np.sqrt(2.0 * figures["lattices"]), 5, 18))
    edges = np.linspace(min(values), max(values), bins + 1)
    for kind, title in (("discs", "On jammed packings"), ("ordered", "On an ordered lattice")):
        series, levels = [], []
        for search, words in SEARCHES.items():
            known = [value for value in figures["searches"][search][kind] if value is not None]
            colour = COLOURS[search]
            middle = figures["summary"][search][kind]["median"]
            series.append(
                Series(
                    edges, np.array(known), name=f"{words}, median {middle:.2f}",
                    kind="histogram", colour=colour,
                )
            )  # fmt: skip
            levels.append(Level(middle, colour=colour, upright=True))
        charts.append(
            Chart(title, "efficiency of the cleaned design", "designs, %", series, levels,
                  legend="upper right", limits_y=(0.0, None))
        )  # fmt: skip
    sheet = Sheet(
        title=f"{figures['lattices']} disordered lattices, and an ordered one",
        note=f"one chain of {count(figures['steps'], 'proposal')} each; the ordered lattice has "
        "about as many nodes and beams, and is searched from as many seeds",
        motions=[
            Motion(full, still, name=f"A packing (seed {best['seed']})",
                   note=f"{full.beam_count} beams"),
            Motion(design, still, name="The best design", note=f"{design.beam_count} beams left"),
            Motion(design, response.displacement, response.efficiency, name="Moved",
                   magnify=10.0),
        ],
        charts=charts,
        still=frozenset({0, 1}),
        height=2.5,
    )  # fmt: skip
    draw_sheet(sheet, path, overwrite=True)


def claims(figures: Mapping[str, Any]) -> list[Claim]:
    """Compare with the paper."""
    told = figures["summary"]
    paper, own = told["paper"], told["basin-hopping"]
    return [
        Claim(
            "efficiency of designs on disordered lattices",
            "",
            f"efficiency {span(paper['discs']['least'], paper['discs']['largest'])}, median "
            f"{number(paper['discs']['median'])}, by the paper's rule on {figures['usable']} of "
            f"{count(figures['lattices'], 'jammed packing')}",
            "discrete model, cleaned designs",
        ),
        Claim(
            "without order and with it",
            "",
            f"by the paper's rule median {number(paper['discs']['median'])} without and "
            f"{number(paper['ordered']['median'])} with it; by the default search "
            f"{number(own['discs']['median'])} and {number(own['ordered']['median'])}",
            "about as many nodes and beams; the ordered lattice from as many seeds",
        ),
    ]


STUDY = register(
    Study(
        name="disorder",
        title="Efficiencies on jammed packings of discs",
        after="disordered lattices",
        full=Settings(),
        quick=Settings(lattices=8, steps=800),
        run=run,
        draw=draw,
        claims=claims,
        runs=lambda told: (
            f"{count(told['lattices'], 'lattice')}, {count(told['steps'], 'proposal')} by each of "
            "two searches"
        ),
        deviations=(
            (
                "Packings whose output nothing connects to the input give no design, nor do "
                "searches that find no stable one in one piece; the row counts the others."
            ),
            (
                "Packings are made by our own code (two sizes of discs, 1 to 1.4); the paper's "
                "are not at hand."
            ),
        ),
    )
)
