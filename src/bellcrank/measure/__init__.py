"""Motion of printed parts from films: markers, camera, tracks, figures with intervals.

`marker_layout` places the markers of a part, `track_markers` finds them in a film, and
`measure_by_markers` returns the motion of input and output. Films need OpenCV (the extra
``measure``), which is imported where it is first needed.

>>> from bellcrank.model import human_design
>>> from bellcrank.part import PartSpec
>>> part = PartSpec().of(human_design("crane"))
>>> layout = marker_layout(part, part.positions[None])
>>> [round(side) for side in layout.frame_size]
[164, 143]
"""

from bellcrank.measure.by_markers import measure_by_markers
from bellcrank.measure.corners import opencv
from bellcrank.measure.films import Film, open_film
from bellcrank.measure.layout import Marker, MarkerLayout, marker_layout, read_layout
from bellcrank.measure.measurement import Measurement, MeasureSettings, interval
from bellcrank.measure.motion import Motion, motion_of_nodes
from bellcrank.measure.tracks import Tracks, track_markers

__all__ = [
    "Film",
    "Marker",
    "MarkerLayout",
    "MeasureSettings",
    "Measurement",
    "Motion",
    "Tracks",
    "interval",
    "marker_layout",
    "measure_by_markers",
    "motion_of_nodes",
    "open_film",
    "opencv",
    "read_layout",
    "track_markers",
]
