"""Jobs that combine several packages: design, validation, pictures and files of parts."""

from bellcrank.workflows.design import (
    complete_design,
    reopen_design,
    start_design,
)
from bellcrank.workflows.find import find_design
from bellcrank.workflows.report import DesignReport
from bellcrank.workflows.validation import (
    Validation,
    check_plan,
    problem_identity,
    spec_for,
    validate,
    with_stroke,
    without_missing_levels,
)
from bellcrank.workflows.validation_record import add_to_record, read_record

__all__ = [
    "DesignReport",
    "Validation",
    "add_to_record",
    "check_plan",
    "complete_design",
    "find_design",
    "problem_identity",
    "read_record",
    "reopen_design",
    "spec_for",
    "start_design",
    "validate",
    "with_stroke",
    "without_missing_levels",
]
