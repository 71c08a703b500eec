"""How angular springs join the beams of a node, and what the removal of a beam does to them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.mechanics import SpringEvaluator
from bellcrank.model import Input, Lattice, Output, Problem, Supports
from reproduction.formatting import number
from reproduction.pictures.joints import Joint, draw_joints
from reproduction.registry import Claim, Figures, Study, register

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from bellcrank.mechanics import UnloadedBeams
    from reproduction.result_store import ResultStore

CASES: dict[str, dict[str, Any]] = {
    "six": {"title": "Six beams", "angles": [0, 60, 120, 180, 240, 300]},
    "five": {
        "title": "One removed", "angles": [0, 120, 180, 240, 300], "gone": [60], "fresh": [0],
    },
    "two": {"title": "Two left", "angles": [0, 120], "gone": [60, 180, 240, 300], "fresh": [0, 1]},
    "dead end": {
        "title": "A dead end", "angles": [0, 60, 120], "dead": [1], "gone": [180, 240, 300],
    },
    "dead ends": {
        "title": "Two dead ends", "angles": [0, 60, 120, 240], "dead": [1, 3], "gone": [180, 300],
    },
}  # fmt: skip
"""Directions of the beams of a node in degrees; those that end freely carry nothing."""


UP = np.array([0.0, 1.0])


@dataclass(frozen=True, slots=True, kw_only=True)
class Settings:
    """By how much the first beam is turned, in lengths of it."""

    turn: float = 0.01


def star(angles: list[int], dead: list[int], turn: float) -> Problem:
    """Return a node that is held, with beams of which the first is turned, and all others held.

    Dead ends are free. The output is a beam that hangs by a held end, and feels nothing.
    """
    places = [(0.0, 0.0)]
    places += [(math.cos(math.radians(a)), math.sin(math.radians(a))) for a in angles]
    held = next(k for k in range(len(angles) - 1, 0, -1) if k not in dead) + 1
    places.append((2.0 * places[held][0], 2.0 * places[held][1]))
    last = len(places) - 1
    beams = [(0, k + 1) for k in range(len(angles))] + [(held, last)]
    free = {k + 1 for k in dead}
    fixed = [0, *(k + 1 for k in range(1, len(angles)) if k + 1 not in free)]
    return Problem(
        name="star",
        lattice=Lattice(np.array(places), np.array(beams)),
        supports=Supports(fixed=np.array(fixed)),
        input=Input(nodes=np.array([1]), direction=UP, drive="displacement", amount=turn),
        output=Output(nodes=np.array([last]), direction=UP),
        designable=np.array([0]),
    )


def resistance(
    angles: list[int], dead: list[int], turn: float, unloaded_beams: UnloadedBeams
) -> float:
    """Return what a joint resists a beam's turn with, in units of an angular spring."""
    problem = star(angles, dead, turn)
    response = SpringEvaluator(problem, unloaded_beams=unloaded_beams).evaluate(problem.initial)
    stretch = problem.stiffness.bond * (math.hypot(1.0, turn) - 1.0) ** 2
    turned = math.atan(turn)
    return (response.energy - stretch) / (problem.stiffness.angle * turned**2)


def run(settings: Settings, store: ResultStore) -> Figures:
    """Turn the first beam of each joint, and measure what resists."""
    store.progress("joints", 0, len(CASES))
    found = {}
    for name, case in CASES.items():
        angles, dead = case["angles"], case.get("dead", [])
        found[name] = {
            "beams": len(angles),
            "springs": len(angles) if len(angles) > 1 else 0,
            "keep": resistance(angles, dead, settings.turn, "keep"),
            "prune_dead_ends": resistance(angles, dead, settings.turn, "prune_dead_ends"),
        }
    store.progress("joints", len(CASES), len(CASES))
    return {"turn": settings.turn, "joints": found}


def draw(figures: Mapping[str, Any], path: Path) -> None:
    """Draw the joints with their springs."""
    joints = []
    for name, case in CASES.items():
        told = figures["joints"][name]
        joints.append(
            Joint(
                title=case["title"],
                note=f"{told['springs']} springs; resists {told['keep']:.2f}",
                angles=case["angles"],
                dead=frozenset(case.get("dead", ())),
                gone=case.get("gone", ()),
                fresh=frozenset(case.get("fresh", ())),
            )
        )
    draw_joints(
        joints,
        path,
        title="Angular springs around a node, with their rest angles",
        note="orange: springs that removals have merged; resists: energy of turning the right "
        "beam by 1 rad, others held, in units of λ; white: ends that are free",
        overwrite=True,
    )


def claims(figures: Mapping[str, Any]) -> list[Claim]:
    """Compare with the paper."""
    told = figures["joints"]
    return [
        Claim(
            "neighbouring beams of a node share a spring; removing a beam merges its two",
            "re-neighbouring",
            f"{told['six']['springs']} springs with {told['six']['beams']} beams, "
            f"{told['five']['springs']} with {told['five']['beams']}; a turned beam is resisted by "
            f"{number(told['six']['keep'])} λ and {number(told['five']['keep'])} λ",
            "measured with the energy that searches use",
        ),
        Claim(
            "what dead ends do in the literal model",
            "",
            f"{number(told['two']['keep'])} λ without, {number(told['dead end']['keep'])} λ "
            f"with one and {number(told['dead ends']['keep'])} λ with two between the beams; "
            f"ignored as loose ends: {number(told['dead ends']['prune_dead_ends'])} λ",
            "no real part softens so; our default search does not count them",
        ),
    ]


STUDY = register(
    Study(
        name="angular-springs",
        title="Angular springs around a node, before and after removals",
        after="sketch of angular springs",
        full=Settings(),
        quick=Settings(),
        run=run,
        draw=draw,
        claims=claims,
        runs=lambda told: f"{len(told['joints'])} joints",
    )
)
