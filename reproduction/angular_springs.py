"""Angular springs between the beams of a node before and after the removal of beams."""

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
        "title": "One beam removed", "angles": [0, 120, 180, 240, 300], "removed": [60],
        "merged": [0],
    },
    "two": {
        "title": "Two beams", "angles": [0, 120], "removed": [60, 180, 240, 300], "merged": [0, 1],
    },
    "dead end": {
        "title": "One dead end", "angles": [0, 60, 120], "dead": [1], "removed": [180, 240, 300],
    },
    "dead ends": {
        "title": "Two dead ends", "angles": [0, 60, 120, 240], "dead": [1, 3],
        "removed": [180, 300],
    },
}  # fmt: skip
"""Directions of the beams of a node in degrees; dead ends carry no load."""


UP = np.array([0.0, 1.0])


@dataclass(frozen=True, slots=True, kw_only=True)
class Settings:
    """Transverse displacement of the end of the first beam, in beam lengths."""

    turn: float = 0.01


def star(angles: list[int], dead: list[int], turn: float) -> Problem:
    """Return a problem with a fixed node whose first beam is rotated and whose others are fixed.

    Dead ends are free. The output is the free end of an additional, unloaded beam.
    """
    points = [(0.0, 0.0)]
    points += [(math.cos(math.radians(a)), math.sin(math.radians(a))) for a in angles]
    held = next(k for k in range(len(angles) - 1, 0, -1) if k not in dead) + 1
    points.append((2.0 * points[held][0], 2.0 * points[held][1]))
    last = len(points) - 1
    beams = [(0, k + 1) for k in range(len(angles))] + [(held, last)]
    free = {k + 1 for k in dead}
    fixed = [0, *(k + 1 for k in range(1, len(angles)) if k + 1 not in free)]
    return Problem(
        name="star",
        lattice=Lattice(np.array(points), np.array(beams)),
        supports=Supports(fixed=np.array(fixed)),
        input=Input(nodes=np.array([1]), direction=UP, drive="displacement", amount=turn),
        output=Output(nodes=np.array([last]), direction=UP),
        designable=np.array([0]),
    )


def resistance(
    angles: list[int], dead: list[int], turn: float, unloaded_beams: UnloadedBeams
) -> float:
    """Return the rotational stiffness of a beam at a node, in units of an angular spring."""
    problem = star(angles, dead, turn)
    response = SpringEvaluator(problem, unloaded_beams=unloaded_beams).evaluate(problem.initial)
    elongation = problem.stiffness.bond * (math.hypot(1.0, turn) - 1.0) ** 2
    angle = math.atan(turn)
    return (response.energy - elongation) / (problem.stiffness.angle * angle**2)


def run(settings: Settings, store: ResultStore) -> Figures:
    """Compute the rotational stiffness of the first beam of each joint."""
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
        row = figures["joints"][name]
        joints.append(
            Joint(
                title=case["title"],
                note=f"{row['springs']} springs; stiffness {row['keep']:.2f} λ",
                angles=case["angles"],
                dead=frozenset(case.get("dead", ())),
                removed=case.get("removed", ()),
                merged=frozenset(case.get("merged", ())),
            )
        )
    draw_joints(
        joints,
        path,
        title="Angular springs of a node with their rest angles",
        note="orange: springs merged by removals; stiffness: rotation of the right beam, other "
        "beams fixed; white: free ends",
        overwrite=True,
    )


def claims(figures: Mapping[str, Any]) -> list[Claim]:
    """Compare with the paper."""
    rows = figures["joints"]
    return [
        Claim(
            "removal of a beam merges the two angular springs beside it",
            "re-neighbouring",
            f"{rows['six']['springs']} springs with {rows['six']['beams']} beams, "
            f"{rows['five']['springs']} with {rows['five']['beams']}; rotational stiffness of a "
            f"beam {number(rows['six']['keep'])} λ and {number(rows['five']['keep'])} λ",
            "computed from the energy of the discrete model",
        ),
        Claim(
            "rotational stiffness with dead ends between the beams",
            "",
            f"{number(rows['two']['keep'])} λ with none, {number(rows['dead end']['keep'])} λ "
            f"with one and {number(rows['dead ends']['keep'])} λ with two dead ends; "
            f"{number(rows['dead ends']['prune_dead_ends'])} λ if dead ends are pruned",
            "real parts are not softened by dead ends; the default search prunes them",
        ),
    ]


STUDY = register(
    Study(
        name="angular-springs",
        title="Angular springs of a node before and after removals",
        after="sketch of angular springs",
        full=Settings(),
        quick=Settings(),
        run=run,
        draw=draw,
        claims=claims,
        runs=lambda figures: f"{len(figures['joints'])} joints",
    )
)
