"""Whole jobs that need several layers at once, for every face: command line, web, scripts."""

from bellcrank.workflows.design import (
    complete_design,
    reopen_design,
    start_design,
)
from bellcrank.workflows.find import find_design
from bellcrank.workflows.outcome import DesignReport
from bellcrank.workflows.pictures import draw_run, move

__all__ = [
    "DesignReport",
    "complete_design",
    "draw_run",
    "find_design",
    "move",
    "reopen_design",
    "start_design",
]
