"""Pictures of designs, searches and parts.

The functions draw plain arrays and records by the Agg backend of matplotlib through its object
interface. They neither read nor change global settings and can be called in any thread. The
suffix of a path (png, svg, pdf) selects the format.

- `draw_motion`, `draw_cases`, `draw_comparison` and `draw_design` draw designs, given as `Motion`
  or `Design`;
- `draw_paths` draws the efficiency along chains, given as `ChainPath`;
- `draw_stress` draws parts coloured by their stress, given as `StressedPart`;
- `draw_critical_struts` draws what the loss of each strut of a design costs.
"""

from bellcrank.plots.chain_paths import ChainPath, PathOptions, draw_paths
from bellcrank.plots.critical import draw_critical_struts
from bellcrank.plots.motion import draw_cases, draw_comparison, draw_design, draw_motion
from bellcrank.plots.scene import Motion
from bellcrank.plots.stress import StressedPart, draw_stress
from bellcrank.plots.strokes import StrokeCurve, StrokeLabels

__all__ = [
    "ChainPath",
    "Motion",
    "PathOptions",
    "StressedPart",
    "StrokeCurve",
    "StrokeLabels",
    "draw_cases",
    "draw_comparison",
    "draw_critical_struts",
    "draw_design",
    "draw_motion",
    "draw_paths",
    "draw_stress",
]
