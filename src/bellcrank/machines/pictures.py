"""Pictures of actuators as two-ports: curves along the stroke, and the load line."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

from bellcrank.mechanics import Status
from bellcrank.plots import style
from bellcrank.plots.saving import check_target, save_figure

if TYPE_CHECKING:
    import os

    from matplotlib.axes import Axes

    from bellcrank.machines.characterisation import Characterisation

SIZE = (11.4, 4.3)
"""Size of the figure in inches."""
MARGIN, TOP, BOTTOM, GAP = 0.75, 1.05, 0.62, 0.85
COLOURS = (style.OUTPUT, style.INPUT, style.BUILT, "#cc79a7", "#e69f00", "#56b4e9", style.INK)
"""Colours of the curves, in order (Okabe and Ito, 2008)."""
LABELS = (
    ("input displacement", "output displacement"),
    ("input displacement", "input force"),
    ("output displacement", "output force on the load"),
)
"""Horizontal and vertical axis of each panel."""


def draw_characterisation(
    found: Characterisation,
    path: str | os.PathLike[str],
    *,
    title: str = "",
    overwrite: bool = False,
) -> None:
    """Draw the curves of a characterisation, and its load line at the end of the longest stroke.

    Parameters
    ----------
    found
        Characterisation to draw.
    path
        File to write; the suffix png, svg or pdf chooses the format.
    title
        Title; by default the name of the problem.

    Raises
    ------
    InvalidSettings, OutputExists, StorageError

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> from bellcrank.machines import characterise
    >>> from bellcrank.model import human_design
    >>> with TemporaryDirectory() as folder:
    ...     draw_characterisation(characterise(human_design("crane"), points=2), f"{folder}/a.png")
    """
    check_target(path, overwrite=overwrite)
    rest = found.rest
    note = (
        f"at rest: efficiency {rest.efficiency:.3g}, input stiffness {rest.input_stiffness:.3g}, "
        f"output stiffness {rest.output_stiffness:.3g}; lattice units"
    )
    figure = style.new_figure(*SIZE)
    style.add_heading(figure, title or found.name, note, MARGIN, 0.22)
    panels = style.row_of_axes(figure, 3, MARGIN, 0.25, TOP, BOTTOM, GAP)
    for number, curve in enumerate(found.curves):
        colour = COLOURS[number % len(COLOURS)]
        stable = curve.status is Status.CONVERGED
        for axes, across, up in zip(
            panels,
            (curve.motion, curve.motion, curve.output),
            (curve.output, curve.input_force, -curve.output_force),
            strict=True,
        ):
            axes.plot(across, up, color=colour, linewidth=1.6, label=curve.load.label)
            axes.plot(
                across[-1:], up[-1:], color=colour, marker="o" if stable else "X",
                markersize=5.0 if stable else 8.0, linestyle="none", clip_on=False, zorder=3.0,
            )  # fmt: skip
    has_line = rest.connected and found.drive == "displacement" and bool(found.curves)
    if has_line:
        motion = max(float(curve.motion[-1]) for curve in found.curves)
        panels[2].plot(
            [rest.efficiency * motion, 0.0], [0.0, rest.transmitted_stiffness * motion],
            color=style.NOTE, linewidth=1.1, linestyle=(0, (4, 2)), zorder=1.5,
            label="linear load line",
        )  # fmt: skip
    for axes, (x_label, y_label) in zip(panels, LABELS, strict=True):
        style.label_axes(axes, x_label, y_label, style.SMALL_SIZE)
        style.style_axes(axes)
        axes.axhline(0.0, color=style.IDLE, linewidth=0.8, zorder=1.0)
    panels[2].axvline(0.0, color=style.IDLE, linewidth=0.8, zorder=1.0)
    _legend(panels[0], slice(None), "left")
    if has_line:
        _legend(panels[2], slice(-1, None), "right")
    save_figure(figure, path, overwrite=overwrite)


def _legend(axes: Axes, which: slice, side: Literal["left", "right"]) -> None:
    """Write a legend above a panel, where it covers no curve."""
    handles, labels = axes.get_legend_handles_labels()
    axes.legend(
        handles[which], labels[which], loc="lower right" if side == "right" else "lower left",
        bbox_to_anchor=(float(side == "right"), 1.0),
        ncols=max(len(labels[which]), 1), frameon=False, borderaxespad=0.1, handlelength=1.6,
        columnspacing=1.2, prop={"family": style.FONT, "size": style.SMALL_SIZE},
    )  # fmt: skip
