"""Which regions of a design matter: occlusion maps of a network against exact sensitivities."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, partial
from typing import TYPE_CHECKING, Any

from bellcrank.model import Design, find_problem
from reproduction.formatting import number, percent
from reproduction.predicting import one_thread
from reproduction.registry import Claim, Figures, Study, register
from reproduction.searching import design_of, run_chain

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from reproduction.networks.attribution import Attribution
    from reproduction.result_store import ResultStore

MEASURES = ("low_rank", "network", "occlusion", "white", "black")


@dataclass(frozen=True, slots=True, kw_only=True)
class Settings:
    """Which designs are looked at: the best ones of so many short chains of the paper's search.

    Parameters
    ----------
    chains
        How many; the first is drawn.
    steps
        As long as the runs that the network has learnt from.
    stride
        Pixels between places of the blocks that hide parts of the picture.
    """

    problem: str = "crane"
    chains: int = 4
    steps: int = 582
    stride: int = 4


def run(settings: Settings, store: ResultStore) -> Figures:
    """Explain each design."""
    from bellcrank.search import read_settings

    problem = find_problem(settings.problem)
    told = {"search": "paper", "steps": settings.steps, "seed": 2_000_000}
    search = read_settings({**told, "chains": settings.chains})
    rows = []
    store.progress("designs", 0, settings.chains)
    for chain in range(settings.chains):
        found = store.compute(f"chain-{chain}", partial(run_chain, problem, search, chain))
        mask = found["offered"][0]["mask"]
        rows.append(
            store.compute(f"seen-{chain}", partial(_told, settings.problem, mask, settings.stride))
        )
        store.progress("designs", chain + 1, settings.chains)
    names = [name for name in MEASURES if name in rows[0]["agreement"]]
    return {
        "problem": settings.problem,
        "steps": settings.steps,
        "stride": settings.stride,
        "designs": rows,
        "mean": {
            name: {
                kind: _mean([row["agreement"][name][kind] for row in rows])
                for kind in ("pearson", "spearman", "recall")
            }
            for name in names
        },
        "vital_shared": _mean([row["vital_shared"] for row in rows]),
    }


def _mean(values: list[float | None]) -> float | None:
    known = [value for value in values if value is not None]
    return sum(known) / len(known) if known else None


@cache
def explained(name: str, mask: str, stride: int) -> Attribution:
    """Return what the network that comes along makes of a design, and what is there."""
    from bellcrank.surrogate.predictor import load_model
    from reproduction.networks.attribution import Block, attribute

    design: Design = design_of(find_problem(name), mask)
    with one_thread():
        return attribute(load_model(design.problem), design, Block(stride=stride))


def _told(name: str, mask: str, stride: int) -> dict[str, Any]:
    """Return the figures of an explanation."""
    found = explained(name, mask, stride).to_dict()
    subset = {"white": "present", "black": "absent"}
    return {
        "mask": mask,
        "efficiency": found["efficiency"],
        "predicted": found["predicted"],
        "agreement": {
            measure: {
                kind: told[subset.get(measure, "all")][kind]
                for kind in ("pearson", "spearman", "recall")
            }
            for measure, told in found["correlations"].items()
        },
        "vital_shared": found["regions"]["overlap"].get("vital"),
    }


def draw(figures: Mapping[str, Any], path: Path) -> None:
    """Draw what the network sees in the first design, beside what is there."""
    from reproduction.networks.attribution_picture import draw_attribution

    first = figures["designs"][0]
    found = explained(figures["problem"], first["mask"], figures["stride"])
    draw_attribution(found, path, overwrite=True)


def claims(figures: Mapping[str, Any]) -> list[Claim]:
    """Compare with the paper."""
    told = figures["mean"]
    ranks = ", ".join(
        f"{words} {number(told[name]['spearman'])}"
        for name, words in (
            ("white", "a white block"), ("black", "a black block"), ("network", ("the network's "
            "own flips")), ("low_rank", "low-rank update"),
        )
        if name in told
    )  # fmt: skip
    return [
        Claim(
            "hiding parts of the picture shows the regions that matter",
            "shown in pictures",
            f"rank correlation with the exact change of efficiency by each flip: {ranks}",
            f"means over {len(figures['designs'])} designs; white blocks are judged by beams that "
            "are there, black ones by absent ones",
        ),
        Claim(
            "regions that the network takes for vital are",
            "",
            f"{percent(figures['vital_shared'])} of the beams that either calls vital are so for "
            "both",
            "Jaccard's index, mean over the designs",
        ),
    ]


STUDY = register(
    Study(
        name="regions",
        title="What a network sees, against exact sensitivities",
        after="maps of functional regions",
        full=Settings(),
        quick=Settings(chains=1, stride=8),
        run=run,
        draw=draw,
        claims=claims,
        runs=lambda told: f"{len(told['designs'])} designs",
        deviations=(
            "The network is the ResNet-18 that comes along, not the paper's ResNet50.",
            "The exact change of the efficiency by each flip stands beside the maps.",
        ),
    )
)
