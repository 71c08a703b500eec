"""Whole jobs that need several layers at once, for every face: command line, web, scripts."""

from bellcrank.workflows.design import DesignReport, continue_design, start_design
from bellcrank.workflows.find import find_design
from bellcrank.workflows.pictures import draw_run, move

__all__ = ["DesignReport", "continue_design", "draw_run", "find_design", "move", "start_design"]
