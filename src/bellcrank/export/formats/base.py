"""What is written to files, and the registry of formats."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.errors import InvalidSettings, UnknownName
from bellcrank.export.flattening import SAGITTA
from bellcrank.export.solid import Solid, extruded, whole_layers
from bellcrank.model.storage import already_exists, write_bytes
from bellcrank.registry import Registry

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from bellcrank.part import Part
    from bellcrank.part.outline import Outline

LAYER = 0.32
"""Default height of printed layers, mm."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Export:
    """A part, and what else may be written of it.

    Parameters
    ----------
    part
        The part.
    shape
        Its outline with whatever was changed of it, such as plates to clamp; None for the
        part's own.
    layer : float, mm
        Height of printed layers: the part is as thick as whole layers make it. None for its
        own thickness.
    sagitta : float, mm
        Greatest distance between arcs and the triangles of STL and 3MF.
    moved : (N, 2) float64, lattice units
        Nodes where the part has moved them; None for those at rest.
    frames : (F, N, 2) float64, lattice units
        Nodes along a motion, for formats that hold one.
    title
        What to call it; None for the name of the problem.

    Raises
    ------
    InvalidSettings
        If an array has the wrong shape or holds what is no number.
    """

    part: Part
    shape: Outline | None = None
    layer: float | None = LAYER
    sagitta: float = SAGITTA
    moved: NDArray[np.float64] | None = None
    frames: NDArray[np.float64] | None = None
    title: str | None = None

    def __post_init__(self) -> None:
        count = self.part.design.problem.lattice.node_count
        for name, expected in (("moved", (count, 2)), ("frames", (-1, count, 2))):
            given = getattr(self, name)
            if given is None:
                continue
            array = np.array(given, dtype=np.float64, order="C")
            if array.ndim != len(expected) or array.shape[-2:] != (count, 2) or not array.size:
                wanted = str(expected).replace("-1", "F")
                raise InvalidSettings(f"{name}: expected shape {wanted}, got {array.shape}")
            if not np.isfinite(array).all():
                first = np.argwhere(~np.isfinite(array))[0].tolist()
                raise InvalidSettings(f"{name}{first}: expected a finite number")
            array.flags.writeable = False
            object.__setattr__(self, name, array)

    @property
    def name(self) -> str:
        """What it is called in a file."""
        return self.part.design.problem.name if self.title is None else self.title

    @property
    def thickness(self) -> float:
        """Of the part as it is printed, mm."""
        wanted = self.part.section.thickness
        return wanted if self.layer is None else whole_layers(wanted, self.layer)

    def outline(self) -> Outline:
        """Return the planar outline.

        Raises
        ------
        InvalidSettings
            If struts or fillets are so wide that holes between them close.
        """
        return self.part.outline() if self.shape is None else self.shape

    def solid(self) -> Solid:
        """Return the surface of the part as it is printed, on the bed of a printer.

        Raises
        ------
        InvalidSettings
            If there can be no such part.
        """
        # What can be refused at once comes before what takes long.
        thickness = self.thickness
        return extruded(self.outline(), thickness, self.sagitta).on_the_bed()


@dataclass(frozen=True, slots=True)
class Exporter:
    """A format.

    Parameters
    ----------
    suffixes
        The endings of its files, the usual one first.
    to_bytes
        The whole content of a file.
    """

    suffixes: tuple[str, ...]
    to_bytes: Callable[[Export], bytes]


exporters: Registry[Exporter] = Registry("export format")


def exporter_for(path: str | os.PathLike[str]) -> Exporter:
    """Return the format that the suffix of a file names.

    Raises
    ------
    UnknownName
        If there is none; lists those there are.

    Examples
    --------
    >>> exporter_for("crane.stp").suffixes
    ('.step', '.stp')
    """
    suffix = Path(path).suffix.lower()
    for entry in exporters.values():
        if suffix in entry.suffixes:
            return entry
    known = ", ".join(suffix for entry in exporters.values() for suffix in entry.suffixes)
    raise UnknownName(f"{path}: unknown export format {suffix!r}; known suffixes: {known}")


def export(what: Export | Part, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    """Write a part to a file, in the format that its suffix names, whole or not at all.

    Parameters
    ----------
    what
        A part, or one with what else there is to write of it.
    path
        The file.
    overwrite
        Whether to replace what is there.

    Raises
    ------
    UnknownName
        If no format has that suffix.
    InvalidSettings
        If there can be no such part, or the format needs what is not installed.
    OutputExists
        If the file exists and `overwrite` is not set.
    StorageError
        If it cannot be written.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> from bellcrank.model import human_design
    >>> from bellcrank.part import PartSpec
    >>> part = PartSpec().of(human_design("crane"))
    >>> with TemporaryDirectory() as folder:
    ...     export(part, f"{folder}/crane.3mf")
    ...     os.listdir(folder)
    ['crane.3mf']
    """
    chosen = exporter_for(path)
    if not overwrite and os.path.lexists(path):
        raise already_exists(Path(path))
    bundle = what if isinstance(what, Export) else Export(part=what)
    write_bytes(path, chosen.to_bytes(bundle), overwrite=overwrite)
