"""The paper's figure of how the efficiency of chains grows with the accepted changes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, get_args

import numpy as np
from matplotlib import colormaps
from matplotlib.colors import to_hex
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import FuncFormatter

from bellcrank.errors import InvalidSettings
from bellcrank.plots import style
from bellcrank.plots.chains import Axis, ChainPath, PathsStyle
from bellcrank.plots.downsampling import thin
from bellcrank.plots.legend import add_legend
from bellcrank.plots.saving import check_target, save_figure

if TYPE_CHECKING:
    import os
    from collections.abc import Sequence

    from matplotlib.axes import Axes

WIDTH = 7.0
HEIGHT = 4.6
LONG = 15.0
"""Beyond so many times the annealing phase, a linear axis would hide it."""

Looks = dict[str, Any]
BEST_LINE: Looks = {"color": style.BEST, "linewidth": 1.6}
HUMAN_LINE: Looks = {"color": style.HUMAN, "linewidth": 1.5, "linestyle": (0, (5, 2.5))}
BUILT_LINE: Looks = {"color": style.BUILT, "linewidth": 1.5, "linestyle": (0, (1.2, 1.2))}


def draw_paths(
    chains: Sequence[ChainPath],
    path: str | os.PathLike[str],
    shown: PathsStyle | None = None,
    *,
    overwrite: bool = False,
) -> None:
    """Draw the efficiency of the current design along each chain.

    The chain that holds the best design stands out. Curves of any length are thinned
    without losing a peak. Where the annealing phase would vanish in the length of the
    chains, the axis is logarithmic.

    Parameters
    ----------
    chains
        At least one.
    path
        Where to; the suffix png, svg or pdf chooses the format.
    shown
        What to show beside the chains.
    overwrite
        Whether to replace what is there.

    Raises
    ------
    InvalidSettings
        If there is no chain, `best` is not in it, or the suffix names no format.
    OutputExists, StorageError
        If there is such a file, or it cannot be written.

    Examples
    --------
    >>> import os
    >>> from tempfile import TemporaryDirectory
    >>> chains = [ChainPath(np.linspace(-0.06, top, 50)) for top in (1.2, 2.1)]
    >>> with TemporaryDirectory() as folder:
    ...     draw_paths(chains, f"{folder}/efficiency.svg", PathsStyle(annealing_steps=20))
    ...     os.listdir(folder)
    ['efficiency.svg']
    """
    shown = shown or PathsStyle()
    check_target(path, overwrite=overwrite)
    best = _check(chains, shown)
    note = f"{len(chains)} chain{'s' * (len(chains) > 1)}"
    if best is not None:
        note += f" · {_word(shown)} design {chains[best[0]].efficiency[best[1]]:.3f}"
    if shown.human_efficiency is not None:
        note += f" · human design {shown.human_efficiency:.3f}"
    figure = style.new_figure(WIDTH, HEIGHT)
    style.write_heading(figure, shown.title, note, 0.25, 0.22)
    top = 0.22 + style.heading_height(shown.title, note) + 0.12
    axes = figure.add_axes(
        (0.72 / WIDTH, 0.92 / HEIGHT, (WIDTH - 0.72 - 0.3) / WIDTH, (HEIGHT - top - 0.92) / HEIGHT)
    )
    _fill(axes, chains, shown, best)
    add_legend(figure, _entries(chains, shown, best), 0.2, columns=5)
    save_figure(figure, path, overwrite=overwrite)


def _check(chains: Sequence[ChainPath], shown: PathsStyle) -> tuple[int, int] | None:
    """Check what is to be drawn; return where the best design is."""
    if len(chains) == 0:
        raise InvalidSettings("chains: expected at least one to draw")
    if shown.axis not in get_args(Axis):
        raise InvalidSettings(
            f"axis: expected one of {', '.join(get_args(Axis))}, got {shown.axis!r}"
        )
    if shown.best is None:
        peaks = [
            (c.efficiency[c.peak], k, c.peak) for k, c in enumerate(chains) if c.peak is not None
        ]
        return max(peaks, key=lambda peak: peak[0])[1:] if peaks else None
    chain, index = shown.best
    if not (0 <= chain < len(chains) and 0 <= index < len(chains[chain].efficiency)):
        raise InvalidSettings(f"best: chains have no design number {index} in chain {chain}")
    return shown.best


def _fill(
    axes: Axes, chains: Sequence[ChainPath], shown: PathsStyle, best: tuple[int, int] | None
) -> None:
    ends = [chain.along(shown.axis)[-1] for chain in chains if len(chain.efficiency)]
    longest = float(max(ends, default=1.0))
    annealed = _annealed(chains, shown)
    logarithmic = annealed > 0.0 and longest > LONG * annealed
    _frame(axes, shown, longest, logarithmic=logarithmic)
    if annealed > 0.0:
        axes.axvspan(axes.get_xlim()[0], annealed, color=style.SHADE, linewidth=0, zorder=0)
    others = [k for k in range(len(chains)) if best is None or k != best[0]]
    for place, k in enumerate(others):
        looks: Looks = {"color": _shade(place, len(others)), "linewidth": 0.9}
        _put_curve(axes, chains[k], shown.axis, looks, level=2.0)
    if best is not None:
        chain, index = chains[best[0]], best[1]
        _put_curve(axes, chain, shown.axis, BEST_LINE, level=3.0)
        axes.add_line(_marker_at(chain.along(shown.axis)[index], chain.efficiency[index]))
    for value, looks, _ in _levels(shown):
        axes.axhline(value, zorder=4, **looks)


def _levels(shown: PathsStyle) -> list[tuple[float, Looks, str]]:
    """Horizontal lines: where, how drawn, what they mean."""
    lines = (
        (shown.human_efficiency, HUMAN_LINE, "human design"),
        (shown.built_efficiency, BUILT_LINE, "cleaned design"),
    )
    return [(v, looks, words) for v, looks, words in lines if v is not None and np.isfinite(v)]


def _word(shown: PathsStyle) -> str:
    """Return what to call the marked design: a chosen one need not be the highest."""
    return "best" if shown.best is None else "chosen"


def _entries(
    chains: Sequence[ChainPath], shown: PathsStyle, best: tuple[int, int] | None
) -> list[tuple[str, Any]]:
    """Legend entries for what the figure holds, and for nothing else."""
    entries: list[tuple[str, Any]] = []
    if _annealed(chains, shown) > 0.0:
        entries.append(("annealing", Patch(color=style.SHADE)))
    if best is None or len(chains) > 1:
        line = Line2D([], [], color=_shade(0, 1), linewidth=1.2)
        entries.append(("chains" if best is None else "other chains", line))
    if best is not None:
        star = _marker_at(0.0, 0.0)
        star.set(**BEST_LINE, linestyle="solid")
        entries.append((f"{_word(shown)} chain", star))
    return entries + [(words, Line2D([], [], **looks)) for _, looks, words in _levels(shown)]


def _annealed(chains: Sequence[ChainPath], shown: PathsStyle) -> float:
    """Place on the axis at which the last chain ends its annealing phase."""
    steps = shown.annealing_steps
    ends = [
        chain.along(shown.axis)[min(steps, len(chain.efficiency)) - 1]
        for chain in chains
        if len(chain.efficiency)
    ]
    return float(max(ends, default=0.0)) if steps > 0 else 0.0


def _frame(axes: Axes, shown: PathsStyle, longest: float, *, logarithmic: bool) -> None:
    """Label the axes, quietly."""
    if logarithmic:
        axes.set_xscale("log")
        axes.set_xlim(1.0, longest * 1.05)
    else:
        axes.set_xlim(0.0, max(longest, 1.0) * 1.02)
    if not logarithmic or longest < 1e6:
        axes.xaxis.set_major_formatter(
            FuncFormatter(lambda x, _place: f"{x:,.0f}".replace(",", "\u202f"))
        )
    words = {"accepted": "accepted changes", "proposals": "proposals"}
    style.label(axes, words[shown.axis], shown.measure)
    style.quieten(axes)


def _put_curve(axes: Axes, chain: ChainPath, axis: Axis, looks: Looks, level: float) -> None:
    """Draw one chain, thinned to what can be seen."""
    x = chain.along(axis)
    kept = thin(np.log(x) if axes.get_xscale() == "log" else x, chain.efficiency)
    axes.plot(
        x[kept], chain.efficiency[kept], drawstyle="steps-post",
        solid_joinstyle="round", zorder=level, **looks,
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


def _shade(place: int, count: int) -> str:
    """Return one of `count` greys with a breath of blue, so that neighbours can be told apart."""
    share = place / max(count - 1, 1)
    return to_hex(colormaps["bone"](0.45 + 0.35 * share))
