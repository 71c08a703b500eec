"""Tasks: what a person wants of a part, in mm, N and g.

A task names the part, the domain, the supports and one or several load cases, and for each output
what it must do. `build_task` turns it into a `bellcrank.model.Problem` with a specification, in
lattice units. The tables of a task file are the classes of `bellcrank.task.schema`; the reference
page of the documentation describes every key.
"""

from bellcrank.task.build import Task, build_task, lattice_of
from bellcrank.task.files import bundled_tasks, find_task, is_task, read_task, task_from_dict
from bellcrank.task.schema import TaskTable
from bellcrank.task.units import NAMES, ProblemUnits, units_of

__all__ = [
    "NAMES",
    "ProblemUnits",
    "Task",
    "TaskTable",
    "build_task",
    "bundled_tasks",
    "find_task",
    "is_task",
    "lattice_of",
    "read_task",
    "task_from_dict",
    "units_of",
]
