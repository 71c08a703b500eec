"""Compilation of the kernels of frames in a second process, while the first compiles others.

numba compiles one function at a time in a process, and stores each in the cache on disk. The
response of frames is the first kernel that a search needs. It takes half a minute to compile, of
which the second process takes over the path from rest and then what a search needs next.
"""

from __future__ import annotations

import atexit
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.mechanics.frames.equilibria import Equilibrium
from bellcrank.mechanics.frames.evaluator import FrameEvaluator
from bellcrank.mechanics.frames.flips import FlipPredictor
from bellcrank.mechanics.frames.geometry import beam_slopes, geometry_slopes
from bellcrank.mechanics.frames.quantities import quantities
from bellcrank.mechanics.kernels._compile import compile_for, kernels_are_compiled
from bellcrank.processes import FunctionProcess, default_workers

if TYPE_CHECKING:
    from collections.abc import Callable

    from bellcrank.model import Problem


def compile_ahead(problem: Problem) -> None:
    """Begin to compile in a second process, if nothing is compiled and there is a second core.

    The process ends with this one.
    """
    if problem.section is not None and not kernels_are_compiled() and default_workers() > 1:
        module = compile_kernels.__module__
        atexit.register(FunctionProcess(module, compile_kernels.__name__, problem).kill)


def compile_kernels(_send: Callable[[Any], None], problem: Problem) -> None:
    """Compile what searches and refinements of a problem need, the response itself excepted."""
    from bellcrank.mechanics.frames.kernels.path import follow_path

    evaluator = FrameEvaluator(problem, "displacement")
    frame, structure, memory = evaluator.frame, evaluator.structure, evaluator.memory
    compile_for(follow_path, frame, structure, evaluator.state, memory, 1.0)
    evaluator.load_bearing(problem.initial)
    rest = Equilibrium(problem, frame, structure, memory, 0.0, evaluator.state)
    quantity = quantities["travel"]
    measured = [(quantity, quantity.measure(rest))]
    present = problem.initial.astype(np.uint8)
    FlipPredictor(frame, structure).changes(
        rest, measured, problem.designable, present, first_order=False
    )
    geometry_slopes(rest, measured, beam_slopes(evaluator, problem.initial))
