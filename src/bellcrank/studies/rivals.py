"""bellcrank and topology optimisation, on the same boxes, with the same mass, before one judge."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.fem.continuum.backend import ngsolve
from bellcrank.plots.shapes import Shape, draw_shapes
from bellcrank.search import read_settings
from bellcrank.studies.boxes import TASKS, Box, box_of
from bellcrank.studies.neutral import contour_of, judge, polygon_of
from bellcrank.studies.registry import Claim, Figures, Study, register
from bellcrank.studies.searching import best_design, run_chain
from bellcrank.studies.topology import optimise, pymoto
from bellcrank.studies.words import count, number

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from bellcrank.studies.bench import Bench

LAW = "neo-hookean"


@dataclass(frozen=True, slots=True, kw_only=True)
class Settings:
    """Boxes, and how hard both sides try.

    Parameters
    ----------
    columns, rows
        Of the lattice.
    stroke, spring
        In lattice units and units of the discrete model.
    steps, chains
        Of bellcrank's default search.
    element
        Of the rival, mm; its filter is two of them wide.
    springs
        Pairs at its input and output, in units of Young's modulus times thickness; the best
        result counts.
    triangle
        Of the judge, mm.
    """

    tasks: tuple[str, ...] = TASKS
    columns: int = 10
    rows: int = 11
    stroke: float = 0.2
    spring: float = 0.01
    steps: int = 8000
    chains: int = 3
    element: float = 1.0
    radius: float = 2.0
    springs: tuple[tuple[float, float], ...] = ((0.1, 0.1), (0.1, 0.01), (0.1, 0.001))
    iterations: int = 60
    triangle: float = 1.0


def run(settings: Settings, bench: Bench) -> Figures:
    """Let both sides design for each task, and judge them."""
    pymoto()
    ngsolve()
    return {
        "stroke_mm": 10.0 * settings.stroke,
        "spring": settings.spring,
        "iterations": settings.iterations,
        "steps": settings.steps,
        "chains": settings.chains,
        "tried": len(settings.springs),
        "tasks": {name: _task(name, settings, bench) for name in settings.tasks},
    }


def _task(name: str, settings: Settings, bench: Bench) -> dict[str, Any]:
    box = box_of(name, settings.columns, settings.rows, settings.stroke, settings.spring)
    told = {"search": "basin-hopping", "steps": settings.steps, "chains": settings.chains}
    search = read_settings(told)
    work = {str(k): partial(run_chain, box.problem, search, k) for k in range(settings.chains)}
    chains = list(bench.all(f"{name}-chain", work).values())
    chosen = best_design(box.problem, chains)
    part = box.spec.of(chosen.design)
    ours = polygon_of(part)
    size = float(np.prod(box.high - box.low))
    rivals = bench.all(
        f"{name}-rival",
        {
            f"{k}": partial(
                optimise, box, settings.element, ours.area / size, springs, settings.radius,
                settings.iterations,
            )
            for k, springs in enumerate(settings.springs)
        },
        workers=1,  # pyMOTO has one network at a time
    )  # fmt: skip
    scored = bench.all(
        f"{name}-rival-judged",
        {key: partial(_judged, box, each, ours.area, settings) for key, each in rivals.items()},
        workers=1,
    )
    best = max(scored, key=lambda key: scored[key].get("efficiency") or -np.inf)
    mine = bench.all(
        f"{name}-ours-judged",
        {"0": partial(judge, box, part, ours, settings.triangle, LAW)}, workers=1,
    )["0"]  # fmt: skip
    return {
        "box_mm": (box.high - box.low).tolist(),
        "volume": ours.area / size,
        "ports": _ports(box),
        "ours": {
            **_flat(mine),
            "mask": chosen.design.mask_hex,
            "model": chosen.efficiency_after,
            "design_seconds": sum(chain["seconds"] for chain in chains),
        },
        "rival": {
            **_flat(scored[best]),
            "springs": rivals[best]["springs"],
            "model": rivals[best]["output_over_input"],
            "design_seconds": rivals[best]["seconds"],
            "all_efficiencies": [scored[key].get("efficiency") for key in rivals],
        },
    }


def _flat(told: Mapping[str, Any]) -> dict[str, Any]:
    """Return a judgement whose curves are plain rows of numbers."""
    return {**told, "drawing": [np.ravel(curve).tolist() for curve in told["drawing"]]}


def _judged(box: Box, told: Mapping[str, Any], area: float, settings: Settings) -> dict[str, Any]:
    """Judge what the rival made, cut at the density that gives it the same mass."""
    shape = contour_of(box, np.array(told["density"]), area)
    if shape is None:
        return {"status": "in pieces", "efficiency": None, "drawing": []}
    part = box.spec.of(box.problem.full_design())
    return judge(box, part, shape, settings.triangle, LAW)


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


SIDES = {"ours": "bellcrank", "rival": "pyMOTO"}


def draw(figures: Mapping[str, Any], path: Path) -> None:
    """Draw all designs at rest and moved."""
    shapes = []
    for name, told in figures["tasks"].items():
        for side, words in SIDES.items():
            row, ports = told[side], told["ports"]
            score = number(row["efficiency"]) if row["efficiency"] else row["status"]
            shapes.append(
                Shape(
                    title=f"{name.capitalize()}, {words}",
                    notes=[
                        f"efficiency {score}",
                        (
                            f"{number(row.get('von_mises_MPa'), 1)} MPa, "
                            f"designed in {row['design_seconds']:.0f} s"
                        ),
                    ],
                    curves=[
                        np.reshape(curve, (-1, 4)) for curve in row["drawing"] if len(curve) > 8
                    ],
                    inputs=[tuple(port) for port in ports["input"]],
                    outputs=[tuple(port) for port in ports["output"]],
                    held=[tuple(place) for place in ports["held"]],
                )
            )
    draw_shapes(
        [shape for shape in shapes if shape.curves],
        path,
        title="Force inverter and gripper, by bellcrank and by topology optimisation",
        note="the same box, mass, material, stroke and output spring; one judge: "
        "the outlines in nonlinear plane stress",
        overwrite=True,
    )


def claims(figures: Mapping[str, Any]) -> list[Claim]:
    """Compare both sides; the paper has no such figures."""
    found = []
    for name, told in figures["tasks"].items():
        ours, rival = told["ours"], told["rival"]
        found.append(
            Claim(
                f"{name}: bellcrank against pyMOTO, judged alike",
                "",
                f"efficiency {_score(ours)} and {_score(rival)}; largest stress "
                f"{number(ours['von_mises_MPa'], 1)} and {number(rival.get('von_mises_MPa'), 1)} "
                f"MPa; input force {number(ours['input_force_N'])} and "
                f"{number(rival.get('input_force_N'))} N; designed in "
                f"{ours['design_seconds']:.0f} s and {rival['design_seconds']:.0f} s of one core; "
                f"area {number(ours['area_mm2'], 0)} and {number(rival.get('area_mm2'), 0)} mm²",
                f"{_verdict(ours, rival)}; pyMOTO by output spring, stiffest first: "
                + ", ".join(number(value) for value in rival["all_efficiencies"]),
            )
        )
    return found


def _score(row: Mapping[str, Any]) -> str:
    if row["efficiency"] is not None:
        return number(row["efficiency"])
    return str(row["status"])


def _verdict(ours: Mapping[str, Any], rival: Mapping[str, Any]) -> str:
    """Say who is ahead in what; nothing that the figures do not show."""
    ahead: dict[str, list[str]] = {"bellcrank": [], "pyMOTO": []}
    for words, key, more in (
        ("efficiency", "efficiency", True),
        ("stress", "von_mises_MPa", False),
        ("input force (less)", "input_force_N", False),
        ("time", "design_seconds", False),
    ):
        mine, other = ours.get(key), rival.get(key)
        if mine is None and other is None:
            continue
        if other is None or (mine is not None and (mine > other) == more):
            ahead["bellcrank"].append(words)
        else:
            ahead["pyMOTO"].append(words)
    told = [f"{side} is ahead in {', '.join(what)}" for side, what in ahead.items() if what]
    return "; ".join(told)


def runs(figures: Mapping[str, Any]) -> str:
    """Say how hard both sides tried."""
    return (
        f"bellcrank: {count(figures['chains'], 'chain')} of "
        f"{count(figures['steps'], 'proposal')}; pyMOTO: the best of "
        f"{count(figures['tried'], 'setting')}, {count(figures['iterations'], 'iteration')} each"
    )


STUDY = register(
    Study(
        name="rivals",
        title="Against topology optimisation, before one judge",
        after="not in the paper",
        full=Settings(),
        quick=Settings(
            tasks=("inverter",), columns=6, rows=7, steps=1500, chains=1,
            springs=((0.1, 0.01),), iterations=40, triangle=2.0,
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
            "The rival's time is that of its best setting alone; bellcrank's is of all chains.",
            "Struts that touch pass through each other, on both sides.",
        ),
    )
)  # fmt: skip
