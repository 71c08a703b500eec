"""Exported files, read back by other means than those that wrote them."""

from __future__ import annotations

import importlib.util
import io
import json
import math
import re
import subprocess
import sys
import xml.etree.ElementTree as ET
import zipfile
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
import shapely
import trimesh

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

CORE = "{http://schemas.microsoft.com/3dmanufacturing/core/2015/02}"


def read_stl(content: bytes) -> trimesh.Trimesh:
    """Triangles that share corners only if these are equal to the last bit."""
    return trimesh.load(io.BytesIO(content), file_type="stl")


def read_3mf(content: bytes) -> trimesh.Trimesh:
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        root = ET.fromstring(archive.read("3D/3dmodel.model"))
    assert root.get("unit") == "millimeter"
    (mesh,) = root.iter(f"{CORE}mesh")
    vertices = [[float(v.get(k, "")) for k in "xyz"] for v in mesh.iter(f"{CORE}vertex")]
    corners = ("v1", "v2", "v3")
    triangles = [[int(t.get(k, "")) for k in corners] for t in mesh.iter(f"{CORE}triangle")]
    return trimesh.Trimesh(vertices, triangles, process=False)


def read_3mf_strictly(content: bytes) -> Any:
    """The one object of a file, as the 3MF Consortium's own library reads it."""
    import lib3mf

    model = lib3mf.get_wrapper().CreateModel()
    reader = model.QueryReader("3mf")
    reader.SetStrictModeActive(True)
    reader.ReadFromBuffer(content)
    assert reader.GetWarningCount() == 0
    objects = model.GetMeshObjects()
    assert objects.Count() == 1
    objects.MoveNext()
    return objects.GetCurrentMeshObject()


def area_in_dxf(path: Path) -> float:
    """Area of all that lies within an odd number of polylines, from points and bulges."""
    import ezdxf

    drawing = ezdxf.readfile(path)
    audit = drawing.audit()
    assert not audit.errors
    assert not audit.fixes
    area = 0.0
    for line in drawing.modelspace().query("LWPOLYLINE"):
        assert line.closed
        points = np.array(line.get_points("xyb"))
        sign = {"outline": 1.0, "holes": -1.0}[line.dxf.layer]
        around = loop_area(points[:, :2], 4.0 * np.arctan(points[:, 2]))
        assert math.copysign(1.0, around) == sign
        area += around
    return area


def area_in_svg(text: str) -> float:
    """Area of the outline, from the words of its path, with y downwards."""
    root = ET.fromstring(text)
    (path,) = root.iter("{http://www.w3.org/2000/svg}path")
    area = 0.0
    for part in path.get("d", "").split("Z")[:-1]:
        points, turns = [], []
        for letter, words in re.findall(r"([MLA])([-+0-9.e ]+)", part):
            numbers = [float(word) for word in words.split()]
            if letter == "A":
                rx, ry, tilt, large, sweep, *end = numbers
                assert (rx, tilt, large) == (ry, 0.0, 0.0)
                half = min(0.5 * math.dist(points[-1], end) / rx, 1.0)
                turns.append(2.0 * math.asin(half) * (1.0 if sweep else -1.0))
                points.append(end)
            else:
                points.append(numbers)
                turns += [0.0] * (letter == "L")
        assert points[0] == points[-1]
        area -= loop_area(np.array(points[:-1]), np.array(turns))
    return area


def loop_area(points: NDArray[np.float64], turns: NDArray[np.float64]) -> float:
    """Area that lines and arcs enclose, from corners and angles of arcs."""
    ends = np.roll(points, -1, axis=0)
    chord = np.linalg.norm(ends - points, axis=1)
    curved = turns != 0.0
    radius = 0.5 * chord[curved] / np.sin(0.5 * np.abs(turns[curved]))
    segments = 0.5 * radius**2 * (turns[curved] - np.sin(turns[curved]))
    corners = 0.0
    if len(points) > 2:
        ring = shapely.LinearRing(points)
        corners = shapely.Polygon(ring).area * (1.0 if ring.is_ccw else -1.0)
    return float(corners + segments.sum())


def read_step(path: Path) -> tuple[float, int, bool]:
    """Volume and number of the solids of a STEP file, and whether they are sound.

    In a process of its own, like the writer: NGSolve brings another version of the kernel.
    """
    words = [sys.executable, "-c", READER, str(path)]
    done = subprocess.run(words, capture_output=True, text=True, check=True)
    volume, count, sound = json.loads(done.stdout.splitlines()[-1])
    return volume, count, sound


READER = """
import json, sys
from OCP.BRepCheck import BRepCheck_Analyzer
from OCP.BRepGProp import BRepGProp
from OCP.GProp import GProp_GProps
from OCP.STEPControl import STEPControl_Reader
from OCP.TopAbs import TopAbs_ShapeEnum
from OCP.TopExp import TopExp_Explorer

reader = STEPControl_Reader()
reader.ReadFile(sys.argv[1])
reader.TransferRoots()
shape = reader.OneShape()
properties = GProp_GProps()
BRepGProp.VolumeProperties_s(shape, properties)
explorer = TopExp_Explorer(shape, TopAbs_ShapeEnum.TopAbs_SOLID)
count = 0
while explorer.More():
    count += 1
    explorer.Next()
print()
print(json.dumps([properties.Mass(), count, BRepCheck_Analyzer(shape).IsValid()]))
"""


def require_kernel() -> None:
    """Skip without Open CASCADE, and do not import it: NGSolve brings another version of it."""
    if importlib.util.find_spec("OCP") is None:
        pytest.skip("Open CASCADE is not installed")
