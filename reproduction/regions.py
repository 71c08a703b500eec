"""Functional regions of a design: occlusion maps of a network and exact sensitivities."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, partial
from typing import TYPE_CHECKING, Any

from bellcrank.model import Design, find_problem
from reproduction.formatting import number
from reproduction.predictions import one_thread
from reproduction.registry import Claim, Figures, Study, register
from reproduction.searching import design_of, run_chain

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from reproduction.networks.attribution import Attribution
    from reproduction.result_store import ResultStore

MEASURES = ("white", "black", "network", "low_rank")


@dataclass(frozen=True, slots=True, kw_only=True)
class Settings:
    """The analysed designs, the best of short chains of the paper's search.

    Parameters
    ----------
    problem
        Bundled problem.
    chains
        Number of chains; the design of the first is drawn.
    steps
        Length of the chains, as in the training set of the network.
    stride
        Distance between the positions of the occluding block, pixels.
    """

    problem: str = "crane"
    chains: int = 4
    steps: int = 582
    stride: int = 4


def run(settings: Settings, store: ResultStore) -> Figures:
    """Compute the attribution of each design."""
    from bellcrank.search import read_settings

    problem = find_problem(settings.problem)
    values = {"search": "paper", "steps": settings.steps, "seed": 2_000_000}
    search = read_settings({**values, "chains": settings.chains})
    rows = []
    store.progress("designs", 0, settings.chains)
    for chain in range(settings.chains):
        found = store.compute(f"chain-{chain}", partial(run_chain, problem, search, chain))
        mask = found["offered"][0]["mask"]
        rows.append(
            store.compute(
                f"attribution-{chain}", partial(_agreement, settings.problem, mask, settings.stride)
            )
        )
        store.progress("designs", chain + 1, settings.chains)
    return {
        "problem": settings.problem,
        "steps": settings.steps,
        "stride": settings.stride,
        "designs": rows,
        "mean": {
            name: _mean([row["rank_correlations"][name] for row in rows]) for name in MEASURES
        },
    }


def _mean(values: list[float | None]) -> float | None:
    known = [value for value in values if value is not None]
    return sum(known) / len(known) if known else None


@cache
def attribution_of(name: str, mask: str, stride: int) -> Attribution:
    """Return the attribution of the bundled network and the exact sensitivities of a design."""
    from bellcrank.surrogate.predictor import load_model
    from reproduction.networks.attribution import attribute

    design: Design = design_of(find_problem(name), mask)
    with one_thread():
        return attribute(load_model(design.problem), design, stride=stride)


def _agreement(name: str, mask: str, stride: int) -> dict[str, Any]:
    """Return the agreement of an attribution with the exact sensitivities."""
    found = attribution_of(name, mask, stride).to_dict()
    return {
        "mask": mask,
        "efficiency": found["efficiency"],
        "predicted": found["predicted"],
        "rank_correlations": found["correlations"],
    }


def draw(figures: Mapping[str, Any], path: Path) -> None:
    """Draw the attribution and the exact sensitivities of the first design."""
    from reproduction.networks.attribution_picture import draw_attribution

    first = figures["designs"][0]
    found = attribution_of(figures["problem"], first["mask"], figures["stride"])
    draw_attribution(found, path, overwrite=True)


def claims(figures: Mapping[str, Any]) -> list[Claim]:
    """Compare with the paper."""
    means = figures["mean"]
    ranks = ", ".join(
        f"{label} {number(means[name])}"
        for name, label in (
            ("white", "white block"), ("black", "black block"),
            ("network", "flips predicted by the network"),
            ("low_rank", "flips predicted by low-rank updates"),
        )
    )  # fmt: skip
    return [
        Claim(
            "occlusion maps show functional regions",
            "shown as pictures",
            f"rank correlation with the exact change of efficiency by flips: {ranks}",
            f"means over {len(figures['designs'])} designs; white blocks are compared for present "
            "beams, black blocks for absent beams",
        ),
    ]


STUDY = register(
    Study(
        name="regions",
        title="Functional regions: occlusion maps and exact sensitivities",
        after="maps of functional regions",
        full=Settings(),
        quick=Settings(chains=1, stride=8),
        run=run,
        draw=draw,
        claims=claims,
        runs=lambda figures: f"{len(figures['designs'])} designs",
        deviations=(
            "The network is the bundled ResNet-18, not the paper's ResNet50.",
            "The exact change of the efficiency by each flip is computed for comparison.",
        ),
    )
)
