"""Comparison with topology optimisation: same tasks, same mass, same analysis."""

from __future__ import annotations

import time
from dataclasses import replace
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.fem.continuum.backend import ngsolve
from bellcrank.model import Item
from bellcrank.refine import RefinementSettings, refine_design
from bellcrank.refine.shape import volume_of
from bellcrank.search import read_settings, specified, verification_evaluator
from bellcrank.search.choice import FirstWithoutFault
from bellcrank.search.verification import Verifier
from bellcrank.workflows import complete_design, start_design
from bellcrank.workflows.refinement import BEFORE_REFINEMENT
from reproduction.boxes import Box, box_of
from reproduction.outline_analysis import analyse_outline, narrowest, polygon_of
from reproduction.registry import Figures, Study, register
from reproduction.rivals_report import claims, draw, runs
from reproduction.rivals_settings import Settings
from reproduction.searching import (
    best_design,
    design_of,
    design_with,
    geometry_of,
    run_chains,
)
from reproduction.straight_lift import straight_lift
from reproduction.topology_designs import packages, rival_designs

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from shapely import Polygon

    from reproduction.result_store import ResultStore

LAW = "neo-hookean"
STRAIN_SHARES = (0.9, 0.75, 0.6)
"""Limits of the strain, as parts of that of the other method, until the stress is not higher."""
STRESS_SEEDS = (0, 1)
"""Seeds of the searches with a limit of the strain."""


def run(settings: Settings, store: ResultStore) -> Figures:
    """Design each task by each method, and analyse the results."""
    taking_part = packages()
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
        "tried": len(settings.springs) * len(settings.radii),
        "tasks": {box[0]: _task(*box, settings, store, taking_part) for box in settings.boxes},
        "lift": straight_lift(settings, store, taking_part) if settings.lift else None,
    }


def _task(
    title: str,
    task: str,
    columns: int,
    rows: int,
    settings: Settings,
    store: ResultStore,
    taking_part: Sequence[str],
) -> dict[str, Any]:
    box = box_of(task, columns, rows, settings.stroke, settings.spring, settings.width)
    name = title.replace(" ", "-")
    ours, shape = _ours(box, name, settings, store)
    size = float(np.prod(box.high - box.low))
    rows_of, shapes = {"ours": ours}, {"ours": shape}
    for package in taking_part:
        rows_of[package], other = _rival(package, box, name, shape.area / size, settings, store)
        shapes[package] = other
    finer = store.compute_all(
        f"{name}-finer",
        {side: partial(_analysed, box, each, settings.finer) for side, each in shapes.items()},
        workers=1,
    )
    for side, row in rows_of.items():
        row["efficiency_finer"] = finer[side]["efficiency"]
    rivals = {package: rows_of[package] for package in taking_part}
    best = min(rivals.values(), key=_rank)
    return {
        "box_mm": (box.high - box.low).tolist(),
        "volume": shape.area / size,
        "ports": _ports(box),
        "ours": ours,
        "rivals": rivals,
        "ours_at_no_higher_stress": _at_no_higher_stress(box, name, ours, best, settings, store),
    }


def _at_no_higher_stress(
    box: Box,
    name: str,
    ours: Mapping[str, Any],
    rival: Mapping[str, Any],
    settings: Settings,
    store: ResultStore,
) -> dict[str, Any] | None:
    """Return figures of bellcrank's design with at most the stress of the best other design.

    Where the stress of the best design is higher, designs are searched and refined with a limit of
    the strain and at most the same mass. None if no limit suffices.
    """
    highest = rival.get("von_mises_MPa", np.inf)
    if ours["von_mises_MPa"] <= highest:
        return _stressed(ours)
    best = design_with(box.problem, ours)
    mass = volume_of(best.problem, best.mask)[0]
    for share in STRAIN_SHARES:
        limit = share * rival["principal_strain"]
        found = []
        for seed in STRESS_SEEDS:
            key = f"{name}-strain-{share:g}-{seed}"
            work = partial(_limited, box, limit, mass, seed, settings.chains)
            shape = polygon_of(box.spec.of(design_with(box.problem, store.compute(key, work))))
            judge = partial(_analysed, box, shape, settings.triangle)
            found.append(store.compute(f"{key}-judged", judge))
        good = [row for row in found if row["efficiency"] and row["von_mises_MPa"] <= highest]
        if good:
            return _stressed(min(good, key=_rank))
    return None


def _limited(box: Box, limit: float, mass: float, seed: int, chains: int) -> Any:
    """Search and refine for the largest gain with a limit of the strain and of the mass."""
    problem = specified(box.problem, limit)
    wanted = problem.specification
    assert wanted is not None
    items = (*wanted.items, Item(quantity="mass", at_most=mass))
    problem = replace(problem, specification=replace(wanted, items=items))
    settings = read_settings({**BEFORE_REFINEMENT, "chains": chains, "seed": seed})
    with TemporaryDirectory() as temporary:
        report = complete_design(start_design(problem, settings, Path(temporary) / "run", box.spec))
    assert report is not None
    return geometry_of(report.selection.design)


def _stressed(row: Mapping[str, Any]) -> dict[str, Any]:
    return {key: row[key] for key in ("efficiency", "von_mises_MPa", "area_mm2", "narrowest_mm")}


def _ours(
    box: Box, name: str, settings: Settings, store: ResultStore
) -> tuple[dict[str, Any], Polygon]:
    """Return the analysis and the outline of bellcrank's best design for a task."""
    tried, shapes = [], []
    for goals in settings.goals:
        values = {
            "search": "basin-hopping",
            "steps": settings.steps,
            "chains": settings.chains,
            "goals": goals,
        }
        key = "-".join([name, *goals]).replace(" ", "-")
        chains = run_chains(store, f"{key}-chain", box.problem, values, settings.chains)
        chosen = store.compute(f"{key}-chosen", partial(_chosen, box, chains, values))
        refined = store.compute(f"{key}-refined", partial(_refined, box, chosen["mask"]))
        seconds = sum(chain["seconds"] for chain in chains)
        for each, way in ((chosen, "search"), (refined, "refinement")):
            seconds += each["seconds"]
            shape = polygon_of(box.spec.of(design_with(box.problem, each)))
            score = store.compute(
                f"{key}-{way}-judged", partial(_analysed, box, shape, settings.triangle)
            )
            tried.append(
                {
                    "goals": list(goals),
                    "by": way,
                    **{key: value for key, value in each.items() if key != "seconds"},
                    "design_seconds": seconds,
                    **_flat(score),
                }
            )
            shapes.append(shape)
    best = min(range(len(tried)), key=lambda k: _rank(tried[k]))
    return {**tried[best], "tried": _table(tried, "goals", "by", "model")}, shapes[best]


def _chosen(box: Box, chains: Sequence[Mapping[str, Any]], values: Mapping[str, Any]) -> Any:
    """Return the best candidate of the chains without a fault."""
    settings = read_settings(dict(values))
    began = time.thread_time()
    evaluator = verification_evaluator(box.problem, settings)
    limit = box.spec.registered_material.strain_limit
    choose = FirstWithoutFault(Verifier(box.problem, settings, limit))
    found = best_design(box.problem, chains, evaluator, choose)
    return {
        "mask": found.design.mask_hex,
        "model": found.efficiency_after,
        "seconds": time.thread_time() - began,
    }


def _refined(box: Box, mask: str) -> Any:
    """Refine a design at equal mass and equal least width, without contact."""
    began = time.thread_time()
    limit = box.spec.registered_material.strain_limit
    settings = RefinementSettings(same_mass=True)
    found = refine_design(design_of(box.problem, mask), settings, strain_limit=limit)
    return {
        **geometry_of(found.design),
        "model": found.after.objective,
        "seconds": time.thread_time() - began,
    }


def _rank(row: Mapping[str, Any]) -> float:
    """Return how bad a design is: its negative efficiency."""
    return -row["efficiency"] if row["efficiency"] else np.inf


def _table(tried: Sequence[Mapping[str, Any]], *of: str) -> list[dict[str, Any]]:
    """Return a summary of the attempts."""
    short = (*of, "efficiency", "design_seconds")
    return [{key: each[key] for key in short} for each in tried]


def _rival(
    package: str, box: Box, name: str, volume: float, settings: Settings, store: ResultStore
) -> tuple[dict[str, Any], Polygon | None]:
    """Return the analysis and the outline of the best design of a volume by a package."""

    def score(shape: Polygon | None) -> dict[str, Any]:
        return _flat(_analysed(box, shape, settings.triangle))

    tried = rival_designs(package, box, name, volume, settings, store, score)
    best, shape = min(tried, key=lambda each: _rank(each[0]))
    return {**best, "tried": _table([row for row, _ in tried], "springs", "radius")}, shape


def _flat(result: Mapping[str, Any]) -> dict[str, Any]:
    """Return an analysis with its curves as flat lists."""
    return {**result, "drawing": [np.ravel(curve).tolist() for curve in result["drawing"]]}


def _analysed(box: Box, shape: Polygon | None, triangle: float) -> dict[str, Any]:
    """Analyse an outline; None means that input, output and support are not connected."""
    if shape is None:
        return {"status": "not connected", "efficiency": None, "drawing": []}
    part = box.spec.of(box.problem.full_design())
    return {
        **analyse_outline(box, part, shape, triangle, LAW),
        "narrowest_mm": narrowest(box, shape),
    }


def _ports(box: Box) -> dict[str, Any]:
    problem, points = box.problem, box.positions
    return {
        "input": [
            [*points[node].tolist(), *way]
            for node, way in zip(
                problem.input.nodes.tolist(), problem.input.direction.tolist(), strict=True
            )
        ],
        "output": [
            [*points[node].tolist(), *way]
            for node, way in zip(
                problem.output.nodes.tolist(), problem.output.direction.tolist(), strict=True
            )
        ],
        "held": points[problem.supports.fixed].tolist(),
    }


STUDY = register(
    Study(
        name="rivals",
        title="Comparison with topology optimisation",
        after="not part of the paper",
        full=Settings(),
        quick=Settings(
            boxes=(("small inverter", "inverter", 6, 7),), steps=1500, chains=1, goals=((),),
            springs=((0.1, 0.01),), radii=(2.0,), iterations=40, triangle=2.0, finer=1.5,
            lift=("straight lift", 6, 7), lift_seeds=1,
        ),
        run=run,
        draw=draw,
        claims=claims,
        runs=runs,
        deviations=(
            (
                "pyMOTO and topoptlab maximise the small output displacement under a given input "
                "force, with the settings of their own examples: density filter and moving "
                "asymptotes, and sensitivity filter and optimality criteria; the comparison uses "
                "output over input displacement at a given stroke."
            ),
            (
                "Their densities are cut at the level that gives the mass of bellcrank's design, "
                "or at the highest level at which the design is connected; loose pieces are "
                "removed."
            ),
            (
                "topoptlab takes part, as a separate program, where the environment variable "
                "BELLCRANK_TOPOPTLAB is the path of a Python interpreter that has it; the table "
                "names the packages that took part."
            ),
            (
                "The best result of several settings is reported for each method: springs at input "
                "and output and the filter; with and without mirror symmetry. The times are of "
                "the best settings with all their chains."
            ),
            (
                "The models of both are linear, and no printable minimum width is imposed. "
                "bellcrank's frames are nonlinear; their struts are at least 1.3 mm wide, about "
                "the narrowest width of the designs by pyMOTO. After the search, nodes are moved "
                "and struts widened at equal mass."
            ),
            (
                "The straight lift is scored on the whole specification in nonlinear plane stress: "
                "gain, off-axis motion, rotation, sag, payload and strain. bellcrank designs for "
                "it; the others maximise the gain, pyMOTO also with a linear limit on the off-axis "
                "motion, and the design with the least sum of violations is reported."
            ),
            (
                "Where the largest stress of bellcrank's best design is higher than that of the "
                "best other design, a second design is searched and refined with a limit of the "
                "strain, at most the same mass and without contact, and is given beside it."
            ),
            "Contact is not modelled for any method.",
        ),
    )
)  # fmt: skip

register(
    replace(
        STUDY,
        name="rivals-wide",
        title="Comparison with topology optimisation, struts of 2 mm",
        full=Settings(width=2.0, lift=None),
        quick=replace(STUDY.quick, width=2.0, lift=None),
        deviations=(
            (
                "As the study `rivals`, with the usual struts of 2 mm instead of 1.3 mm, and each "
                "design of the other methods with the mass of bellcrank's. The straight lift is "
                "left out."
            ),
        ),
    )
)
