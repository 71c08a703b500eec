"""Force inverters in space beside topology optimisation: ``python -m benchmarks.inverters``.

The boxes are those of the examples of two open packages, which are on no package index:

- ``comec``: preset ForceInverter_3D of TopoptComec (12 x 12 x 8 elements, 15 % of the volume),
- ``lab``: force_inverter3d of topoptlab (a quarter of 64 x 64 x 64 elements, 10 % of the volume),
  after Amir, Aage and Lazarov (Struct. Multidisc. Optim. 49, 815, 2014).

The corners of the lower side are held, its middle is pushed up, and the middle of the upper side is
to move down. Both packages use the formulation of Sigmund (Mech. Struct. Mach. 25, 493, 1997):
densities with a filter, stiffness by the power 3, springs at input and output, and the largest
output displacement for an input force and a volume. Here pyMOTO solves it, for a quarter of the
box, with MMA and several springs. bellcrank designs a lattice of octets in the same box, with no
more volume.

One judge computes all designs: tetrahedra of the second order of one size, neo-Hookean, free
output, from rest to a stroke of a tenth of the height. Densities are cut at the level that keeps
their volume. Efficiencies are those at strokes of 1, 5 and 10 % of the height.

Each run is added to ``docs/space/inverters.json``; runs that are in the record are not repeated.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.errors import InvalidSettings
from bellcrank.fem.continuum.response import solve_mesh
from bellcrank.fem.continuum.space_mesh import RoundStruts, stuffed, with_hubs
from bellcrank.mechanics import VERIFICATION_INCREMENT
from bellcrank.provenance import provenance
from bellcrank.search import SpecificationEvaluator, read_settings
from bellcrank.task import task_from_dict
from bellcrank.workflows import complete_design, start_design
from bellcrank.workflows.refinement import BEFORE_REFINEMENT
from reproduction.box_elements import Grid
from reproduction.topology import largest_motion, pymoto

from .record import add_runs
from .tasks import CORES, core_seconds

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from bellcrank.model import Design
    from bellcrank.part.part import Part
    from bellcrank.task import Task

    Values = NDArray[np.float64]

RECORD = Path(__file__).parents[1] / "docs" / "space" / "inverters.json"
STROKES = (0.01, 0.05, 0.1)
"""Strokes over the height of the box."""
SPRINGS = ((0.1, 0.01), (1.0, 0.1), (1.0, 0.01))
"""Stiffness of the springs at input and output, Young's modulus times the edge of an element."""
ITERATIONS = 100
PAD = 2.5
"""Radius of the solid regions around ports, mm."""
SEEDS = 1
SIZE = 1.1
"""Edge of the cubes of the grid of tetrahedra, mm; with 1.4 mm struts of 2 mm are cut."""


@dataclass(frozen=True, slots=True)
class Inverter:
    """A box with a force inverter.

    Parameters
    ----------
    size : (3,) mm
        Size of the box.
    elements : (3,)
        Numbers of elements of a quarter of the box, of topology optimisation.
    volume
        Largest part of the box that is solid.
    radius
        Radius of the filter, elements.
    """

    size: tuple[float, float, float]
    elements: tuple[int, int, int]
    volume: float
    radius: float

    @property
    def stroke(self) -> float:
        """Largest stroke, mm."""
        return STROKES[-1] * self.size[2]

    def task(self, name: str) -> Task:
        """Return the task for a lattice in the box."""
        wide, deep, high = self.size
        edge = 1.0
        corners = [[x, y, edge] for x in (edge, wide - edge) for y in (edge, deep - edge)]
        volume = self.volume * wide * deep * high
        data = {
            "name": f"inverter-{name}",
            "domain": {"size": list(self.size)},
            "supports": [{"at": [{"point": corner} for corner in corners]}],
            "cases": [
                {
                    "inputs": [
                        {
                            "at": {"point": [wide / 2, deep / 2, edge]},
                            "direction": "up",
                            "displacement": self.stroke,
                        }
                    ],
                    "outputs": [
                        {
                            "at": {"point": [wide / 2, deep / 2, high - edge]},
                            "direction": "down",
                            "gain": [
                                {"maximise": True, "at_least": 1.0},
                                {"of": "spread", "at_most": 0.3, "from": 0},
                            ],
                        }
                    ],
                }
            ],
            "limits": {"symmetry": "xy"},
        }
        task = task_from_dict(data)
        density = task.part.registered_material.density
        data["limits"]["mass"] = f"{volume * density / 1000.0:.6f} g"
        return task_from_dict(data)


BOXES = {
    "comec": Inverter((44.5, 44.5, 30.3), (12, 12, 16), 0.15, 2.6),
    "lab": Inverter((30.3, 30.3, 30.3), (16, 16, 32), 0.10, 1.5),
}


class Densities:
    """The body where densities exceed a level.

    Parameters
    ----------
    values : (x, y, z)
        Densities of the elements of the whole box.
    size : (3,) mm
        Size of the box.
    level
        The level.
    """

    def __init__(self, values: Values, size: tuple[float, float, float], level: float) -> None:
        from scipy.interpolate import RegularGridInterpolator

        self.size, self.level = np.array(size), level
        self.step = self.size / values.shape
        axes = [
            np.concatenate([[-1e3], (np.arange(count) + 0.5) * step, [1e3]])
            for count, step in zip(values.shape, self.step, strict=True)
        ]
        self.density = RegularGridInterpolator(axes, np.pad(values, 1, mode="edge"))

    @property
    def low(self) -> Values:
        """(3,) smallest coordinates, mm."""
        return np.zeros(3)

    @property
    def high(self) -> Values:
        """(3,) largest coordinates, mm."""
        return self.size

    def distance(self, points: Values) -> Values:
        """Return (n,) values of points (n, 3) that are negative inside."""
        outside = np.maximum(-points, points - self.size).max(axis=1)
        below = (self.level - self.density(points)) * self.step.mean()
        return np.maximum(outside, below)


def at_volume(values: Values, size: tuple[float, float, float], volume: float) -> Densities:
    """Return the body of densities that fills a part of the box."""
    grid = [(np.arange(4 * count) + 0.5) / (4 * count) for count in values.shape]
    points = np.stack(np.meshgrid(*grid, indexing="ij"), axis=-1).reshape(-1, 3) * size
    found = Densities(values, size, 0.0)
    level = float(np.quantile(found.density(points), 1.0 - volume))
    return Densities(values, size, level)


def optimised(box: Inverter, springs: tuple[float, float]) -> tuple[Values, float]:
    """Return the densities of the whole box by pyMOTO, and the time in s of one core."""
    module = pymoto()
    shape = np.array(box.elements)
    step = np.array(box.size) / (2 * shape[0], 2 * shape[1], shape[2])
    domain = module.VoxelDomain(*box.elements)
    corners = np.stack(
        np.meshgrid(*(np.arange(count + 1) for count in shape), indexing="ij"), axis=-1
    ).reshape(-1, 3)
    numbers = np.asarray(domain.get_nodenumber(*corners.T))
    points = np.empty((domain.nnodes, 3))
    points[numbers] = corners * step
    far = np.array([*(shape[:2] * step[:2]), 0.0])
    ports = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, box.size[2]], far])
    fixed = np.flatnonzero(np.linalg.norm(points - far, axis=1) < PAD)
    sides = [3 * np.flatnonzero(points[:, axis] == 0.0) + axis for axis in (0, 1)]
    held = np.unique(np.concatenate([(3 * fixed[:, None] + np.arange(3)).ravel(), *sides]))
    elements = np.stack(
        np.meshgrid(*(np.arange(count) for count in shape), indexing="ij"), axis=-1
    ).reshape(-1, 3)
    order = np.asarray(domain.get_elemnumber(*elements.T))
    centres = (elements + 0.5) * step
    away = np.linalg.norm(centres[:, None] - ports, axis=2)
    solid = order[(away < np.maximum(PAD, 1.01 * away.min(axis=0))).any(axis=1)]
    load, output = np.zeros(3 * domain.nnodes), np.zeros(3 * domain.nnodes)
    for vector, port, sign in ((load, ports[0], 1.0), (output, ports[1], -1.0)):
        vector[3 * int(np.linalg.norm(points - port, axis=1).argmin()) + 2] = sign
    began = time.thread_time()
    smooth, _ = largest_motion(
        domain, Grid(box.elements, load, output, held, solid, np.zeros(0, np.int64)), box.volume,
        (0.25 * springs[0], 0.25 * springs[1]), box.radius, ITERATIONS,
    )  # fmt: skip
    quarter = smooth[order].reshape(box.elements)
    half = np.concatenate([quarter[::-1], quarter], axis=0)
    whole = np.concatenate([half[:, ::-1], half], axis=1)
    return whole, time.thread_time() - began


def judged(part: Part, body: Any) -> dict[str, Any]:
    """Return the response of a body with the ports of a part."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    began = time.perf_counter()
    vertices, elements = stuffed(body, SIZE)
    pairs = elements[:, [0, 1, 2]].ravel(), elements[:, [1, 2, 3]].ravel()
    links = coo_array((np.ones(len(pairs[0])), pairs), shape=(len(vertices), len(vertices)))
    _, piece = connected_components(links, directed=False)
    given = part.design.problem.input.nodes[0]
    near = np.linalg.norm(vertices - part.positions[given], axis=1).argmin()
    elements = elements[piece[elements[:, 0]] == piece[near]]
    used, numbers = np.unique(elements, return_inverse=True)
    vertices, elements = vertices[used], numbers.reshape(-1, 4)
    sides = vertices[elements][:, 1:] - vertices[elements][:, :1]
    volume = round(float(np.abs(np.linalg.det(sides)).sum()) / 6.0, 1)
    try:
        mesh = with_hubs(part, vertices, elements, SIZE)
    except InvalidSettings:
        status = "input, output and supports are not connected"
        return {"status": status, "gains": [None] * len(STROKES), "volume_mm3": volume}
    found = solve_mesh(part, mesh, "neo-hookean")
    problem = part.design.problem
    loads = np.array([state.load for state in found.states])
    motion = np.array(
        [
            (state.motion[problem.output.nodes] * problem.output.direction).sum(axis=1).mean()
            for state in found.states
        ]
    )
    at = np.array(STROKES) / STROKES[-1]
    stroke = problem.input.amount * part.scale
    gains = np.interp(at, loads, motion) / (at * stroke)
    return {
        "status": found.path.status.value,
        "reached": round(float(loads[-1]), 3),
        "gains": [
            round(float(gain), 4) if share <= loads[-1] else None
            for gain, share in zip(gains, at, strict=True)
        ],
        "volume_mm3": volume,
        "strain": round(max(state.strain for state in found.states), 4),
        "input_force_N": round(float(found.states[-1].input_force), 4),
        "elements": len(elements),
        "judge_seconds": round(time.perf_counter() - began, 1),
    }


def by_densities(name: str, springs: tuple[float, float]) -> dict[str, Any]:
    """Optimise the densities of a box, and judge the result."""
    box = BOXES[name]
    values, seconds = optimised(box, springs)
    part = _part(box.task(name))
    body = at_volume(values, box.size, box.volume)
    row = {"commit": provenance()["commit"], "springs": list(springs), "seconds": round(seconds, 1)}
    return {**row, "level": round(body.level, 3), **judged(part, body)}


def by_lattice(name: str, seed: int) -> dict[str, Any]:
    """Design a lattice in a box, and judge the result."""
    task = BOXES[name].task(name)
    used = core_seconds()
    with TemporaryDirectory() as temporary:
        settings = read_settings({**BEFORE_REFINEMENT, "seed": seed})
        folder = start_design(task.problem, settings, Path(temporary) / "run", task.part)
        report = complete_design(folder, workers=CORES)
    assert report is not None
    seconds = core_seconds() - used
    design = report.selection.design
    part = task.part.of(design)
    return {
        "commit": provenance()["commit"],
        "seed": seed,
        "seconds": round(seconds, 1),
        "struts": int(design.mask.sum()),
        "gain_by_frames": _by_frames(design),
        "mask": design.mask_hex,
        "positions": design.problem.lattice.positions.round(5).tolist(),
        "widths": design.problem.beam_widths.round(5).tolist(),
        **judged(part, RoundStruts(part.positions[part.struts], 0.5 * part.widths)),
    }


def _part(task: Task) -> Part:
    return task.part.of(task.problem.full_design())


def _by_frames(design: Design) -> float:
    wanted = design.problem.specification
    assert wanted is not None
    problem = replace(design.problem, specification=replace(wanted, symmetry=()))
    evaluator = SpecificationEvaluator(problem, elements=8)
    return evaluator.evaluate(design.mask, VERIFICATION_INCREMENT).efficiency


def runs() -> dict[str, Callable[[], dict[str, Any]]]:
    """Return all runs by name."""
    out: dict[str, Callable[[], dict[str, Any]]] = {}
    for name in BOXES:
        for springs in SPRINGS:
            given = "-".join(f"{each:g}" for each in springs)
            out[f"{name} densities {given}"] = partial(by_densities, name, springs)
        for seed in range(SEEDS):
            out[f"{name} lattice {seed}"] = partial(by_lattice, name, seed)
    return out


def rows_of(rows: dict[str, dict[str, Any]]) -> list[str]:
    """Return a row for each design.

    Gains at strokes of 1, 5 and 10 % of the height; volume in cm3; largest strain; time in s of one
    core.
    """
    lines = []
    for name, row in sorted(rows.items()):
        gains = " | ".join("-" if gain is None else f"{gain:.2f}" for gain in row["gains"])
        strain = f"{100.0 * row['strain']:.0f} %" if "strain" in row else "-"
        lines.append(
            f"| {name} | {gains} | {row['volume_mm3'] / 1000.0:.2f} "
            f"| {strain} | {row['seconds']:.0f} s |"
        )
    return lines


def main() -> None:
    """Run what is asked for."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--only", default="", help="first words of the names of runs")
    given = parser.parse_args()
    rows = add_runs(RECORD, runs(), given.only)
    for line in rows_of(rows):
        print(line)


if __name__ == "__main__":
    main()
