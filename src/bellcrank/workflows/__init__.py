"""Whole jobs that need several layers at once, for every face: command line, web, scripts."""

from bellcrank.workflows.design import DesignReport, continue_design, start_design
from bellcrank.workflows.find import find_design

__all__ = ["DesignReport", "continue_design", "find_design", "start_design"]
