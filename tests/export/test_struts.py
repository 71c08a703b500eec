"""Solids of parts in space."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import lib3mf
import meshio
import numpy as np
import pytest
import trimesh

from bellcrank.errors import BellcrankError, InvalidSettings
from bellcrank.export import Export, PrintRules, check_print, export
from bellcrank.export.struts import sides_of, struts_solid
from bellcrank.model import (
    Design,
    Input,
    Lattice,
    Output,
    Problem,
    Section,
    Supports,
    find_problem,
    lattices,
)
from bellcrank.part import Part, PartSpec
from bellcrank.workflows import find_design, spec_for
from tests.export.reading import read_step, require_kernel

if TYPE_CHECKING:
    from pathlib import Path

    from bellcrank.export.solid import Solid

IN_SPACE = ("twist-column", "straight-orthogonal", "three-jaws", "twister")
"""Bundled parts and machines in space."""
KINDS = {
    "octet": {"size": [3, 3, 3]},
    "cubic": {"size": [2, 2, 2]},
    "body-centred": {"size": [3, 3, 3]},
    "kelvin": {"size": [6, 6, 6]},
}


def design_of(lattice: Lattice, mask: np.ndarray | None = None) -> Design:
    problem = Problem(
        name="part",
        lattice=lattice,
        supports=Supports(fixed=[0]),
        input=Input([1], [0, 0, -1], "displacement", 0.1),
        output=Output([2], [1, 0, 0]),
        section=Section.round(0.2),
    )
    return Design(problem, np.ones(lattice.beam_count, dtype=bool) if mask is None else mask)


def one_strut(end: tuple[float, float, float]) -> Design:
    return some_of([[0, 0, 0], end], 1)


def some_of(points: list, count: int) -> Design:
    """Return the first beams of a complete graph of some points and others far away."""
    others = [[9, 9, 9], [9, 8, 9], [8, 9, 9], [8, 8, 8]]
    nodes = np.array([*points, *others], dtype=float)
    beams = np.stack(np.triu_indices(len(nodes), 1), axis=1)
    return design_of(Lattice(nodes, beams), np.arange(len(beams)) < count)


@pytest.mark.parametrize("end", [(1, 0, 0), (0, 0, 1), (0.3, -0.5, 0.9)])
def test_a_strut_has_the_volume_of_a_capsule(end: tuple[float, float, float]) -> None:
    solid = struts_solid(PartSpec(width=2.0).of(one_strut(end)), sagitta=0.002)
    length = 10.0 * float(np.linalg.norm(end))
    assert solid.volume == pytest.approx(np.pi * length + 4.0 / 3.0 * np.pi, rel=2e-3)
    assert solid.euler_number == 2


def test_a_finer_surface_is_nearer_to_the_volume() -> None:
    part = PartSpec(width=2.0).of(one_strut((0.3, -0.5, 0.9)))
    exact = np.pi * 10.0 * np.sqrt(1.15) + 4.0 / 3.0 * np.pi
    errors = [abs(struts_solid(part, sagitta).volume - exact) for sagitta in (0.1, 0.01, 0.001)]
    assert errors[0] > errors[1] > errors[2]
    assert sides_of(1.0, 0.1) < sides_of(1.0, 0.01) < sides_of(1.0, 0.001)


def closed_solid(part: Part) -> Solid:
    """Return the solid of a part; it is watertight and has the loops of its graph.

    It is also watertight as an STL file, from which equal vertices in single precision are joined.
    """
    solid = struts_solid(part)
    mesh = trimesh.Trimesh(solid.vertices, solid.triangles, process=False)
    assert mesh.is_watertight
    assert mesh.volume == pytest.approx(solid.volume)
    _, joined = np.unique(solid.on_bed().vertices.astype(np.float32), axis=0, return_inverse=True)
    assert trimesh.Trimesh(solid.vertices, joined[solid.triangles], process=False).is_watertight
    nodes = len(np.unique(part.struts))
    assert solid.euler_number == 2 * (nodes - len(part.struts))
    return solid


def mesh_in(path: Path) -> Any:
    """Return the mesh in a 3MF file."""
    model = lib3mf.get_wrapper().CreateModel()
    model.QueryReader("3mf").ReadFromFile(str(path))
    objects = model.GetMeshObjects()
    assert objects.MoveNext()
    return objects.GetCurrentMeshObject()


@pytest.mark.parametrize(
    "name",
    [
        *(f"machine:{name}" for name in IN_SPACE),
        "human:orthogonal",
        "human:space-anti-parallel",
    ],
)
def test_bundled_designs_in_space_are_watertight_files(name: str, tmp_path) -> None:
    design = find_design(name)
    part = spec_for(design).of(design)
    solid = closed_solid(part)
    for suffix in ("stl", "3mf"):
        export(Export(part=part), tmp_path / f"part.{suffix}")
    stored = trimesh.load_mesh(tmp_path / "part.stl")
    assert stored.is_watertight
    assert stored.volume == pytest.approx(solid.volume, rel=1e-5)
    found = mesh_in(tmp_path / "part.3mf")
    assert found.IsManifoldAndOriented()
    assert found.GetTriangleCount() == len(solid.triangles)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(
    "seed", [*range(6), *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(6, 25))]
)
def test_random_parts_are_closed_and_have_the_loops_of_their_graph(kind: str, seed: int) -> None:
    lattice = lattices[kind](**KINDS[kind])
    rng = np.random.default_rng(seed)
    mask = rng.random(lattice.beam_count) < rng.uniform(0.3, 0.9)
    part = PartSpec(width=1.6).of(design_of(lattice, mask))
    solid = closed_solid(part)
    low = part.positions[np.unique(part.struts)].min(axis=0)
    assert solid.vertices.min(axis=0) == pytest.approx(low - 0.8, abs=0.02)


def test_struts_of_different_widths_meet_in_a_sphere_of_the_widest() -> None:
    design = some_of([[0, 0, 0], [1, 0, 0], [0, 0, 1]], 2)
    widths = np.full(len(design.mask), 0.2)
    widths[1] = 0.4
    problem = design.problem
    wide = Design(problem.with_geometry(problem.lattice.positions, widths), design.mask)
    part = PartSpec(width=2.0).of(wide)
    assert part.widths == pytest.approx([2.0, 4.0])
    solid = struts_solid(part)
    assert solid.vertices[:, 2].max() == pytest.approx(12.0, abs=0.05)
    assert solid.vertices[:, 0].max() == pytest.approx(11.0, abs=0.05)
    assert solid.vertices[:, 0].min() == pytest.approx(-2.0, abs=0.05)


def test_files_of_a_part_in_space(tmp_path) -> None:
    part = PartSpec(width=2.0).of(design_of(lattices["octet"]([2, 2, 2])))
    bundle = Export(part=part)
    solid = bundle.solid()
    assert solid.vertices.min(axis=0) == pytest.approx(0.0)
    assert bundle.thickness == pytest.approx(np.ptp(solid.vertices[:, 2]), abs=0.05)
    export(bundle, tmp_path / "part.stl")
    stored = trimesh.load_mesh(tmp_path / "part.stl")
    assert stored.is_watertight
    assert stored.volume == pytest.approx(solid.volume, rel=1e-5)
    export(bundle, tmp_path / "part.3mf")
    found = mesh_in(tmp_path / "part.3mf")
    assert found.IsManifoldAndOriented()
    assert found.GetTriangleCount() == len(solid.triangles)
    export(bundle, tmp_path / "part.beams.3mf")
    model = lib3mf.get_wrapper().CreateModel()
    reader = model.QueryReader("3mf")
    reader.SetStrictModeActive(True)
    reader.ReadFromFile(str(tmp_path / "part.beams.3mf"))
    assert reader.GetWarningCount() == 0
    objects = model.GetMeshObjects()
    assert objects.MoveNext()
    found = objects.GetCurrentMeshObject()
    beams = found.BeamLattice()
    assert beams.GetBeamCount() == len(part.struts)
    first = beams.GetBeam(0)
    assert list(first.Radii) == pytest.approx([1.0, 1.0])
    ends = [list(found.GetVertex(k).Coordinates) for k in first.Indices]
    length = np.linalg.norm(np.subtract(*ends))
    assert length == pytest.approx(np.linalg.norm(np.diff(part.positions[part.struts[0]], axis=0)))
    lowest = np.min([list(v.Coordinates) for v in found.GetVertices()], axis=0)
    assert lowest == pytest.approx(1.0)
    plane = PartSpec().of(find_problem("crane").full_design())
    with pytest.raises(InvalidSettings, match="3MF beams are round"):
        export(plane, tmp_path / "plane.beams.3mf")
    export(bundle, tmp_path / "part.vtu")
    lines = meshio.read(tmp_path / "part.vtu")
    assert len(lines.cells[0].data) == len(part.struts)
    for suffix in ("dxf", "svg"):
        with pytest.raises(BellcrankError, match="in space; only problems in the plane"):
            export(bundle, tmp_path / f"part.{suffix}")


def test_hints_for_printing_in_space() -> None:
    lattice = lattices["cubic"](size=[1, 1, 1], diagonals="none")
    flat = check_print(PartSpec(width=2.0).of(design_of(lattice)))
    assert [each.kind for each in flat] == ["overhangs"]
    assert flat[0].sentence.startswith("4 struts flatter than 40 degrees, the longest 10 mm across")
    assert len(flat[0].points[0]) == 3
    thin = check_print(PartSpec(width=0.5).of(design_of(lattice)), PrintRules(nozzle=0.4))
    assert "struts" in [each.kind for each in thin]
    # The four upright edges alone.
    upright = np.ptp(lattice.positions[lattice.beams][..., 2], axis=1) > 0.5
    loose = check_print(PartSpec(width=2.0).of(design_of(lattice, upright)))
    assert {each.kind for each in loose} == {"pieces", "dead-ends"}
    assert "in 4 pieces" in next(each.sentence for each in loose if each.kind == "pieces")


def test_a_wrong_sagitta_is_refused() -> None:
    with pytest.raises(InvalidSettings, match="sagitta: expected a length above 0 mm"):
        struts_solid(PartSpec().of(one_strut((1, 0, 0))), sagitta=0.0)


@pytest.mark.parametrize("kind", KINDS)
def test_step_is_one_sound_solid_with_exact_cylinders(kind: str, tmp_path) -> None:
    require_kernel()
    size = {"kelvin": [4, 4, 4], "cubic": [2, 1, 1]}.get(kind, [2, 2, 2])
    part = PartSpec(width=1.6).of(design_of(lattices[kind](size)))
    export(part, tmp_path / "part.step")
    volume, solids, sound = read_step(tmp_path / "part.step")
    assert (solids, sound) == (1, True)
    assert volume == pytest.approx(struts_solid(part, 5e-4).volume, rel=2e-4)


def test_step_of_one_strut_has_the_volume_of_a_capsule(tmp_path) -> None:
    require_kernel()
    export(PartSpec(width=2.0).of(one_strut((0.3, -0.5, 0.9))), tmp_path / "part.step")
    volume, _, sound = read_step(tmp_path / "part.step")
    assert sound
    capsule = np.pi * 10.0 * np.sqrt(1.15) + 4.0 / 3.0 * np.pi
    assert volume == pytest.approx(capsule, rel=5e-4)


def test_lammps_bonds_have_the_stiffness_of_struts(tmp_path) -> None:
    """A strut of 10 mm with a diameter of 2 mm and joints of 0.6 mm, E = 12 MPa, nu = 0.48."""
    part = PartSpec(width=2.0).of(some_of([[0, 0, 0], [1, 0, 0], [0, 0, 1]], 2))
    export(part, tmp_path / "part.lmp")
    lines = (tmp_path / "part.lmp").read_text().splitlines()
    words = [line.split() for line in lines]
    (bond,) = (each for each in words if each[0] == "bond_coeff")
    young, shear, free = part.material.young, part.material.shear, 10.0 - part.joints[0].sum()
    inertia, area = np.pi / 4.0, np.pi
    soft = 12.0 * young * inertia / (0.9 * shear * area * free**2)
    wanted = [
        young * area / free,
        12.0 * young * inertia / free**3 / (1.0 + soft),
        2.0 * shear * inertia / free,
        young * inertia / free,
    ]
    assert [float(each) for each in bond[2:6]] == pytest.approx(wanted)
    made = [each for each in words if each[0] == "create_bonds"]
    assert [each[3:5] for each in made] == [["1", "2"], ["1", "3"]]
    atoms = [each for each in words if each[0] == "create_atoms"]
    assert [[float(x) for x in each[3:6]] for each in atoms] == (10.0 * np.array(
        [[0, 0, 0], [1, 0, 0], [0, 0, 1]]
    )).tolist()  # fmt: skip
    assert "group support id 1" in lines
    assert "group input id 2" in lines
    assert "group output id 3" in lines
    mass = sum(
        float(each[6]) * np.pi / 6.0 * float(each[4]) ** 3 for each in words if each[0] == "set"
    )
    assert mass == pytest.approx(1e-9 * part.material.density * 2.0 * np.pi * 10.0)


def test_lammps_files_of_parts_in_the_plane(tmp_path) -> None:
    part = PartSpec().of(find_problem("crane").full_design())
    export(part, tmp_path / "crane.lmp")
    words = [line.split() for line in (tmp_path / "crane.lmp").read_text().splitlines()]
    assert sum(each[0] == "create_bonds" for each in words) == len(part.struts)
    stiff = np.array([[float(x) for x in each[2:6]] for each in words if each[0] == "bond_coeff"])
    section = part.section
    free = part.material.young * section.area / stiff[:, 0]
    assert stiff[:, 3] == pytest.approx(part.material.young * section.inertia / free)
