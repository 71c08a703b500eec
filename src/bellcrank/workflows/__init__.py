"""Whole jobs that need several layers at once, for every face: command line, web, scripts."""

from bellcrank.workflows.design import (
    complete_design,
    reopen_design,
    start_design,
)
from bellcrank.workflows.find import find_design
from bellcrank.workflows.outcome import DesignReport
from bellcrank.workflows.pictures import draw_run, move
from bellcrank.workflows.validate import (
    Validation,
    keep_record,
    spec_for,
    validate,
    with_stroke,
)

__all__ = [
    "DesignReport",
    "Validation",
    "complete_design",
    "draw_run",
    "find_design",
    "keep_record",
    "move",
    "reopen_design",
    "spec_for",
    "start_design",
    "validate",
    "with_stroke",
]
