"""From the full lattice to an actuator: the crane at rest, searched, and displaced."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.mechanics import SpringEvaluator
from bellcrank.model import find_problem
from bellcrank.plots import Motion
from reproduction import published
from reproduction.formatting import count, number
from reproduction.pictures.sheets import Sheet, draw_sheet
from reproduction.registry import Claim, Figures, Study, register
from reproduction.searching import best_design, design_of, run_chains

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from reproduction.result_store import ResultStore


@dataclass(frozen=True, slots=True, kw_only=True)
class Settings:
    """Problem, and the chains whose best design is shown."""

    problem: str = "crane"
    steps: int = 20_000
    chains: int = 4
    seed: int = 0


def run(settings: Settings, store: ResultStore) -> Figures:
    """Count nodes and beams, and run the paper's search."""
    problem = find_problem(settings.problem)
    search = {"search": "paper", "steps": settings.steps, "seed": settings.seed}
    chains = run_chains(store, "chain", problem, search, settings.chains)
    chosen = best_design(problem, chains)
    whole = SpringEvaluator(problem).evaluate(problem.initial)
    lattice, given = problem.lattice, problem.input
    return {
        "problem": settings.problem,
        "nodes": lattice.node_count,
        "beams": lattice.beam_count,
        "designable": len(problem.designable),
        "support_nodes": len(problem.supports.fixed),
        "input_nodes": len(given.nodes),
        "output_nodes": len(problem.output.nodes),
        "stroke": given.amount,
        "bond_stiffness": problem.stiffness.bond,
        "angle_stiffness": problem.stiffness.angle,
        "efficiency_of_full_lattice": whole.efficiency,
        "chains": settings.chains,
        "steps": settings.steps,
        "machine": {
            "mask": chosen.design.mask_hex,
            "beams": chosen.design.beam_count,
            "efficiency": chosen.efficiency_after,
            "before_cleaning": chosen.efficiency_before,
        },
    }


def draw(figures: Mapping[str, Any], path: Path) -> None:
    """Draw the full lattice, the design at rest, and the displaced design."""
    problem = find_problem(figures["problem"])
    still = np.zeros((problem.lattice.node_count, 2))
    full, machine = problem.full_design(), design_of(problem, figures["machine"]["mask"])
    evaluator = SpringEvaluator(problem)
    response = evaluator.evaluate(machine.mask)
    lattice = f"{figures['nodes']} nodes, {figures['beams']} beams"
    sheet = Sheet(
        title=f"{problem.name}: full lattice, design, and displaced design",
        note=f"{count(figures['chains'], 'chain')} of {count(figures['steps'], 'proposal')} "
        "of the paper's search; best design without unloaded beams",
        motions=[
            Motion(full, still, name="Full lattice",
                   note=f"{lattice}, {figures['designable']} designable"),
            Motion(machine, still, name="Design",
                   note=f"{figures['machine']['beams']} beams"),
            Motion(machine, response.displacement, response.efficiency, name="Displaced"),
        ],
        at_rest=frozenset({0, 1}),
    )  # fmt: skip
    draw_sheet(sheet, path, overwrite=True)


def claims(figures: Mapping[str, Any]) -> list[Claim]:
    """Compare with the paper."""
    machine = figures["machine"]
    return [
        Claim(
            "stiffness of beams and of angular springs",
            f"{published.BOND:g} and {published.ANGLE:g}",
            f"{figures['bond_stiffness']:g} and {figures['angle_stiffness']:g}",
            "same energy",
        ),
        Claim(
            "efficiency of the full lattice and of the design",
            "",
            f"{number(figures['efficiency_of_full_lattice'], 3)} ({figures['beams']} beams) and "
            f"{number(machine['efficiency'])} ({machine['beams']} beams)",
            "discrete model",
        ),
    ]


STUDY = register(
    Study(
        name="structure",
        title="From a full lattice to an actuator",
        after="figure 1",
        full=Settings(),
        quick=Settings(steps=2000, chains=2),
        run=run,
        draw=draw,
        claims=claims,
        runs=lambda figures: (
            f"{count(figures['chains'], 'chain')} of {count(figures['steps'], 'proposal')}"
        ),
        deviations=(
            "The paper's own designs are not available; the design shown is ours.",
        ),
    )
)  # fmt: skip
