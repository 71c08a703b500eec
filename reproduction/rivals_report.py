"""Picture and comparison table of the study of topology optimisation."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING, Any

import numpy as np

from reproduction.formatting import count, listed, number
from reproduction.pictures.outlines import Shape, draw_shapes
from reproduction.registry import Claim

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path


def draw(figures: Mapping[str, Any], path: Path) -> None:
    """Draw all designs at rest and displaced."""
    shapes = []
    for name, task in figures["tasks"].items():
        ports = task["ports"]
        for method, row in _by_method(task).items():
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
        columns=max(len(_by_method(task)) for task in figures["tasks"].values()),
        title="Force inverter and gripper by bellcrank and by topology optimisation",
        note="same box, mass, material, stroke and output spring; "
        "efficiencies of the outlines in nonlinear plane stress",
        overwrite=True,
    )


def _by_method(task: Mapping[str, Any]) -> dict[str, Mapping[str, Any]]:
    """Return the row of each method, bellcrank's first."""
    return {"bellcrank": task["ours"], **task["rivals"]}


def claims(figures: Mapping[str, Any]) -> list[Claim]:
    """Compare the methods; the paper has no such values."""
    found = [_claim(name, task, figures) for name, task in figures["tasks"].items()]
    return found if figures["lift"] is None else [*found, _lift_claim(figures["lift"])]


def _claim(name: str, task: Mapping[str, Any], figures: Mapping[str, Any]) -> Claim:
    rows = _by_method(task)

    def values(key: str, digits: int = 2) -> str:
        return ", ".join(number(row.get(key), digits) for row in rows.values())

    springs = "; ".join(
        f"{package} by springs at input and output: {_by_springs(row)}"
        for package, row in task["rivals"].items()
    )
    return Claim(
        f"{name}: {listed(rows)}",
        "",
        f"efficiency {', '.join(map(_score, rows.values()))}; "
        f"largest stress {values('von_mises_MPa', 1)} MPa; {_at_equal_stress(task)}; "
        f"input force {values('input_force_N')} N; "
        f"design time on one core {values('design_seconds', 0)} s; "
        f"area {values('area_mm2', 0)} mm²; smallest width {values('narrowest_mm', 1)} mm",
        f"{_best_methods(rows)}; efficiency with {figures['triangles_mm'][1]:g} mm triangles "
        f"{values('efficiency_finer')}; bellcrank by goals: {_by_goals(task['ours'])}; {springs}",
    )


def _lift_claim(lift: Mapping[str, Any]) -> Claim:
    rows = _by_method(lift)
    others = "; ".join(
        f"of {package} by limit on the off-axis motion, springs and filter: "
        f"{_attempts(row, 'off_axis', 'springs', 'radius')}"
        for package, row in lift["rivals"].items()
    )
    seconds = ", ".join(f"{row['design_seconds']:.0f} s" for row in lift["rivals"].values())
    return Claim(
        f"{lift['title']} with a payload of {lift['payload_N']:g} N: {listed(rows)}",
        "",
        "; ".join(f"{method}: {_items(row)}" for method, row in rows.items())
        + f"; area {', '.join(number(row['area_mm2'], 0) for row in rows.values())} mm²; "
        f"smallest width {', '.join(number(row['narrowest_mm'], 1) for row in rows.values())} mm; "
        f"design time {lift['ours']['design_seconds']:.0f} s on all cores and {seconds} on one",
        "sums of violations and gains of bellcrank by seed: "
        f"{_attempts(lift['ours'], 'seed')}; {others}",
    )


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


def _best_methods(rows: Mapping[str, Mapping[str, Any]]) -> str:
    """Return the best method in each quantity as text."""
    best: dict[str, list[str]] = {method: [] for method in rows}
    for quantity, key, larger in (
        ("efficiency", "efficiency", True),
        ("stress", "von_mises_MPa", False),
        ("input force", "input_force_N", False),
        ("smallest width", "narrowest_mm", True),
        ("design time", "design_seconds", False),
    ):
        known = {method: row[key] for method, row in rows.items() if row.get(key) is not None}
        if known:
            best[(max if larger else min)(known, key=lambda method: known[method])].append(quantity)
    texts = [f"{method} is best in {', '.join(what)}" for method, what in best.items() if what]
    return "; ".join(texts)


def runs(figures: Mapping[str, Any]) -> str:
    """Return the effort of all methods as text."""
    return (
        f"bellcrank: best of {count(len(figures['goals']), 'setting')}, "
        f"{count(figures['chains'], 'chain')} of {count(figures['steps'], 'proposal')} each; "
        f"{listed(next(iter(figures['tasks'].values()))['rivals'])}: "
        f"best of {count(figures['tried'], 'setting')}, "
        f"{count(figures['iterations'], 'iteration')} each"
    )
