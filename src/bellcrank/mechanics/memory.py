"""Memory that the evaluation of designs needs, compared with the memory that is available."""

from __future__ import annotations

import math
import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from bellcrank.errors import InvalidSettings

if TYPE_CHECKING:
    from bellcrank.model import Problem

GIB = 2**30
SMALL = GIB // 4
"""Memory that is not compared with what is available."""
BYTES_PER_NODE = 700
BYTES_PER_BEAM = 300
BYTES_PER_FACTOR_BLOCK = 72
FACTOR_BLOCKS = 1.5
"""Upper bound on the blocks of the factor of triangular lattices of n nodes, as a multiple of
n^1.5; measured from 90 to 39,800 nodes, where it falls from 1.4 to 0.7."""
BYTES_OF_PATTERN = 0.25
"""Bit sets of the pattern of the stiffness, per pair of nodes."""
BYTES_OF_INVERSE_PER_NODE = 850
"""Blocks of the inverse stiffness between neighbours, for the prediction of flips."""
BYTES_PER_ANCESTOR = 32
HEIGHT, HEIGHT_POWER = 1.9, 0.71
"""Height of the elimination tree of triangular lattices of n nodes, 1.9 n^0.71; measured from 64
nodes (32) to 40,000 (2,240), it is at most 2 % larger, and smaller from 10,000 nodes on."""


def memory_needed(nodes: int, beams: int, *, predict_flips: bool = False) -> int:
    """Estimate the memory in bytes of one `bellcrank.mechanics.SpringEvaluator`.

    Parameters
    ----------
    nodes, beams
        Of the lattice.
    predict_flips
        Whether flips are predicted, which needs parts of the inverse of the stiffness.

    Examples
    --------
    >>> print(f"{memory_needed(40_000, 119_000, predict_flips=True) / GIB:.1f} GiB")
    5.5 GiB
    """
    needed = BYTES_PER_NODE * nodes + BYTES_PER_BEAM * beams + BYTES_OF_PATTERN * nodes**2
    needed += BYTES_PER_FACTOR_BLOCK * FACTOR_BLOCKS * nodes**1.5
    if predict_flips:
        needed += BYTES_OF_INVERSE_PER_NODE * nodes
        needed += BYTES_PER_ANCESTOR * HEIGHT * nodes ** (1.0 + HEIGHT_POWER)
    return int(needed)


def available_memory() -> int:
    """Return the memory in bytes that this process can still allocate without swapping.

    The least of what the system reports as available and what the control group of the process
    leaves; the physical memory where neither is known.
    """
    found = [*_system_memory(), *_control_group_memory()]
    if not found and hasattr(os, "sysconf"):
        found = [os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")]
    return min(found, default=sys.maxsize)


def _system_memory() -> list[int]:
    try:
        lines = Path("/proc/meminfo").read_text().splitlines()
    except OSError:
        return []
    return [1024 * int(line.split()[1]) for line in lines if line.startswith("MemAvailable:")]


def _control_group_memory() -> list[int]:
    group = Path("/sys/fs/cgroup")
    try:
        limit = int((group / "memory.max").read_text())
        used = (group / "memory.stat").read_text().splitlines()
    except (OSError, ValueError):  # no control groups, or no limit
        return []
    return [limit - int(line.split()[1]) for line in used if line.startswith("anon ")]


def evaluators_that_fit(problem: Problem, wanted: int, *, predict_flips: bool) -> int:
    """Return how many evaluators of a problem fit into the available memory, at least 1.

    Parameters
    ----------
    wanted
        Largest number of interest.
    """
    lattice = problem.lattice
    needed = memory_needed(lattice.node_count, lattice.beam_count, predict_flips=predict_flips)
    return max(1, min(wanted, available_memory() // max(needed, 1)))


def check_memory(problem: Problem, *, evaluators: int = 1, predict_flips: bool = False) -> None:
    """Refuse a problem whose evaluation needs more memory than is available.

    Parameters
    ----------
    evaluators
        Number of evaluators that are kept at the same time.
    predict_flips
        Whether flips are predicted.

    Raises
    ------
    InvalidSettings
        With the memory needed and available, and what fits.
    """
    nodes, beams = problem.lattice.node_count, problem.lattice.beam_count
    needed = evaluators * memory_needed(nodes, beams, predict_flips=predict_flips)
    if needed < SMALL:
        return
    available = available_memory()
    if needed <= available:
        return
    side = _largest_side(available // evaluators, predict_flips=predict_flips)
    fits = f"a lattice of about {side} x {side} nodes fits"
    without = evaluators * memory_needed(nodes, beams)
    if predict_flips and without <= available:
        fits += f", or a search that predicts no flips (--search paper: {without / GIB:.1f} GiB)"
    raise InvalidSettings(
        f"problem {problem.name!r}: {nodes} nodes and {beams} beams need about "
        f"{needed / GIB:.1f} GiB of memory, {available / GIB:.1f} GiB are available; {fits}"
    )


def _largest_side(memory: int, *, predict_flips: bool) -> int:
    """Return the largest k for which a triangular lattice of k x k nodes fits into `memory`."""
    low, high = 1, math.isqrt(max(4, memory))
    while high - low > 1:
        middle = (low + high) // 2
        fits = memory_needed(middle**2, 3 * middle**2, predict_flips=predict_flips) <= memory
        low, high = (middle, high) if fits else (low, middle)
    return low
