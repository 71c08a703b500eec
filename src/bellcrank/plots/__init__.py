"""Figures: designs at rest and moved, and the way of the efficiency along chains.

Draws plain arrays and records, whoever made them, with matplotlib's Agg through its
object interface: nothing global is read or changed, and pictures can be made in any
thread. The suffix of a path (png, svg, pdf) chooses the format.

- `draw_motion`, `draw_comparison`, `draw_design` draw designs, given as `Motion` or Design;
- `draw_paths` draws efficiency against accepted steps, given as `ChainPath`;
- `draw_front` draws a Pareto front;
- `draw_stress` draws parts in the colours of their stress, given as `Stressed`;
- `draw_two_port` draws an actuator's answers to loads, given as `LoadedCurve`;
- `draw_foretold` draws what a machine is foretold to do beside what it does, given as
  `StrokeOfMachine`.
"""

from bellcrank.plots.chains import ChainPath, PathsStyle
from bellcrank.plots.foretold import StrokeOfMachine, draw_foretold
from bellcrank.plots.front import draw_front
from bellcrank.plots.motion import draw_comparison, draw_design, draw_motion
from bellcrank.plots.paths import draw_paths
from bellcrank.plots.scene import Motion
from bellcrank.plots.stress import Stressed, draw_stress
from bellcrank.plots.strokes import StrokeAxes, StrokeCurve
from bellcrank.plots.two_port import LoadedCurve, LoadLine, draw_two_port

__all__ = [
    "ChainPath",
    "LoadLine",
    "LoadedCurve",
    "Motion",
    "PathsStyle",
    "Stressed",
    "StrokeAxes",
    "StrokeCurve",
    "StrokeOfMachine",
    "draw_comparison",
    "draw_design",
    "draw_foretold",
    "draw_front",
    "draw_motion",
    "draw_paths",
    "draw_stress",
    "draw_two_port",
]
