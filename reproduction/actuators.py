"""Crane, anti-parallel and pliers: hand against machine, beside the paper's figures."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

from reproduction import comparisons, published
from reproduction.comparisons import Duel, efficiency, in_all_models
from reproduction.formatting import number, share
from reproduction.registry import Claim, Study, register

if TYPE_CHECKING:
    from collections.abc import Mapping

QUICK = {"paper_steps": 2000, "paper_chains": 3, "steps": 2500, "chains": 2, "levels": ("frame",)}
TASKS = {
    "crane": ("push down, move sideways", (published.CRANE_HUMAN, published.CRANE_MACHINE)),
    "anti-parallel": (
        "push down, move up",
        (published.ANTI_PARALLEL_HUMAN, published.ANTI_PARALLEL_MACHINE),
    ),
    "pliers": ("squeeze, press", (published.PLIERS_HUMAN, published.PLIERS_MACHINE)),
}
OTHERS = (
    (
        "The paper's own designs, by hand and by machine, are not at hand: all designs here are "
        "ours, those by hand drawn from lever mechanics before any machine design was looked at."
    ),
)
DISPLACED = (
    *OTHERS,
    (
        "The paper made and measured its parts; ours exist as finite elements only: frames, and "
        "the printed outline in plane stress, both nonlinear."
    ),
    (
        "The designs for 2 mm struts were searched with the stiffness of such struts, and so that "
        "they touch nowhere; the others with the paper's stiffness, which stands for wider struts."
    ),
)
FORCED = (
    *OTHERS,
    (
        "Our pliers are another lattice than the paper's, of which only half is modelled; the "
        "paper's own design by hand, recomputed elsewhere from a description, has 0.2211."
    ),
    "The paper's figures for pliers are of simulations.",
    "Designs that snap as frames were not followed as printed outlines.",
)


def claims(figures: Mapping[str, Any]) -> list[Claim]:
    """Compare with the paper."""
    name = figures["problem"]
    by_hand, by_machine = TASKS[name][1]
    told = [
        Claim(f"{name}: efficiency by hand", share(by_hand), in_all_models(figures, "hand")),
        Claim(
            f"{name}: efficiency by machine, the paper's rule",
            share(by_machine),
            in_all_models(figures, "paper"),
        ),
        Claim(
            f"{name}: efficiency by machine, our default search",
            share(by_machine),
            in_all_models(figures, "default"),
        ),
    ]
    if "part" in figures["designs"]:
        told.append(
            Claim(
                f"{name}: efficiency by machine, for 2 mm struts",
                share(by_machine),
                in_all_models(figures, "part"),
                "comes with the package; searched for such struts",
            )
        )
    told.append(
        Claim(
            f"{name}: machine over hand",
            number(by_machine / by_hand, 1) + " times",
            "; ".join(_ratios(figures)),
            "each in the same model",
        )
    )
    return told


def _ratios(figures: Mapping[str, Any]) -> list[str]:
    """Return how many times better than by hand designs are, model by model."""
    found = []
    for by in ("paper", "default", "part"):
        if by not in figures["designs"]:
            continue
        words = []
        for model in comparisons.levels_in(figures):
            machine, hand = (efficiency(figures, one, model) for one in (by, "hand"))
            if machine is not None and hand:
                words.append(f"{machine / hand:.1f} ({comparisons.MODELS[model][0]})")
        found.append(f"{comparisons.SHORT[by]} {', '.join(words)}")
    return found


def _study(name: str, after: str, full: Duel, quick: Duel, deviations: tuple[str, ...]) -> Study:
    what, reported = TASKS[name]
    title = f"{name.capitalize()}: {what}, by hand and by machine"
    return register(
        Study(
            name=name,
            title=title,
            after=after,
            full=full,
            quick=quick,
            run=comparisons.run,
            draw=partial(comparisons.draw, title=title, published=reported),
            claims=claims,
            runs=comparisons.runs,
            deviations=deviations,
        )
    )


CRANE = _study(
    "crane",
    "its first two actuators",
    Duel(problem="crane"),
    Duel(problem="crane", **QUICK),  # type: ignore[arg-type]
    DISPLACED,
)
ANTI_PARALLEL = _study(
    "anti-parallel",
    "its first two actuators",
    Duel(problem="anti-parallel"),
    Duel(problem="anti-parallel", **QUICK),  # type: ignore[arg-type]
    DISPLACED,
)
PLIERS = _study(
    "pliers",
    "its pliers",
    Duel(problem="pliers", paper_chains=4, steps=8000),
    Duel(problem="pliers", paper_steps=600, paper_chains=2, steps=800, chains=2, levels=("frame",)),
    FORCED,
)
