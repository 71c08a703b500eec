"""The second process compiles kernels for the types with which the first process calls them."""

import subprocess
import sys

import pytest

PROGRAM = """
from bellcrank.mechanics.frames.compilation import compile_kernels
from bellcrank.mechanics.frames.evaluator import FrameEvaluator
from bellcrank.mechanics.frames.kernels import flips, path
from bellcrank.model import find_problem
from bellcrank.part import PartSpec, frame_problem

problem = frame_problem(find_problem("{name}"), PartSpec())
compile_kernels(lambda _value: None, problem)
kernels = [flips.predict_flips, path.follow_path]
assert all(len(kernel.signatures) == 1 for kernel in kernels)
evaluator = FrameEvaluator(problem)
evaluator.evaluate(problem.initial)
assert evaluator.predict_flips(problem.initial) is not None
assert all(len(kernel.signatures) == 1 for kernel in kernels)
"""


@pytest.mark.parametrize("name", ["crane", "orthogonal"])
def test_no_kernel_is_compiled_for_other_types(name: str) -> None:
    subprocess.run([sys.executable, "-c", PROGRAM.format(name=name)], check=True)
