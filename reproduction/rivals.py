"""bellcrank and topology optimisation, on the same boxes, with the same mass, before one judge."""

from __future__ import annotations

import itertools
import time
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.fem.continuum.backend import ngsolve
from bellcrank.search import read_settings
from bellcrank.workflows.choosing import PartChoice
from bellcrank.workflows.design import judge_for
from reproduction.boxes import Box, box_of
from reproduction.outline_analysis import contour_of, judge, narrowest, polygon_of
from reproduction.registry import Figures, Study, register
from reproduction.rivals_shown import claims, draw, runs
from reproduction.searching import best_design, design_of, run_chains
from reproduction.topology import optimise, pymoto

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from shapely import Polygon

    from reproduction.result_store import ResultStore

LAW = "neo-hookean"


@dataclass(frozen=True, slots=True, kw_only=True)
class Settings:
    """Boxes, and how hard both sides try.

    Parameters
    ----------
    boxes
        A title, a task, columns and rows of the lattice.
    stroke, spring
        In lattice units and units of the discrete model.
    width
        Of bellcrank's struts, mm: about what the narrowest places of the rival's designs have.
    steps, chains
        Of bellcrank's default search.
    goals
        What its designs keep to: each is tried, the best result counts.
    element
        Of the rival, mm.
    radii
        Of its filter, elements. The first is that of its examples.
    springs
        Pairs at its input and output, in units of Young's modulus times thickness; the best
        result counts.
    triangle, finer
        Of the judge, mm; the finer ones show how far its word depends on them.
    """

    boxes: tuple[tuple[str, str, int, int], ...] = (
        ("inverter", "inverter", 10, 11),
        ("gripper", "gripper", 10, 11),
        ("small inverter", "inverter", 6, 7),
    )
    stroke: float = 0.2
    spring: float = 0.01
    width: float = 1.3
    steps: int = 8000
    chains: int = 3
    goals: tuple[tuple[str, ...], ...] = ((), ("mirror y",))
    element: float = 1.0
    radii: tuple[float, ...] = (2.0, 1.5)
    springs: tuple[tuple[float, float], ...] = tuple(itertools.product((0.1, 1.0), (0.007, 0.005)))
    iterations: int = 100
    triangle: float = 1.0
    finer: float = 0.7


def run(settings: Settings, store: ResultStore) -> Figures:
    """Let both sides design for each task, and judge them."""
    pymoto()
    ngsolve()
    return {
        "stroke_mm": 10.0 * settings.stroke,
        "triangles_mm": [settings.triangle, settings.finer],
        "spring": settings.spring,
        "iterations": settings.iterations,
        "steps": settings.steps,
        "chains": settings.chains,
        "width_mm": settings.width,
        "goals": [list(goals) for goals in settings.goals],
        "tried": len(settings.springs) + len(settings.radii) - 1,
        "tasks": {box[0]: _task(*box, settings, store) for box in settings.boxes},
    }


def _task(
    title: str, task: str, columns: int, rows: int, settings: Settings, store: ResultStore
) -> dict[str, Any]:
    box = box_of(task, columns, rows, settings.stroke, settings.spring, settings.width)
    name = title.replace(" ", "-")
    ours, shape = _ours(box, name, settings, store)
    size = float(np.prod(box.high - box.low))
    rival, other = _rival(box, name, shape.area / size, settings, store)
    finer = store.compute_all(
        f"{name}-finer",
        {
            side: partial(_judged, box, each, settings.finer)
            for side, each in (("ours", shape), ("rival", other))
        },
        workers=1,
    )
    for side, row in (("ours", ours), ("rival", rival)):
        row["efficiency_finer"] = finer[side]["efficiency"]
    return {
        "box_mm": (box.high - box.low).tolist(),
        "volume": shape.area / size,
        "ports": _ports(box),
        "ours": ours,
        "rival": rival,
    }


def _ours(
    box: Box, name: str, settings: Settings, store: ResultStore
) -> tuple[dict[str, Any], Polygon]:
    """Return the best that bellcrank makes of a task, judged, and its shape."""
    tried, shapes = [], []
    for goals in settings.goals:
        told = {
            "search": "basin-hopping",
            "steps": settings.steps,
            "chains": settings.chains,
            "goals": goals,
        }
        key = "-".join([name, *goals]).replace(" ", "-")
        chains = run_chains(store, f"{key}-chain", box.problem, told, settings.chains)
        chosen = store.compute(f"{key}-chosen", partial(_chosen, box, chains, told))
        shape = polygon_of(box.spec.of(design_of(box.problem, chosen["mask"])))
        score = store.compute(f"{key}-ours-judged", partial(_judged, box, shape, settings.triangle))
        seconds = sum(chain["seconds"] for chain in chains) + chosen["seconds"]
        tried.append(
            {
                "goals": list(goals),
                "mask": chosen["mask"],
                "model": chosen["model"],
                "design_seconds": seconds,
                **_flat(score),
            }
        )
        shapes.append(shape)
    best = _best(tried)
    return {**tried[best], "tried": _table(tried, "goals")}, shapes[best]


def _chosen(box: Box, chains: Sequence[Mapping[str, Any]], told: Mapping[str, Any]) -> Any:
    """Return the design that frames choose from what the chains found, as for any part."""
    settings = read_settings(dict(told))
    began = time.thread_time()
    judge = judge_for(box.problem, settings)
    found = best_design(box.problem, chains, judge, PartChoice(box.spec, settings))
    return {
        "mask": found.design.mask_hex,
        "model": found.efficiency_after,
        "seconds": time.thread_time() - began,
    }


def _best(tried: Sequence[Mapping[str, Any]]) -> int:
    return max(range(len(tried)), key=lambda k: tried[k]["efficiency"] or -np.inf)


def _table(tried: Sequence[Mapping[str, Any]], *of: str) -> list[dict[str, Any]]:
    """Return what was tried in short, from rows with all that is known."""
    short = (*of, "model", "efficiency", "design_seconds")
    return [{key: each[key] for key in short} for each in tried]


def _rival(
    box: Box, name: str, volume: float, settings: Settings, store: ResultStore
) -> tuple[dict[str, Any], Polygon | None]:
    """Return the best that the rival makes of a task with a volume, judged, and its shape.

    All springs are tried with the first filter, all filters with the best springs.
    """
    area = volume * float(np.prod(box.high - box.low))
    tried: list[dict[str, Any]] = []
    shapes: list[Polygon | None] = []

    def attempt(springs: tuple[float, float], radius: float) -> None:
        key = f"{springs[0]:g}-{springs[1]:g}-{radius:g}"
        work = partial(
            optimise, box, settings.element, volume, springs, radius, settings.iterations
        )
        made = store.compute(f"{name}-rival-{key}", work)
        shape = contour_of(box, np.array(made["density"]), area)
        score = store.compute(
            f"{name}-rival-judged-{key}", partial(_judged, box, shape, settings.triangle)
        )
        tried.append(
            {
                "springs": list(springs),
                "radius": radius,
                "model": made["output_over_input"],
                "design_seconds": made["seconds"],
                **_flat(score),
            }
        )
        shapes.append(shape)
        store.progress(f"{name}-rival", len(tried), len(settings.springs) + len(settings.radii) - 1)

    for springs in settings.springs:
        attempt(springs, settings.radii[0])
    good = tuple(tried[_best(tried)]["springs"])
    for radius in settings.radii[1:]:
        attempt(good, radius)
    best = _best(tried)
    return {**tried[best], "tried": _table(tried, "springs", "radius")}, shapes[best]


def _flat(told: Mapping[str, Any]) -> dict[str, Any]:
    """Return a judgement whose curves are plain rows of numbers."""
    return {**told, "drawing": [np.ravel(curve).tolist() for curve in told["drawing"]]}


def _judged(box: Box, shape: Polygon | None, triangle: float) -> dict[str, Any]:
    """Judge a shape; None is one that does not hold together."""
    if shape is None:
        return {"status": "in pieces", "efficiency": None, "drawing": []}
    part = box.spec.of(box.problem.full_design())
    return {**judge(box, part, shape, triangle, LAW), "narrowest_mm": narrowest(box, shape)}


def _ports(box: Box) -> dict[str, Any]:
    problem, places = box.problem, box.positions
    return {
        "input": [
            [*places[node].tolist(), *way]
            for node, way in zip(
                problem.input.nodes.tolist(), problem.input.direction.tolist(), strict=True
            )
        ],
        "output": [
            [*places[node].tolist(), *way]
            for node, way in zip(
                problem.output.nodes.tolist(), problem.output.direction.tolist(), strict=True
            )
        ],
        "held": places[problem.supports.fixed].tolist(),
    }


STUDY = register(
    Study(
        name="rivals",
        title="Against topology optimisation, before one judge",
        after="not in the paper",
        full=Settings(),
        quick=Settings(
            boxes=(("small inverter", "inverter", 6, 7),), steps=1500, chains=1, goals=((),),
            springs=((0.1, 0.01),), radii=(2.0,), iterations=40, triangle=2.0, finer=1.5,
        ),
        run=run,
        draw=draw,
        claims=claims,
        runs=runs,
        deviations=(
            (
                "The rival maximises small motions of the output under a given input force, as its "
                "examples do; output over input at a given stroke is what is judged here."
            ),
            (
                "Its densities are cut at the level that gives bellcrank's mass, or at the highest "
                "at which it still holds together; loose pieces go."
            ),
            (
                "What suits each side is tried, and the judge takes the best: springs at input and "
                "output, then the filter; mirror symmetry or none. The times are those of the best "
                "settings alone, with all their chains."
            ),
            (
                "The rival's model is linear and knows no stroke, and nothing holds it to a width "
                "that can be printed; bellcrank's springs are nonlinear, its struts 1.3 mm wide, "
                "about as wide as the narrowest places of the rival's designs."
            ),
            (
                "Width decides: with struts 2 mm wide, chosen by the model alone, bellcrank had "
                "3.81, 2.21 and 2.26, and the rival at that mass 4.04, 2.59 and 3.26 "
                "(`docs/studies/wide/rivals.json`)."
            ),
            "Struts that touch pass through each other, on both sides.",
        ),
    )
)  # fmt: skip
