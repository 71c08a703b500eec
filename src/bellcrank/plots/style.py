"""Style shared by all pictures: colours, font, resolution, headings, axes.

The colours are those of Okabe and Ito (2008), which colour-blind readers can distinguish, on
greys for the structure. All style is passed explicitly: the global settings of matplotlib are
not changed.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.text import Text

DPI = 200
FONT = "DejaVu Sans"
"""Part of matplotlib, so that pictures are the same on all machines."""
TITLE_SIZE = 13.0
LABEL_SIZE = 10.5
SMALL_SIZE = 9.5

INK = "#1a1d21"
NOTE = "#5b636c"
REST = "#d4d8dc"
IDLE = "#8f98a1"
IDLE_REST = "#e6e9ec"
GROUND = "#b4bac1"
GROUND_FILL = "#f1f3f5"
NOT_DESIGNABLE = "#9db4c8"
INPUT = "#d55e00"
OUTPUT = "#0072b2"
WANTED = "#7fc0ea"
HUMAN = "#d55e00"
BUILT = "#009e73"
BEST = "#0072b2"
SHADE = "#fbf3e0"


def new_figure(width: float, height: float) -> Figure:
    """Return an empty white figure, `width` by `height` inches, drawn by Agg.

    Examples
    --------
    >>> new_figure(4, 3).get_size_inches().tolist()
    [4.0, 3.0]
    """
    figure = Figure(figsize=(width, height), dpi=DPI, facecolor="white")
    FigureCanvasAgg(figure)
    return figure


def add_heading(figure: Figure, title: str, note: str, left: float, top: float) -> list[Text]:
    """Add a title and a grey note below it.

    Parameters
    ----------
    left, top
        Position of the upper left corner, inches from the left and the upper edge.
    """
    width, height = figure.get_size_inches()
    texts = []
    for text, size, colour, weight, offset in (
        (title, TITLE_SIZE, INK, "bold", 0.0),
        (note, LABEL_SIZE, NOTE, "normal", 0.27 if title else 0.0),
    ):
        if text:
            texts.append(
                figure.text(
                    left / width,
                    1.0 - (top + offset) / height,
                    text,
                    size=size,
                    color=colour,
                    weight=weight,
                    family=FONT,
                    ha="left",
                    va="top",
                    parse_math=False,  # names may contain $
                )
            )
    return texts


def heading_height(title: str, note: str) -> float:
    """Return the height of the text of `add_heading`, inches."""
    return 0.27 * bool(title) + 0.24 * bool(note)


def row_of_axes(
    figure: Figure, count: int, left: float, right: float, top: float, bottom: float, gap: float
) -> list[Axes]:
    """Add axes of equal size in a row.

    Parameters
    ----------
    left, right, top, bottom
        Margins of the figure, inches.
    gap
        Distance between axes, inches.

    Examples
    --------
    >>> row = row_of_axes(new_figure(8, 4), 2, left=1, right=1, top=1, bottom=1, gap=2)
    >>> [axes.get_position().extents.round(3).tolist() for axes in row]
    [[0.125, 0.25, 0.375, 0.75], [0.625, 0.25, 0.875, 0.75]]
    """
    width, height = figure.get_size_inches().tolist()
    across = (width - left - right - (count - 1) * gap) / count
    return [
        figure.add_axes(
            (
                (left + index * (across + gap)) / width,
                bottom / height,
                across / width,
                (height - top - bottom) / height,
            )
        )
        for index in range(count)
    ]


def style_axes(axes: Axes) -> None:
    """Set ticks, a horizontal grid and two spines in grey."""
    axes.tick_params(which="both", labelsize=SMALL_SIZE, colors=NOTE, labelfontfamily=FONT)
    axes.grid(axis="y", color=IDLE_REST, linewidth=0.8)
    axes.set_axisbelow(True)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    for side in ("left", "bottom"):
        axes.spines[side].set_color(IDLE)


def label_axes(axes: Axes, x_label: str, y_label: str, size: float = LABEL_SIZE) -> None:
    """Set the labels of both axes."""
    axes.set_xlabel(x_label, size=size, color=INK, family=FONT)
    axes.set_ylabel(y_label, size=size, color=INK, family=FONT)
