"""What the study of rivals shows and says: both sides' designs, and who is ahead in what."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING, Any

import numpy as np

from reproduction.formatting import count, number
from reproduction.pictures.outlines import Shape, draw_shapes
from reproduction.registry import Claim

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

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
                f"area {number(ours['area_mm2'], 0)} and {number(rival.get('area_mm2'), 0)} mm²; "
                f"narrowest place {number(ours['narrowest_mm'], 1)} and "
                f"{number(rival.get('narrowest_mm'), 1)} mm",
                f"{_verdict(ours, rival)}; with {figures['triangles_mm'][1]:g} mm triangles "
                f"{number(ours['efficiency_finer'])} and {number(rival['efficiency_finer'])}; "
                f"bellcrank {_free_and_kept(ours)}; "
                f"pyMOTO by springs at input and output: {_tried(rival)}",
            )
        )
    return found


def _score(row: Mapping[str, Any]) -> str:
    if row["efficiency"] is not None:
        return number(row["efficiency"])
    return str(row["status"])


def _free_and_kept(ours: Mapping[str, Any]) -> str:
    """Return what came of each set of goals, in words."""
    return ", ".join(
        f"{' and '.join(row['goals']) or 'without goals'}: {number(row['efficiency'])}"
        for row in ours["tried"]
    )


def _tried(rival: Mapping[str, Any]) -> str:
    """Return what came of each setting, in words."""
    told = []
    for (stiff, radius), rows in itertools.groupby(
        rival["tried"], key=lambda row: (row["springs"][0], row["radius"])
    ):
        values = ", ".join(f"{row['springs'][1]:g}: {number(row['efficiency'])}" for row in rows)
        told.append(f"{stiff:g} and {values} (filter {radius:g})")
    return "; ".join(told)


def _verdict(ours: Mapping[str, Any], rival: Mapping[str, Any]) -> str:
    """Say who is ahead in what; nothing that the figures do not show."""
    ahead: dict[str, list[str]] = {"bellcrank": [], "pyMOTO": []}
    for words, key, more in (
        ("efficiency", "efficiency", True),
        ("stress", "von_mises_MPa", False),
        ("input force (less)", "input_force_N", False),
        ("width of the narrowest place", "narrowest_mm", True),
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
        f"bellcrank: the best of {count(len(figures['goals']), 'setting')}, "
        f"{count(figures['chains'], 'chain')} of {count(figures['steps'], 'proposal')} each; "
        f"pyMOTO: the best of {count(figures['tried'], 'setting')}, "
        f"{count(figures['iterations'], 'iteration')} each"
    )
