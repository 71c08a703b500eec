"""Crane, anti-parallel and pliers: human and machine designs, in the model and as parts."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.errors import InvalidSettings
from bellcrank.model import Design, find_problem, gallery_design
from bellcrank.part import PartSpec, frame_problem
from bellcrank.plots import Motion, style
from reproduction import published
from reproduction.finite_elements import analyse_all
from reproduction.formatting import count, number, percent
from reproduction.pictures.charts import Chart, Series
from reproduction.pictures.sheets import Sheet, draw_sheet
from reproduction.registry import Claim, Figures, Study, register
from reproduction.searching import best_design, design_with, geometry_of, respond, run_chains

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from reproduction.result_store import ResultStore

ORIGINS = {
    "hand": ("Human design", "human"),
    "paper": ("Paper's search", "paper's search"),
    "default": ("Default search", "default search"),
    "part": ("Search for 2 mm struts", "2 mm struts"),
}
"""Origins of the designs, with a title and a short label."""
MODELS = {
    "search": ("model of the search", style.INK),
    "frame": ("nonlinear frame", style.BEST),
    "plane": ("plane stress", style.BUILT),
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Settings:
    """A task and the effort of the searches.

    Parameters
    ----------
    problem
        Bundled problem with a human design.
    paper_steps, paper_chains
        Length and number of chains of the paper's search.
    steps, chains
        Length and number of chains of the default search.
    seed
        Seed of both searches.
    levels
        Levels of finite elements.
    width
        Strut width, mm, for a lattice unit of 10 mm.
    """

    problem: str
    paper_steps: int = 20_000
    paper_chains: int = 8
    steps: int = 20_000
    chains: int = 4
    seed: int = 0
    levels: tuple[str, ...] = ("frame", "plane")
    width: float = 2.0


def run(settings: Settings, store: ResultStore) -> Figures:
    """Search, and analyse all designs at all levels."""
    problem = find_problem(settings.problem)
    found: dict[str, Design] = {}
    for origin in ("hand", "part"):
        known = gallery_design("human" if origin == "hand" else "machine", settings.problem)
        if known is not None:
            found[origin] = known
    for origin, search, steps, chains in (
        ("paper", "paper", settings.paper_steps, settings.paper_chains),
        ("default", "basin-hopping", settings.steps, settings.chains),
    ):
        values = {"search": search, "steps": steps, "seed": settings.seed}
        results = run_chains(store, f"{origin}-chain", problem, values, chains)
        found[origin] = best_design(problem, results).design
    designs = {origin: found[origin] for origin in ORIGINS if origin in found}
    parts = analyse_all(store, designs, PartSpec(width=settings.width), settings.levels)
    return {
        "problem": settings.problem,
        "width": settings.width,
        "searches": {
            "paper": {"chains": settings.paper_chains, "steps": settings.paper_steps},
            "default": {"chains": settings.chains, "steps": settings.steps},
        },
        "designs": {
            origin: {**_as_searched(design), **parts[origin]} for origin, design in designs.items()
        },
    }


def _as_searched(design: Design) -> dict[str, Any]:
    """Return a design and its response in the model of its search as plain data."""
    response = respond(design)
    return {
        **geometry_of(design),
        "beams": design.beam_count,
        "search": {
            "efficiency": response.efficiency if response.is_admissible else None,
            "status": response.status.label,
        },
    }


def design_from(figures: Mapping[str, Any], origin: str) -> Design:
    """Return a design of a record; only that for given struts is a frame."""
    problem = find_problem(figures["problem"])
    if origin == "part":
        problem = frame_problem(problem, PartSpec(width=figures["width"]))
    return design_with(problem, figures["designs"][origin])


def efficiency(figures: Mapping[str, Any], origin: str, model: str) -> float | None:
    """Return the efficiency of a design in a model, or None if the record has none."""
    if origin not in figures["designs"]:
        raise InvalidSettings(f"designs: no design {origin!r}")
    value = figures["designs"][origin].get(model, {}).get("efficiency")
    return None if value is None else float(value)


def _models_in(figures: Mapping[str, Any]) -> list[str]:
    """Return the models of which a record has figures."""
    rows = figures["designs"].values()
    return [model for model in MODELS if any(model in row for row in rows)]


def draw(figures: Mapping[str, Any], path: Path, title: str, reported: tuple[float, float]) -> None:
    """Draw the displaced designs and bars of their efficiencies.

    Parameters
    ----------
    reported
        Efficiencies of the human and the machine design in the paper.
    """
    motions = []
    for origin in figures["designs"]:
        design = design_from(figures, origin)
        response = respond(design)
        motions.append(
            Motion(design, response.displacement, response.efficiency, name=ORIGINS[origin][0])
        )
    order = [origin for origin in ORIGINS if origin in figures["designs"]]
    models = _models_in(figures)
    width = 0.8 / len(models)
    series = [
        _bars(
            np.arange(len(order)) + (k - 0.5 * (len(models) - 1)) * width,
            [efficiency(figures, origin, model) for origin in order],
            MODELS[model],
            0.94 * width,
            frozenset(i for i, name in enumerate(order) if model in figures["designs"][name]),
        )
        for k, model in enumerate(models)
    ]
    centres = np.array([len(order), len(order) + 1.0])
    series.append(_bars(centres, list(reported), ("the paper", style.HUMAN), 0.55))
    highest = max(float(np.max(each.y)) for each in series)
    searches = figures["searches"]
    chart = Chart(
        "Efficiency in the model of the search and by finite elements (struts "
        f"{figures['width']:g} mm wide, spacing 10 mm), and the paper's values",
        "", "efficiency", series,
        names=[*(ORIGINS[origin][1] for origin in order), "paper, human", "paper, machine"],
        legend="upper right", limits_y=(None, 1.12 * highest),
    )  # fmt: skip
    effort = "; ".join(
        f"{name}: best of {count(searches[key]['chains'], 'chain')} of "
        f"{count(searches[key]['steps'], 'proposal')}"
        for key, name in (("paper", "paper's search"), ("default", "default search"))
    )
    sheet = Sheet(title=title, note=effort, motions=motions, charts=[chart], height=2.1)
    draw_sheet(sheet, path, overwrite=True)


def _bars(
    centres: Any,
    values: list[float | None],
    look: tuple[str, str],
    width: float,
    analysed: frozenset[int] = frozenset(),
) -> Series:
    """Return bars; analysed designs without an efficiency are labelled as snapping."""
    name, colour = look
    heights = np.array([0.0 if value is None else value for value in values])
    labels = [("snaps" if k in analysed else "") if value is None else number(value)
              for k, value in enumerate(values)]  # fmt: skip
    return Series(
        centres, heights, name=name, kind="bars", colour=colour, width=width, labels=labels
    )


def _effort(figures: Mapping[str, Any]) -> str:
    """Return the number and length of the chains as text."""
    searches = figures["searches"]
    return " and ".join(
        f"{count(searches[key]['chains'], 'chain')} of {count(searches[key]['steps'], 'proposal')} "
        f"of the {name}"
        for key, name in (("paper", "paper's search"), ("default", "default search"))
    )


def _in_all_models(figures: Mapping[str, Any], origin: str) -> str:
    """Return the efficiencies of a design in all models as text."""
    texts = []
    for model in _models_in(figures):
        row = figures["designs"][origin].get(model)
        if row is None:
            continue
        value, name = efficiency(figures, origin, model), MODELS[model][0]
        failure = "snaps" if row["status"] == "snapped" else "no equilibrium"
        texts.append(f"{number(value)} ({name})" if value is not None else f"{failure} ({name})")
    return ", ".join(texts)


def claims(figures: Mapping[str, Any]) -> list[Claim]:
    """Compare with the paper."""
    name = figures["problem"]
    by_hand, by_machine = TASKS[name][1]
    rows = [Claim(f"{name}: human design", percent(by_hand), _in_all_models(figures, "hand"))]
    for origin, what, note in (
        ("paper", "machine design by the paper's search", ""),
        ("default", "machine design by the default search", ""),
        ("part", "machine design for 2 mm struts", "bundled design, searched for these struts"),
    ):
        if origin in figures["designs"]:
            rows.append(
                Claim(f"{name}: {what}", percent(by_machine), _in_all_models(figures, origin), note)
            )
    rows.append(
        Claim(
            f"{name}: ratio of machine to human efficiency",
            number(by_machine / by_hand, 1),
            "; ".join(_ratios(figures)),
            "both efficiencies in the same model",
        )
    )
    return rows


def _ratios(figures: Mapping[str, Any]) -> list[str]:
    """Return the ratios to the human design, model by model, as text."""
    found = []
    for origin in ("paper", "default", "part"):
        if origin not in figures["designs"]:
            continue
        texts = []
        for model in _models_in(figures):
            if (origin, model) == ("part", "search"):
                continue  # a frame; the human design is in the discrete model
            machine, hand = (efficiency(figures, one, model) for one in (origin, "hand"))
            if machine is not None and hand:
                texts.append(f"{machine / hand:.1f} ({MODELS[model][0]})")
        found.append(f"{ORIGINS[origin][1]}: {', '.join(texts)}")
    return found


QUICK = {"paper_steps": 2000, "paper_chains": 3, "steps": 2500, "chains": 2, "levels": ("frame",)}
TASKS = {
    "crane": ("input down, output sideways", (published.CRANE_HUMAN, published.CRANE_MACHINE)),
    "anti-parallel": (
        "input down, output up",
        (published.ANTI_PARALLEL_HUMAN, published.ANTI_PARALLEL_MACHINE),
    ),
    "pliers": ("handles and jaws close", (published.PLIERS_HUMAN, published.PLIERS_MACHINE)),
}
OWN_DESIGNS = (
    "The paper's own designs are not available. All designs shown are ours; the human designs "
    "were drawn from lever mechanics before any machine design was known."
)
DISPLACED = (
    OWN_DESIGNS,
    (
        "The paper printed and measured its parts. Ours were analysed by finite elements only: "
        "frames, and the printed outline in plane stress, both nonlinear."
    ),
    (
        "The model of the search is the discrete model with the paper's stiffness, which "
        "corresponds to wider struts; for 2 mm struts it is a frame with one element in each "
        "strut, without contact of struts."
    ),
)
FORCED = (
    OWN_DESIGNS,
    (
        "Our pliers use another lattice than the paper's, of which only half is modelled. The "
        "paper's human design, recomputed from a description, has efficiency 0.2211."
    ),
    "The paper's values for pliers are simulated.",
    "For 2 mm struts the model of the search is a frame with one element in each strut.",
    "Designs that snap as frames were not analysed in plane stress.",
)


def _register(
    name: str, after: str, full: Settings, quick: Settings, deviations: tuple[str, ...]
) -> None:
    what, reported = TASKS[name]
    title = f"{name.capitalize()} ({what}): human and machine designs"
    register(
        Study(
            name=name,
            title=title,
            after=after,
            full=full,
            quick=quick,
            run=run,
            draw=partial(draw, title=title, reported=reported),
            claims=claims,
            runs=_effort,
            deviations=deviations,
        )
    )


for _name in ("crane", "anti-parallel"):
    _register(
        _name,
        "displacement actuators",
        Settings(problem=_name),
        Settings(problem=_name, **QUICK),  # type: ignore[arg-type]
        DISPLACED,
    )
_register(
    "pliers",
    "pliers",
    Settings(problem="pliers", paper_chains=4, steps=8000),
    Settings(
        problem="pliers", paper_steps=600, paper_chains=2, steps=800, chains=2, levels=("frame",)
    ),
    FORCED,
)
