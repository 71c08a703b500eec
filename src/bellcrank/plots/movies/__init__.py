"""Movies of lattices that move, with curves that are drawn alongside.

The drawings are made from plain arrays. The parts of a picture that do not change are drawn
once; each frame adds the moving parts to a copy.

- a `Movie` holds a `StateSequence` for each lattice, `Graph`s of `Line`s, and the state that
  each frame shows;
- `MovieSettings` holds the length, frame rate and size; `write_movie` writes the file;
- `stroke_schedule` chooses the states of the frames.
"""

from bellcrank.plots.movies.figure import MovieFigure
from bellcrank.plots.movies.output import MovieSettings, check_movie, movie_settings, write_movie
from bellcrank.plots.movies.records import Graph, Line, Movie, StateSequence
from bellcrank.plots.movies.schedule import stroke_schedule

__all__ = [
    "Graph",
    "Line",
    "Movie",
    "MovieFigure",
    "MovieSettings",
    "StateSequence",
    "check_movie",
    "movie_settings",
    "stroke_schedule",
    "write_movie",
]
