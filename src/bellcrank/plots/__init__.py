"""Pictures of designs, searches, parts and actuators.

The functions draw plain arrays and records by the Agg backend of matplotlib through its object
interface. They neither read nor change global settings and can be called in any thread. The
suffix of a path (png, svg, pdf) selects the format.

- `draw_motion`, `draw_comparison` and `draw_design` draw designs, given as `Motion` or `Design`;
- `draw_paths` draws the efficiency along chains, given as `ChainPath`;
- `draw_stress` draws parts coloured by their stress, given as `StressedPart`;
- `draw_two_port` draws the response of an actuator to loads, given as `LoadedCurve`;
- `draw_foretold` draws what a machine is foretold to do beside what it does, given as
  `StrokeOfMachine`.
"""

from bellcrank.plots.chain_paths import ChainPath, PathOptions, draw_paths
from bellcrank.plots.foretold import StrokeOfMachine, draw_foretold
from bellcrank.plots.motion import draw_comparison, draw_design, draw_motion
from bellcrank.plots.scene import Motion
from bellcrank.plots.stress import StressedPart, draw_stress
from bellcrank.plots.strokes import StrokeCurve, StrokeLabels
from bellcrank.plots.two_port import LoadedCurve, LoadLine, draw_two_port

__all__ = [
    "ChainPath",
    "LoadLine",
    "LoadedCurve",
    "Motion",
    "PathOptions",
    "StressedPart",
    "StrokeCurve",
    "StrokeLabels",
    "StrokeOfMachine",
    "draw_comparison",
    "draw_design",
    "draw_foretold",
    "draw_motion",
    "draw_paths",
    "draw_stress",
    "draw_two_port",
]
