"""Whole jobs that need several layers at once, for every face: command line, web, scripts."""

from bellcrank.workflows.design import (
    complete_design,
    reopen_design,
    start_design,
)
from bellcrank.workflows.find import find_design
from bellcrank.workflows.outcome import DesignReport
from bellcrank.workflows.pictures import draw_run, motion_of
from bellcrank.workflows.record import check_record, keep_record
from bellcrank.workflows.validate import (
    Validation,
    check_plan,
    identity,
    spec_for,
    validate,
    with_stroke,
)

__all__ = [
    "DesignReport",
    "Validation",
    "check_plan",
    "check_record",
    "complete_design",
    "draw_run",
    "find_design",
    "identity",
    "keep_record",
    "motion_of",
    "reopen_design",
    "spec_for",
    "start_design",
    "validate",
    "with_stroke",
]
