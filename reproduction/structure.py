"""What the method starts from, does and ends with: the crane, full, searched and moved."""

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
    """One problem, and the chains whose best design is shown."""

    problem: str = "crane"
    steps: int = 20_000
    chains: int = 4
    seed: int = 0


def run(settings: Settings, store: ResultStore) -> Figures:
    """Count what the lattice has, and search by the paper's rule."""
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
    """Draw the lattice with its regions, the design, and the design moved."""
    problem = find_problem(figures["problem"])
    still = np.zeros((problem.lattice.node_count, 2))
    full, machine = problem.full_design(), design_of(problem, figures["machine"]["mask"])
    evaluator = SpringEvaluator(problem)
    told = evaluator.evaluate(machine.mask)
    lattice = f"{figures['nodes']} nodes, {figures['beams']} beams"
    sheet = Sheet(
        title=f"{problem.name}: the lattice, what is removed, and how the rest moves",
        note=f"{count(figures['chains'], 'chain')} of {count(figures['steps'], 'proposal')} "
        "by the paper's rule; the best design, cleaned of what carries no load",
        motions=[
            Motion(full, still, name="Full lattice",
                   note=f"{lattice}, {figures['designable']} designable"),
            Motion(machine, still, name="Designed",
                   note=f"{figures['machine']['beams']} beams left"),
            Motion(machine, told.displacement, told.efficiency, name="Moved"),
        ],
        still=frozenset({0, 1}),
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
            "the same energy",
        ),
        Claim(
            "the full lattice hardly moves its output; removing beams makes an actuator of it",
            "",
            f"efficiency {number(figures['efficiency_of_full_lattice'], 3)} with "
            f"{figures['beams']} beams, {number(machine['efficiency'])} with {machine['beams']}",
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
        runs=lambda told: (
            f"{count(told['chains'], 'chain')} of {count(told['steps'], 'proposal')}"
        ),
        deviations=(
            "The paper's own designs are not at hand; the design shown is ours.",
        ),
    )
)  # fmt: skip
