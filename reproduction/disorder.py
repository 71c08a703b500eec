"""Efficiencies of designs on disordered lattices, jammed packings of discs."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.errors import InvalidProblem, NoDesignFound
from bellcrank.model import Problem, find_problem
from bellcrank.model.builtin.discs import discs
from bellcrank.plots import Motion, style
from bellcrank.search import read_settings
from reproduction.formatting import count, number, span
from reproduction.pictures.charts import Chart, Level, Series
from reproduction.pictures.sheets import Sheet, draw_sheet
from reproduction.registry import Claim, Figures, Study, register
from reproduction.searching import best_design, design_of, quantiles, respond, run_chain

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    from reproduction.result_store import ResultStore

ORDERED = "scaling-8"
"""Ordered problem with a similar number of beams and the same input and output positions."""
SEARCHES = {"paper": "paper's search", "basin-hopping": "default search"}
COLOURS = {"paper": style.INPUT, "basin-hopping": style.BEST}


@dataclass(frozen=True, slots=True, kw_only=True)
class Settings:
    """Number of lattices, and length of the searches."""

    lattices: int = 60
    steps: int = 4000
    first: int = 1


def run(settings: Settings, store: ResultStore) -> Figures:
    """Search on each disordered lattice, and as many times on the ordered one."""
    seeds = range(settings.first, settings.first + settings.lattices)
    found: dict[str, Any] = {}
    for search in SEARCHES:
        values = {"search": search, "steps": settings.steps}
        work = {str(seed): partial(on_discs, seed, values) for seed in seeds}
        disordered = store.compute_all(f"{search}-discs", work)
        again = {str(seed): partial(on_ordered, seed, values) for seed in seeds}
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
            search: {kind: _summary(values[kind]) for kind in ("discs", "ordered")}
            for search, values in found.items()
        },
    }


def _summary(values: Sequence[float | None]) -> dict[str, float]:
    known = np.array([value for value in values if value is not None])
    return {**quantiles(known), "mean": float(known.mean()), "deviation": float(known.std())}


def on_discs(seed: int, values: Mapping[str, Any]) -> dict[str, Any]:
    """Search on one packing; there is no design if input and output are not connected."""
    try:
        problem = discs(seed)
    except InvalidProblem:
        return {"efficiency": None, "mask": None}
    return _searched(problem, values, 0)


def on_ordered(seed: int, values: Mapping[str, Any]) -> dict[str, Any]:
    """Search on the ordered lattice with a given seed."""
    return _searched(find_problem(ORDERED), values, seed)


def _searched(problem: Problem, values: Mapping[str, Any], seed: int) -> dict[str, Any]:
    settings = read_settings({**values, "chains": 1, "seed": seed})
    try:
        chosen = best_design(problem, [run_chain(problem, settings)])
    except NoDesignFound:  # no design is stable and connected
        return {"efficiency": None, "mask": None}
    return {"efficiency": chosen.efficiency_after, "mask": chosen.design.mask_hex}


def draw(figures: Mapping[str, Any], path: Path) -> None:
    """Draw the best design, and the distributions of the efficiencies."""
    best = figures["searches"]["basin-hopping"]["best"]
    design = design_of(discs(best["seed"]), best["mask"])
    still = np.zeros((design.problem.lattice.node_count, 2))
    full = design.problem.full_design()
    response = respond(design)
    charts = []
    values = [
        value
        for summary in figures["searches"].values()
        for kind in ("discs", "ordered")
        for value in summary[kind]
        if value is not None
    ]
    bins = int(np.clip(np.sqrt(2.0 * figures["lattices"]), 5, 18))
    edges = np.linspace(min(values), max(values), bins + 1)
    for kind, title in (("discs", "Jammed packings"), ("ordered", "Ordered lattice")):
        series, levels = [], []
        for search, name in SEARCHES.items():
            known = [value for value in figures["searches"][search][kind] if value is not None]
            colour = COLOURS[search]
            middle = figures["summary"][search][kind]["median"]
            series.append(
                Series(
                    edges, np.array(known), name=f"{name}, median {middle:.2f}",
                    kind="histogram", colour=colour,
                )
            )  # fmt: skip
            levels.append(Level(middle, colour=colour, vertical=True))
        charts.append(
            Chart(title, "efficiency", "designs, %", series, levels,
                  legend="upper right", limits_y=(0.0, None))
        )  # fmt: skip
    sheet = Sheet(
        title=f"{figures['lattices']} disordered lattices and one ordered lattice",
        note=f"one chain of {count(figures['steps'], 'proposal')} each; the ordered lattice has "
        "a similar number of beams and is searched from as many seeds",
        motions=[
            Motion(full, still, name=f"Packing, seed {best['seed']}",
                   note=f"{full.beam_count} beams"),
            Motion(design, still, name="Best design", note=f"{design.beam_count} beams"),
            Motion(design, response.displacement, response.efficiency, name="Displaced",
                   magnify=10.0),
        ],
        charts=charts,
        at_rest=frozenset({0, 1}),
        height=2.5,
    )  # fmt: skip
    draw_sheet(sheet, path, overwrite=True)


def claims(figures: Mapping[str, Any]) -> list[Claim]:
    """Compare with the paper."""
    summary = figures["summary"]
    paper, own = summary["paper"], summary["basin-hopping"]
    return [
        Claim(
            "efficiency of designs on disordered lattices",
            "",
            f"{span(paper['discs']['least'], paper['discs']['largest'])}, median "
            f"{number(paper['discs']['median'])}, paper's search, {figures['usable']} of "
            f"{count(figures['lattices'], 'jammed packing')}",
            "discrete model, without unloaded beams",
        ),
        Claim(
            "median efficiency on disordered and on ordered lattices",
            "",
            f"paper's search {number(paper['discs']['median'])} and "
            f"{number(paper['ordered']['median'])}; default search "
            f"{number(own['discs']['median'])} and {number(own['ordered']['median'])}",
            "similar number of beams; ordered lattice from as many seeds",
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
        runs=lambda figures: (
            f"{count(figures['lattices'], 'lattice')}, {count(figures['steps'], 'proposal')} in "
            "each of two searches"
        ),
        deviations=(
            (
                "Packings without a connection of input and output, and searches without a stable "
                "connected design, are not counted."
            ),
            (
                "The packings are generated by our own code (discs of two sizes, ratio 1.4); the "
                "paper's packings are not available."
            ),
        ),
    )
)
