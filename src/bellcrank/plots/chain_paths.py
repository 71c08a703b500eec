"""Efficiency along the chains of a search."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, get_args

import numpy as np
from matplotlib import colormaps
from matplotlib.colors import to_hex
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import FuncFormatter

from bellcrank.errors import InvalidSettings
from bellcrank.plots import style
from bellcrank.plots.downsampling import downsample
from bellcrank.plots.legend import add_legend
from bellcrank.plots.saving import check_target, save_figure

if TYPE_CHECKING:
    import os
    from collections.abc import Sequence

    from matplotlib.axes import Axes
    from numpy.typing import NDArray

WIDTH = 7.0
HEIGHT = 4.6
LONG = 15.0
"""Ratio of the chain length to the annealing phase from which the axis is logarithmic."""

Axis = Literal["accepted", "proposals"]
LineStyle = dict[str, Any]
BEST_LINE: LineStyle = {"color": style.BEST, "linewidth": 1.6}
HUMAN_LINE: LineStyle = {"color": style.HUMAN, "linewidth": 1.5, "linestyle": (0, (5, 2.5))}
FINAL_LINE: LineStyle = {"color": style.BUILT, "linewidth": 1.5, "linestyle": (0, (1.2, 1.2))}


@dataclass(frozen=True, slots=True, eq=False)
class ChainPath:
    """The efficiencies of the designs that a chain accepted, in order.

    Parameters
    ----------
    efficiency : (n,) float64
        Efficiency of the current design after each accepted change; nan if undefined.
    step : (n,) int64
        Proposal at which each change was accepted, not decreasing; required only for an axis of
        proposals.

    Raises
    ------
    InvalidSettings
        If an array has the wrong shape.

    Examples
    --------
    >>> ChainPath(np.array([-0.06, 0.1, 0.3])).peak
    2
    """

    efficiency: NDArray[np.float64]
    step: NDArray[np.int64] | None = None

    def __post_init__(self) -> None:
        efficiency = np.array(self.efficiency, dtype=np.float64)
        if efficiency.ndim != 1:
            raise InvalidSettings(f"efficiency: expected shape (n,), got {efficiency.shape}")
        efficiency[~np.isfinite(efficiency)] = np.nan
        efficiency.flags.writeable = False
        object.__setattr__(self, "efficiency", efficiency)
        if self.step is not None:
            step = np.array(self.step, dtype=np.int64)
            if step.shape != efficiency.shape:
                raise InvalidSettings(
                    f"step: expected shape {efficiency.shape}, one for each efficiency, "
                    f"got {step.shape}"
                )
            step.flags.writeable = False
            object.__setattr__(self, "step", step)

    @property
    def peak(self) -> int | None:
        """Index of the largest efficiency; None if there is none."""
        if not np.isfinite(self.efficiency).any():
            return None
        return int(np.nanargmax(self.efficiency))

    def along(self, axis: Axis) -> NDArray[np.float64]:
        """(n,) position of each accepted change on an axis, starting at 1.

        Raises
        ------
        InvalidSettings
            If the axis shows proposals and `step` is None.
        """
        if axis == "accepted":
            return np.arange(1.0, len(self.efficiency) + 1.0)
        if self.step is None:
            raise InvalidSettings("step: required for an axis of proposals")
        return self.step.astype(np.float64) + 1.0


@dataclass(frozen=True, slots=True)
class PathOptions:
    """Options of `draw_paths`.

    Parameters
    ----------
    title
        Heading of the figure.
    annealing_steps
        Number of accepted changes during which the temperature decreases; 0 for none.
    human_efficiency, final_efficiency
        Efficiencies of the human design and of the final design after the removal of unloaded
        beams, drawn as horizontal lines.
    is_refined
        Whether the final design is a refined one.
    best
        Chain and index of the selected design; by default the design with the largest
        efficiency is marked.
    axis
        ``"accepted"`` changes (as in the paper) or ``"proposals"``.
    measure
        Label of the vertical axis.
    """

    title: str = ""
    annealing_steps: int = 0
    human_efficiency: float | None = None
    final_efficiency: float | None = None
    is_refined: bool = False
    best: tuple[int, int] | None = None
    axis: Axis = "accepted"
    measure: str = "efficiency"


def draw_paths(
    chains: Sequence[ChainPath],
    path: str | os.PathLike[str],
    options: PathOptions | None = None,
    *,
    overwrite: bool = False,
) -> None:
    """Draw the efficiency of the current design along each chain.

    The chain with the best design is highlighted. Curves are downsampled without losing a peak.
    If the annealing phase is a small fraction of the chains, the axis is logarithmic.

    Parameters
    ----------
    chains
        At least one.
    path
        Output file; the suffix png, svg or pdf selects the format.
    options
        Additional content of the figure.
    overwrite
        Whether an existing file is replaced.

    Raises
    ------
    InvalidSettings
        If there is no chain, `best` does not exist, or the suffix is unknown.
    OutputExists, StorageError
        If the file exists or cannot be written.

    Examples
    --------
    >>> import os
    >>> from tempfile import TemporaryDirectory
    >>> chains = [ChainPath(np.linspace(-0.06, top, 50)) for top in (1.2, 2.1)]
    >>> with TemporaryDirectory() as folder:
    ...     draw_paths(chains, f"{folder}/efficiency.svg", PathOptions(annealing_steps=20))
    ...     os.listdir(folder)
    ['efficiency.svg']
    """
    options = options or PathOptions()
    check_target(path, overwrite=overwrite)
    best = _best(chains, options)
    note = f"{len(chains)} chain{'s' * (len(chains) > 1)}"
    if best is not None:
        note += f" · {_adjective(options)} design {chains[best[0]].efficiency[best[1]]:.3f}"
    if options.human_efficiency is not None:
        note += f" · human design {options.human_efficiency:.3f}"
    figure = style.new_figure(WIDTH, HEIGHT)
    style.add_heading(figure, options.title, note, 0.25, 0.22)
    top = 0.22 + style.heading_height(options.title, note) + 0.12
    axes = figure.add_axes(
        (0.72 / WIDTH, 0.92 / HEIGHT, (WIDTH - 0.72 - 0.3) / WIDTH, (HEIGHT - top - 0.92) / HEIGHT)
    )
    _fill(axes, chains, options, best)
    add_legend(figure, _legend_entries(chains, options, best), 0.2, columns=5)
    save_figure(figure, path, overwrite=overwrite)


def _best(chains: Sequence[ChainPath], options: PathOptions) -> tuple[int, int] | None:
    """Check the arguments; return chain and index of the best design."""
    if len(chains) == 0:
        raise InvalidSettings("chains: expected at least one chain")
    if options.axis not in get_args(Axis):
        raise InvalidSettings(
            f"axis: expected one of {', '.join(get_args(Axis))}, got {options.axis!r}"
        )
    if options.best is None:
        peaks = [
            (c.efficiency[c.peak], k, c.peak) for k, c in enumerate(chains) if c.peak is not None
        ]
        return max(peaks, key=lambda peak: peak[0])[1:] if peaks else None
    chain, index = options.best
    if not (0 <= chain < len(chains) and 0 <= index < len(chains[chain].efficiency)):
        raise InvalidSettings(f"best: no design with index {index} in chain {chain}")
    return options.best


def _fill(
    axes: Axes, chains: Sequence[ChainPath], options: PathOptions, best: tuple[int, int] | None
) -> None:
    ends = [chain.along(options.axis)[-1] for chain in chains if len(chain.efficiency)]
    longest = float(max(ends, default=1.0))
    annealing = _annealing_end(chains, options)
    logarithmic = annealing > 0.0 and longest > LONG * annealing
    _style(axes, options, longest, logarithmic=logarithmic)
    if annealing > 0.0:
        axes.axvspan(axes.get_xlim()[0], annealing, color=style.SHADE, linewidth=0, zorder=0)
    others = [k for k in range(len(chains)) if best is None or k != best[0]]
    for index, k in enumerate(others):
        line_style: LineStyle = {"color": _grey(index, len(others)), "linewidth": 0.9}
        _add_curve(axes, chains[k], options.axis, line_style, level=2.0)
    if best is not None:
        chain, index = chains[best[0]], best[1]
        _add_curve(axes, chain, options.axis, BEST_LINE, level=3.0)
        axes.add_line(_marker_at(chain.along(options.axis)[index], chain.efficiency[index]))
    for value, line_style, _ in _levels(options):
        axes.axhline(value, zorder=4, **line_style)


def _levels(options: PathOptions) -> list[tuple[float, LineStyle, str]]:
    """Return value, style and label of the horizontal lines."""
    lines = (
        (options.human_efficiency, HUMAN_LINE, "human design"),
        (
            options.final_efficiency,
            FINAL_LINE,
            "refined design" if options.is_refined else "final design",
        ),
    )
    return [
        (v, line_style, label) for v, line_style, label in lines if v is not None and np.isfinite(v)
    ]


def _adjective(options: PathOptions) -> str:
    """Return the adjective of the marked design; a selected one need not be the best."""
    return "best" if options.best is None else "selected"


def _legend_entries(
    chains: Sequence[ChainPath], options: PathOptions, best: tuple[int, int] | None
) -> list[tuple[str, Any]]:
    """Return legend entries for the elements that the figure contains."""
    entries: list[tuple[str, Any]] = []
    if _annealing_end(chains, options) > 0.0:
        entries.append(("annealing", Patch(color=style.SHADE)))
    if best is None or len(chains) > 1:
        line = Line2D([], [], color=_grey(0, 1), linewidth=1.2)
        entries.append(("chains" if best is None else "other chains", line))
    if best is not None:
        star = _marker_at(0.0, 0.0)
        star.set(**BEST_LINE, linestyle="solid")
        entries.append((f"{_adjective(options)} chain", star))
    return entries + [
        (label, Line2D([], [], **line_style)) for _, line_style, label in _levels(options)
    ]


def _annealing_end(chains: Sequence[ChainPath], options: PathOptions) -> float:
    """Return the position at which the last chain ends its annealing phase."""
    steps = options.annealing_steps
    ends = [
        chain.along(options.axis)[min(steps, len(chain.efficiency)) - 1]
        for chain in chains
        if len(chain.efficiency)
    ]
    return float(max(ends, default=0.0)) if steps > 0 else 0.0


def _style(axes: Axes, options: PathOptions, longest: float, *, logarithmic: bool) -> None:
    """Set scale, limits and labels of the axes."""
    if logarithmic:
        axes.set_xscale("log")
        axes.set_xlim(1.0, longest * 1.05)
    else:
        axes.set_xlim(0.0, max(longest, 1.0) * 1.02)
    if not logarithmic or longest < 1e6:
        axes.xaxis.set_major_formatter(
            FuncFormatter(lambda x, _position: f"{x:,.0f}".replace(",", "\u202f"))
        )
    labels = {"accepted": "accepted changes", "proposals": "proposals"}
    style.label_axes(axes, labels[options.axis], options.measure)
    style.style_axes(axes)


def _add_curve(
    axes: Axes, chain: ChainPath, axis: Axis, line_style: LineStyle, level: float
) -> None:
    """Draw one chain, downsampled to the resolution of the picture."""
    x = chain.along(axis)
    selected = downsample(np.log(x) if axes.get_xscale() == "log" else x, chain.efficiency)
    axes.plot(
        x[selected], chain.efficiency[selected], drawstyle="steps-post",
        solid_joinstyle="round", zorder=level, **line_style,
    )  # fmt: skip


def _marker_at(x: float, y: float) -> Line2D:
    """Return the star that marks the best design."""
    return Line2D(
        [x],
        [y],
        linestyle="none",
        marker="*",
        markersize=14,
        markerfacecolor=style.BEST,
        markeredgecolor="white",
        markeredgewidth=1.0,
        zorder=6,
        clip_on=False,
    )


def _grey(index: int, count: int) -> str:
    """Return one of `count` bluish greys, so that neighbouring chains can be distinguished."""
    fraction = index / max(count - 1, 1)
    return to_hex(colormaps["bone"](0.45 + 0.35 * fraction))
