"""Files for printers, read back: closed, with all holes and the exact volume."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest

from bellcrank.export import Export, exporters, extruded
from bellcrank.export.formats import stl, threemf
from bellcrank.model import IN_SPACE, builtin, find_problem, gallery_design
from bellcrank.part import PartSpec
from bellcrank.part.outline import expected_holes, room_for_fillet, strut_outline
from tests.export.reading import read_3mf, read_3mf_strictly, read_stl
from tests.part.outline.layouts import random_layout

if TYPE_CHECKING:
    import trimesh

    from bellcrank.model import Design
    from tests.part.outline.layouts import Layout

KINDS = ("human", "machine")
GALLERY = [
    (kind, name)
    for kind in KINDS
    for name in builtin
    if name not in IN_SPACE and gallery_design(kind, name) is not None
]
FULL = ["crane", "scaling-8", "discs", "pliers"]
FILLETS = [0.0, 0.05, 0.4, 0.97]
LAYOUTS = [
    pytest.param(kind, seed, marks=[pytest.mark.slow] if seed % 4 else [])
    for kind, count in (("regular", 67), ("jittered", 67), ("scattered", 66))
    for seed in range(100, 100 + count)
]


def assert_sound(mesh: trimesh.Trimesh, holes: int, volume: float) -> None:
    assert mesh.is_watertight
    assert mesh.is_winding_consistent
    assert mesh.euler_number == 2 - 2 * holes
    assert mesh.volume == pytest.approx(volume, rel=1e-6)


def layout_with_room(kind: str, seed: int) -> tuple[Layout, float]:
    """A layout whose struts may be wider than 0.1 mm."""
    for further in range(seed, seed + 10000, 1000):
        layout = random_layout(kind, further)
        swollen = room_for_fillet(*layout, width=1e-3)
        if swollen > 0.05:
            break
    return layout, swollen


def assert_prints(design: Design) -> None:
    problem = design.problem
    shortest = problem.lattice.rest_length[design.mask].min()
    part = PartSpec(width=2.0 * min(1.0, shortest)).of(design)
    bundle = Export(part=part, layer=0.32)
    holes = expected_holes(part.positions, part.struts)
    volume = part.outline().area * 5.12
    for name, read in (("stl", read_stl), ("3mf", read_3mf)):
        assert_sound(read(exporters[name].to_bytes(bundle)), holes, volume)


@pytest.mark.parametrize(("kind", "name"), GALLERY)
def test_designs_that_come_with_the_package_print(kind: str, name: str) -> None:
    design = gallery_design(kind, name)
    assert design is not None
    assert_prints(design)


@pytest.mark.parametrize("name", FULL)
def test_full_lattices_print(name: str) -> None:
    assert_prints(find_problem(name).full_design())


@pytest.mark.parametrize(("kind", "seed"), LAYOUTS)
def test_random_layouts_print_with_small_and_large_fillets(kind: str, seed: int) -> None:
    layout, swollen = layout_with_room(kind, seed)
    width = float(np.random.default_rng(seed).uniform(0.2, 1.0)) * min(swollen, 4.0)
    room = min(room_for_fillet(*layout, width), 6.0)
    holes = expected_holes(*layout)
    for share in FILLETS:
        outline = strut_outline(*layout, width, share * room)
        solid = extruded(outline, 5.12, sagitta=0.02).on_bed()
        assert outline.hole_count == holes
        for made, read in ((stl, read_stl), (threemf, read_3mf)):
            assert_sound(read(made.solid_to_bytes(solid, "random")), holes, outline.area * 5.12)


def test_the_library_of_the_format_reads_3mf_without_a_warning() -> None:
    pytest.importorskip("lib3mf")
    part = PartSpec().of(find_problem("crane").full_design())
    content = exporters["3mf"].to_bytes(Export(part=part, title='lifts <5 & "more"'))
    found = read_3mf_strictly(content)
    assert found.GetName() == 'lifts <5 & "more"'
    assert found.IsManifoldAndOriented()
    mesh = read_3mf(content)
    assert found.GetVertexCount() == len(mesh.vertices)
    kept = np.array([list(vertex.Coordinates) for vertex in found.GetVertices()])
    assert (kept == mesh.vertices.astype(np.float32)).all()


def test_stl_and_3mf_hold_the_same_surface() -> None:
    design = gallery_design("human", "pliers")
    assert design is not None
    bundle = Export(part=PartSpec().of(design))
    one, two = (
        read(exporters[name].to_bytes(bundle))
        for name, read in (("stl", read_stl), ("3mf", read_3mf))
    )
    order = [np.lexsort(mesh.vertices.T) for mesh in (one, two)]
    gap = np.abs(one.vertices[order[0]] - two.vertices[order[1]])
    assert gap.max() < 1e-6
    assert len(one.faces) == len(two.faces)


def test_normals_in_stl_point_outwards() -> None:
    design = gallery_design("human", "crane")
    assert design is not None
    mesh = read_stl(exporters["stl"].to_bytes(Export(part=PartSpec().of(design))))
    top = mesh.triangles_center[:, 2] > 5.119
    assert (mesh.face_normals[top, 2] > 0.999).all()
    assert mesh.volume > 0.0
