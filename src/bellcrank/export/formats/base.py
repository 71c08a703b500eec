"""Content of exported files, and the registry of their formats."""

from __future__ import annotations

import importlib.util
import os
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.errors import InvalidSettings
from bellcrank.export.flattening import SAGITTA
from bellcrank.export.solid import Solid, extruded, whole_layers
from bellcrank.export.struts import struts_solid
from bellcrank.model.storage import already_exists, write_bytes
from bellcrank.registry import FormatRegistry

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from bellcrank.part import Part
    from bellcrank.part.outline import Outline

LAYER = 0.32
"""Default height of printed layers, mm."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Export:
    """A part with the options and data that formats can use.

    Parameters
    ----------
    part
        The part.
    shape
        Its outline with changes such as a clamping plate; None for the outline of the part.
    layer : float, mm
        Height of printed layers: the thickness is rounded to whole layers. None for the thickness
        of the part.
    sagitta : float, mm
        Largest distance between arcs and the triangles of STL and 3MF.
    moved : (N, d) float64, lattice units
        Displaced nodes; None for nodes at rest.
    title
        Title in the file; None for the name of the problem.

    Raises
    ------
    InvalidSettings
        If an array has the wrong shape or is not finite.
    """

    part: Part
    shape: Outline | None = None
    layer: float | None = LAYER
    sagitta: float = SAGITTA
    moved: NDArray[np.float64] | None = None
    title: str | None = None

    def __post_init__(self) -> None:
        if self.moved is None:
            return
        expected = self.part.positions.shape
        moved = np.array(self.moved, dtype=np.float64, order="C")
        if moved.shape != expected:
            raise InvalidSettings(f"moved: expected shape {expected}, got {moved.shape}")
        if not np.isfinite(moved).all():
            first = np.argwhere(~np.isfinite(moved))[0].tolist()
            raise InvalidSettings(f"moved{first}: expected a finite number")
        moved.flags.writeable = False
        object.__setattr__(self, "moved", moved)

    @property
    def name(self) -> str:
        """Title in the file."""
        return self.part.design.problem.name if self.title is None else self.title

    @property
    def thickness(self) -> float:
        """Thickness of the printed part in the plane, height of one in space, mm."""
        if self.part.dimension == 3:
            ends, radii = self.part.positions[self.part.struts, 2].T, 0.5 * self.part.widths
            return float((ends + radii).max() - (ends - radii).min())
        wanted = self.part.section.thickness
        return wanted if self.layer is None else whole_layers(wanted, self.layer)

    def outline(self) -> Outline:
        """Return the planar outline.

        Raises
        ------
        InvalidSettings
            If struts or fillets close holes between struts.
        """
        return self.part.outline() if self.shape is None else self.shape

    def solid(self) -> Solid:
        """Return the surface of the printed part, with its lowest corner at the origin.

        Raises
        ------
        InvalidSettings
            If the part is not valid.
        """
        if self.part.dimension == 3:
            return struts_solid(self.part, self.sagitta).on_bed()
        # Validated before the outline, which takes longer.
        thickness = self.thickness
        return extruded(self.outline(), thickness, self.sagitta).on_bed()


@dataclass(frozen=True, slots=True)
class Exporter:
    """A file format.

    Parameters
    ----------
    suffixes
        Suffixes of its files, the usual one first.
    to_bytes
        Function that returns the content of a file.
    module, extra
        Optional module that the format needs, and the extra of bellcrank that installs it.
    """

    suffixes: tuple[str, ...]
    to_bytes: Callable[[Export], bytes]
    module: str = ""
    extra: str = ""

    def check_installed(self) -> None:
        """Check that the module of the format is installed.

        Raises
        ------
        InvalidSettings
            If not; names the extra to install.
        """
        if self.module and importlib.util.find_spec(self.module) is None:
            raise InvalidSettings(
                f"{self.suffixes[0]} files need the module {self.module}; install it with: "
                f"pip install 'bellcrank[{self.extra}]'"
            )


exporters: FormatRegistry[Exporter] = FormatRegistry("export format")


def export(what: Export | Part, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    """Write a part to a file in the format of its suffix, atomically.

    Parameters
    ----------
    what
        A part, or a part with options.
    path
        The file.
    overwrite
        Whether to replace an existing file.

    Raises
    ------
    UnknownName
        If no format has that suffix.
    InvalidSettings
        If the part is not valid, or the module of the format is not installed.
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
    chosen = exporters.for_path(path)
    chosen.check_installed()
    if not overwrite and os.path.lexists(path):
        raise already_exists(Path(path))
    bundle = what if isinstance(what, Export) else Export(part=what)
    write_bytes(path, chosen.to_bytes(bundle), overwrite=overwrite)
