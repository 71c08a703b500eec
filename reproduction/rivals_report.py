"""Picture and comparison table of the study of topology optimisation."""

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

METHODS = {"ours": "bellcrank", "rival": "pyMOTO"}


def draw(figures: Mapping[str, Any], path: Path) -> None:
    """Draw all designs at rest and displaced."""
    shapes = []
    for name, task in figures["tasks"].items():
        for side, method in METHODS.items():
            row, ports = task[side], task["ports"]
            score = number(row["efficiency"]) if row["efficiency"] else row["status"]
            shapes.append(
                Shape(
                    title=f"{name.capitalize()}, {method}",
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
                    fixed=[tuple(point) for point in ports["held"]],
                )
            )
    draw_shapes(
        [shape for shape in shapes if shape.curves],
        path,
        title="Force inverter and gripper by bellcrank and by topology optimisation",
        note="same box, mass, material, stroke and output spring; "
        "efficiencies of the outlines in nonlinear plane stress",
        overwrite=True,
    )


def claims(figures: Mapping[str, Any]) -> list[Claim]:
    """Compare both methods; the paper has no such values."""
    found = []
    for name, task in figures["tasks"].items():
        ours, rival = task["ours"], task["rival"]
        found.append(
            Claim(
                f"{name}: bellcrank and pyMOTO",
                "",
                f"efficiency {_score(ours)} and {_score(rival)}; largest stress "
                f"{number(ours['von_mises_MPa'], 1)} and {number(rival.get('von_mises_MPa'), 1)} "
                f"MPa; {_at_equal_stress(task)}; "
                f"input force {number(ours['input_force_N'])} and "
                f"{number(rival.get('input_force_N'))} N; design time on one core "
                f"{ours['design_seconds']:.0f} and {rival['design_seconds']:.0f} s; "
                f"area {number(ours['area_mm2'], 0)} and {number(rival.get('area_mm2'), 0)} mm²; "
                f"smallest width {number(ours['narrowest_mm'], 1)} and "
                f"{number(rival.get('narrowest_mm'), 1)} mm",
                f"{_better_method(ours, rival)}; efficiency with "
                f"{figures['triangles_mm'][1]:g} mm triangles "
                f"{number(ours['efficiency_finer'])} and {number(rival['efficiency_finer'])}; "
                f"bellcrank by goals: {_by_goals(ours)}; "
                f"pyMOTO by springs at input and output: {_by_springs(rival)}",
            )
        )
    lift = figures["lift"]
    ours, rival = lift["ours"], lift["rival"]
    found.append(
        Claim(
            f"{lift['title']} with a payload of {lift['payload_N']:g} N: bellcrank and pyMOTO",
            "",
            f"bellcrank: {_items(ours)}; pyMOTO: {_items(rival)}; "
            f"area {number(ours['area_mm2'], 0)} and {number(rival['area_mm2'], 0)} mm²; "
            f"smallest width {number(ours['narrowest_mm'], 1)} and "
            f"{number(rival['narrowest_mm'], 1)} mm; "
            f"design time {ours['design_seconds']:.0f} s on all cores and "
            f"{rival['design_seconds']:.0f} s on one",
            f"sums of violations and gains of bellcrank by seed: {_attempts(ours, 'seed')}; of "
            "pyMOTO by limit on the off-axis motion, springs and filter: "
            f"{_attempts(rival, 'off_axis', 'springs', 'radius')}",
        )
    )
    return found


def _at_equal_stress(task: Mapping[str, Any]) -> str:
    row = task["ours_at_no_higher_stress"]
    if row is None:
        return "bellcrank has no design with a stress as low"
    return (
        f"bellcrank with no higher stress {number(row['efficiency'])} "
        f"({number(row['von_mises_MPa'], 2)} MPa)"
    )


UNITS = {"rotation": ("degrees", 1.0), "payload": ("N", 1.0), "gain": ("", 1.0)}
"""Units of items as they are shown, and the factor; per cent for the others."""


def _items(row: Mapping[str, Any]) -> str:
    """Return the items that a design reaches, with a mark at those that it misses."""
    if row["items"] is None:
        return "not stable"
    texts = []
    for item in row["items"]:
        unit, factor = UNITS.get(item["quantity"], ("%", 100.0))
        value = "not stable" if item["value"] is None else number(factor * item["value"])
        name = item["quantity"].replace("_", " ")
        missed = "" if item["met"] else " (missed)"
        texts.append(f"{name} {value} {unit}".rstrip() + missed)
    return ", ".join(texts)


def _attempts(row: Mapping[str, Any], *of: str) -> str:
    """Return the sum of violations and the gain of each attempt as text."""
    texts = []
    for each in row["tried"]:
        setting = " ".join(str(each[key]) for key in of)
        gain = "-" if each["gain"] is None else number(each["gain"])
        texts.append(f"{setting}: {number(each['violation'])} and {gain}")
    return ", ".join(texts)


def _score(row: Mapping[str, Any]) -> str:
    if row["efficiency"] is not None:
        return number(row["efficiency"])
    return str(row["status"])


def _by_goals(ours: Mapping[str, Any]) -> str:
    """Return the efficiency for each set of goals as text."""
    return ", ".join(
        f"{' and '.join(row['goals']) or 'none'} by {row['by']}: {number(row['efficiency'])}"
        for row in ours["tried"]
    )


def _by_springs(rival: Mapping[str, Any]) -> str:
    """Return the efficiency for each setting as text."""
    texts = []
    for (stiff, radius), rows in itertools.groupby(
        rival["tried"], key=lambda row: (row["springs"][0], row["radius"])
    ):
        values = ", ".join(f"{row['springs'][1]:g}: {number(row['efficiency'])}" for row in rows)
        texts.append(f"{stiff:g} and {values} (filter {radius:g})")
    return "; ".join(texts)


def _better_method(ours: Mapping[str, Any], rival: Mapping[str, Any]) -> str:
    """Return the better method in each quantity as text."""
    better: dict[str, list[str]] = {"bellcrank": [], "pyMOTO": []}
    for quantity, key, larger in (
        ("efficiency", "efficiency", True),
        ("stress", "von_mises_MPa", False),
        ("input force", "input_force_N", False),
        ("smallest width", "narrowest_mm", True),
        ("design time", "design_seconds", False),
    ):
        mine, other = ours.get(key), rival.get(key)
        if mine is None and other is None:
            continue
        if other is None or (mine is not None and (mine > other) == larger):
            better["bellcrank"].append(quantity)
        else:
            better["pyMOTO"].append(quantity)
    texts = [f"{side} is better in {', '.join(what)}" for side, what in better.items() if what]
    return "; ".join(texts)


def runs(figures: Mapping[str, Any]) -> str:
    """Return the effort of both methods as text."""
    return (
        f"bellcrank: best of {count(len(figures['goals']), 'setting')}, "
        f"{count(figures['chains'], 'chain')} of {count(figures['steps'], 'proposal')} each; "
        f"pyMOTO: best of {count(figures['tried'], 'setting')}, "
        f"{count(figures['iterations'], 'iteration')} each"
    )
