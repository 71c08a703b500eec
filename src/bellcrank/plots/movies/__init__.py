"""Movies: lattices that move or change, with curves beside them that grow along.

Draws plain arrays, whoever made them. What never moves is drawn once; for each frame only
what moves is drawn over a copy of it.

- a `Movie` holds `Course`s (what a lattice goes through, state by state), `Graph`s of `Line`s
  and the order in which frames show the states;
- `MovieSettings` says how long, how often and how large, and `film` writes the file;
- `stroke_schedule`, `search_schedule` and `pick_states` give the order of frames.
"""

from bellcrank.plots.movies.film import film
from bellcrank.plots.movies.records import Course, Graph, Line, Movie
from bellcrank.plots.movies.settings import MovieSettings, check_movie, movie_settings
from bellcrank.plots.movies.stage import Stage
from bellcrank.plots.movies.timing import most_states, pick_states, search_schedule, stroke_schedule

__all__ = [
    "Course",
    "Graph",
    "Line",
    "Movie",
    "MovieSettings",
    "Stage",
    "check_movie",
    "film",
    "most_states",
    "movie_settings",
    "pick_states",
    "search_schedule",
    "stroke_schedule",
]
