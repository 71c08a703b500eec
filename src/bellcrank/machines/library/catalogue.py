"""The library: folders of entries, searched by their main figures."""

from __future__ import annotations

import difflib
import math
import os
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bellcrank.errors import BellcrankError, InvalidFile, InvalidSettings, UnknownName
from bellcrank.machines.elementary import DIRECTIONS
from bellcrank.machines.library.entry import HASH_DIGITS, MIXED, check_direction, check_kind
from bellcrank.machines.library.files import check_file_name, checked_table, read_entry
from bellcrank.machines.two_port import TwoPort
from bellcrank.model.parsing import read_json

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from bellcrank.machines.library.entry import Entry
    from bellcrank.model import Design

VARIABLE = "BELLCRANK_LIBRARY"
"""Environment variable with the user's folder."""
MIN_DIGITS = 4
"""Smallest number of digits of a hash that is accepted as a name."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Summary:
    """Main figures of an entry, read without building its lattice.

    Parameters
    ----------
    name, direction, columns, kind
        As in `Entry`.
    beams
        Number of beams.
    efficiency
        Efficiency at the full stroke.
    free_efficiency, input_stiffness, output_compliance
        Two-port at rest; the compliance is infinite for an output that is not connected.
    frame_efficiency, frame_status
        Result of the nonlinear frame analysis; nan if the full stroke is not reached.
    warnings
        Whether there are warnings: struts in contact, or a loss of stability.
    gain, off_axis, rotation_deg, travel_mm, payload_N, blocked_force_N, sag_mm
        Figures of the part with 8 elements in each strut; nan if they are unknown.
    """

    name: str
    direction: str
    columns: int | None
    kind: str
    beams: int
    efficiency: float
    free_efficiency: float
    input_stiffness: float
    output_compliance: float
    frame_efficiency: float
    frame_status: str
    warnings: bool
    gain: float = math.nan
    off_axis: float = math.nan
    rotation_deg: float = math.nan
    travel_mm: float = math.nan
    payload_N: float = math.nan  # noqa: N815 - the unit
    blocked_force_N: float = math.nan  # noqa: N815
    sag_mm: float = math.nan

    @property
    def two_port(self) -> TwoPort:
        """The linear two-port at rest."""
        return TwoPort(self.input_stiffness, self.free_efficiency, self.output_compliance)

    def to_dict(self) -> dict[str, Any]:
        """Return plain data for JSON; null for figures that are not finite."""
        return {
            name: None if isinstance(value, float) and not math.isfinite(value) else value
            for name, value in asdict(self).items()
        }


PART_FIGURES = (
    "off_axis", "rotation_deg", "travel_mm", "payload_N", "blocked_force_N", "sag_mm",
)  # fmt: skip
"""Figures of the part in a summary."""
PART_BOUNDS = {
    "gain": 1.0, "off_axis": -1.0, "rotation_deg": -1.0, "travel_mm": 1.0, "payload_N": 1.0,
    "blocked_force_N": 1.0, "sag_mm": -1.0,
}  # fmt: skip
"""Figures that a search may bound: 1 for a lower bound, -1 for an upper one."""


def read_summary(path: Path) -> Summary:
    """Read the main figures of an entry.

    Raises
    ------
    InvalidFile
        If the file is not an entry, or was changed.
    """
    table = checked_table(read_json(path), str(path))
    check_file_name(path, table.name)
    try:
        found, rest = table.characterisation, table.characterisation["rest"]
        return Summary(
            name=table.name,
            direction=table.direction,
            columns=table.columns,
            kind=table.kind,
            beams=found["beams"],
            efficiency=_number(table.design["efficiency"], math.nan),
            free_efficiency=rest["efficiency"],
            input_stiffness=rest["input_stiffness"],
            output_compliance=_number(rest["output_compliance"], math.inf),
            frame_efficiency=_number(table.validation.efficiency, math.nan),
            frame_status=table.validation.status,
            warnings=bool(table.validation.warnings or found["warnings"]),
            gain=_number(table.figures.get("efficiency"), math.nan),
            **{name: _number(table.figures.get(name), math.nan) for name in PART_FIGURES},
        )
    except (KeyError, TypeError, ValueError) as error:
        raise InvalidFile(f"{path}: characterisation or design: {error!r}") from None


def entry_files(folder: Path) -> list[Path]:
    """Return the files of a folder that have the suffix of an entry, sorted."""
    if not folder.is_dir():
        return []
    return sorted(path for path in folder.glob("*.json") if path.name[0] != ".")


def bundled_folder() -> Path:
    """Return the folder of the bundled entries."""
    from importlib.resources import files

    return Path(str(files("bellcrank.machines.library") / "entries"))


def user_folder() -> Path:
    """Return the user's folder, from the environment or in the usual place of user data."""
    if folder := os.environ.get(VARIABLE):
        return Path(folder)
    data = os.environ.get("XDG_DATA_HOME")
    return (Path(data) if data else Path.home() / ".local" / "share") / "bellcrank" / "library"


def _known(value: float) -> float:
    """Return a sort key that puts unknown values last."""
    return math.inf if math.isnan(value) else value


SORTS: dict[str, Callable[[Summary, float], float]] = {
    "efficiency": lambda each, spring: -each.two_port.efficiency_against(spring),
    "stiffness": lambda each, _spring: each.input_stiffness,
    "output-stiffness": lambda each, _spring: -1.0 / each.output_compliance,
    "work": lambda each, _spring: -each.two_port.best_work_share,
    "gain": lambda each, _spring: _known(-each.gain),
    "size": lambda each, _spring: float(each.beams),
    "off-axis": lambda each, _spring: _known(each.off_axis),
    "payload": lambda each, _spring: _known(-each.payload_N),
    "travel": lambda each, _spring: _known(-each.travel_mm),
}
"""Sort keys of a search, smallest first; the second argument is the spring at the output."""


@dataclass(frozen=True, slots=True, eq=False)
class Library:
    """Folders of entries, read on first use.

    Parameters
    ----------
    folders
        Folders in order of precedence for entries of the same name.

    Examples
    --------
    >>> library = Library((bundled_folder(),))
    >>> len(library) >= 60
    True
    """

    folders: tuple[Path, ...]
    _contents: dict[Path, tuple[list[Summary], list[str]]] = field(default_factory=dict, repr=False)

    def __len__(self) -> int:
        return len(self.summaries)

    @property
    def summaries(self) -> list[Summary]:
        """Summaries of all readable entries, sorted by name."""
        found: dict[str, Summary] = {}
        for folder in self.folders:
            for each in self._read(folder)[0]:
                found.setdefault(each.name, each)
        return [found[name] for name in sorted(found)]

    @property
    def damaged(self) -> list[str]:
        """One error message for each file that cannot be read."""
        return [line for folder in self.folders for line in self._read(folder)[1]]

    def names(self) -> list[str]:
        """Return the names of all files, readable or not."""
        return sorted({path.stem for folder in self.folders for path in entry_files(folder)})

    def resolve(self, text: str) -> str:
        """Return the full name of an entry from its name, a unique beginning of it, or its hash.

        Raises
        ------
        UnknownName
            If there is no such entry, or more than one.
        """
        names = self.names()
        if text in names:
            return text
        found = [name for name in names if text and name.startswith(text)]
        if not found and MIN_DIGITS <= len(text) <= HASH_DIGITS:
            found = [name for name in names if name.rpartition("-")[2].startswith(text)]
        if len(found) == 1:
            return found[0]
        if found:
            some = ", ".join(found[:4]) + (", ..." if len(found) > 4 else "")
            raise UnknownName(f"{text!r} is the beginning of {len(found)} library entries: {some}")
        near = difflib.get_close_matches(text, names, n=3, cutoff=0.5)
        hint = f"; similar: {', '.join(near)}" if near else ""
        raise UnknownName(f"no library entry {text!r}{hint}; see bellcrank library list")

    def path(self, text: str) -> Path:
        """Return the file of an entry.

        Raises
        ------
        UnknownName
        """
        name = self.resolve(text)
        for folder in self.folders:
            if (path := folder / f"{name}.json").is_file():
                return path
        raise UnknownName(f"no library entry {name!r}: its file was removed")

    def find(self, text: str) -> Entry:
        """Read an entry by its name, a unique beginning of it, or its hash.

        Raises
        ------
        UnknownName, InvalidFile, InvalidProblem
        """
        return read_entry(self.path(text))

    def design(self, text: str) -> Design | None:
        """Return the design of an entry; None if the text does not have the form of a name.

        Raises
        ------
        UnknownName
            If the text has the form of a name, but there is no such entry, or more than one.
        InvalidFile, InvalidProblem
            If the file is damaged.
        """
        try:
            return self.find(text).design
        except UnknownName:
            if text.startswith(tuple(f"{word}-" for word in (*DIRECTIONS, MIXED))):
                raise
            return None

    def search(
        self,
        *,
        direction: str | None = None,
        columns: int | None = None,
        kind: str | None = None,
        spring: float = 0.0,
        efficiency: float | None = None,
        stiffness: float | None = None,
        output_stiffness: float | None = None,
        no_warnings: bool = False,
        part: Mapping[str, float] | None = None,
        sort: str = "efficiency",
    ) -> list[Summary]:
        """Return the summaries of the entries that satisfy all conditions, the best first.

        Parameters
        ----------
        direction, columns, kind
            Required properties of the entry.
        spring
            Spring at the mean output, for efficiencies from the two-port at rest.
        efficiency
            Minimum efficiency against the spring.
        stiffness
            Maximum input stiffness with a free output.
        output_stiffness
            Minimum output stiffness with the input held.
        no_warnings
            Only entries without warnings: no struts in contact, no loss of stability.
        part
            Bounds on figures of the part, by their names in `PART_BOUNDS`; entries whose figures
            are unknown do not satisfy them.
        sort
            A key of `SORTS`.

        Raises
        ------
        InvalidSettings, UnknownName
            If direction, kind, sort key or a figure is unknown, or the spring is negative.
        """
        if direction is not None:
            check_direction(direction)
        if kind is not None:
            check_kind(kind)
        if sort not in SORTS:
            raise InvalidSettings(f"sort: expected one of {', '.join(SORTS)}, got {sort!r}")
        if not spring >= 0.0:
            raise InvalidSettings(f"spring: expected a stiffness of at least 0, got {spring!r}")

        bounds = dict(part or {})
        for name in bounds:
            if name not in PART_BOUNDS:
                raise InvalidSettings(
                    f"part: expected one of {', '.join(PART_BOUNDS)}, got {name!r}"
                )

        def matches(each: Summary) -> bool:
            return (
                direction in (None, each.direction)
                and columns in (None, each.columns)
                and kind in (None, each.kind)
                and (efficiency is None or each.two_port.efficiency_against(spring) >= efficiency)
                and (stiffness is None or each.input_stiffness <= stiffness)
                and (output_stiffness is None or output_stiffness * each.output_compliance <= 1.0)
                and not (each.warnings and no_warnings)
                and all(
                    PART_BOUNDS[name] * (getattr(each, name) - bound) >= 0.0
                    for name, bound in bounds.items()
                )
            )

        key = SORTS[sort]
        return sorted(filter(matches, self.summaries), key=lambda each: key(each, spring))

    def _read(self, folder: Path) -> tuple[list[Summary], list[str]]:
        """Return the summaries of a folder, and the errors of files that cannot be read."""
        if folder not in self._contents:
            found, damaged = [], []
            for path in entry_files(folder):
                try:
                    found.append(read_summary(path))
                except BellcrankError as error:
                    damaged.append(str(error))
            self._contents[folder] = found, damaged
        return self._contents[folder]


def library() -> Library:
    """Return the library: the user's folder and the bundled entries."""
    return Library((user_folder(), bundled_folder()))


def find_entry(text: str) -> Entry:
    """Read an entry of the library by its name, a unique beginning of it, or its hash.

    Raises
    ------
    UnknownName, InvalidFile, InvalidProblem

    Examples
    --------
    >>> find_entry("up-9-strait")  # doctest: +ELLIPSIS
    Traceback (most recent call last):
        ...
    bellcrank.errors.UnknownName: no library entry 'up-9-strait'...; see bellcrank library list
    """
    return library().find(text)


def _number(value: Any, missing: float) -> float:
    return missing if value is None else float(value)
