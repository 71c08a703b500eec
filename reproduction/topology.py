"""Topology optimisation of a box by pyMOTO, with the settings of its examples.

The formulation is that of Sigmund (Mech. Struct. Mach. 25, 493, 1997): densities on square
elements, a linear density filter, stiffness by the power 3 (SIMP), springs at input and output,
and the maximal output displacement under a given input force and volume by MMA.
"""

from __future__ import annotations

import contextlib
import io
import time
import warnings
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.errors import InvalidSettings
from reproduction.box_elements import grid_of

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from reproduction.box_elements import Grid
    from reproduction.boxes import Box

INSTALL = "pip install 'bellcrank[rivals]'"
LEAST = 1e-6
"""Relative stiffness of void elements."""
POISSON = 0.3


def pymoto() -> Any:
    """Return the module pymoto.

    Raises
    ------
    InvalidSettings
        If pyMOTO is not installed.
    """
    import matplotlib as mpl

    # pyMOTO selects a backend of matplotlib on import, which fails without a display.
    chosen = mpl.use
    mpl.use = lambda *_names, **_more: None
    try:
        import pymoto as module
    except ImportError as missing:
        raise InvalidSettings(
            f"the study rivals needs pyMOTO and NGSolve; install them with: {INSTALL}"
        ) from missing
    finally:
        mpl.use = chosen
    return module


def optimise(
    box: Box,
    elements: int,
    volume: float,
    springs: tuple[float, float],
    radius: float,
    iterations: int,
    off_axis: float | None = None,
) -> dict[str, Any]:
    """Return densities with a large output displacement.

    Parameters
    ----------
    elements
        Number of elements along the longer side of the box.
    volume
        Largest volume fraction.
    springs
        Stiffness of the springs at input and output, in units of Young's modulus times thickness.
    radius
        Filter radius, elements.
    iterations
        Number of MMA iterations.
    off_axis
        Largest motion of the output across its direction, as a part of that along it, at small
        strokes; None for no limit.

    Returns
    -------
    dict
        density (rows from the bottom), elements, seconds (processor time), springs,
        output_over_input, and across_over_output, the motion of the output across its direction
        over that along it.
    """
    grid = grid_of(box, elements)
    across, up = grid.counts
    domain = pymoto().VoxelDomain(across, up)
    began = time.thread_time()
    smooth, motion = largest_motion(domain, grid, volume, springs, radius, iterations, off_axis)
    output = grid.output
    return {
        "density": smooth.reshape(up, across).round(4).tolist(),
        "elements": [across, up],
        "seconds": round(time.thread_time() - began, 2),
        "springs": list(springs),
        "output_over_input": float(output @ motion) / float(grid.load @ motion),
        "across_over_output": abs(float(_across(output) @ motion) / float(output @ motion)),
    }


def largest_motion(
    domain: Any,
    grid: Grid,
    volume: float,
    springs: tuple[float, float],
    radius: float,
    iterations: int,
    off_axis: float | None = None,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return filtered densities (e,) with a large output displacement, and displacements (n,).

    Parameters
    ----------
    domain
        Elements of pyMOTO, in the plane or in space.
    grid
        The same elements, with load, output and fixed regions.
    volume, springs, radius, iterations, off_axis
        As for `optimise`; `off_axis` in the plane.
    """
    module, load, output = pymoto(), grid.load, grid.output
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # its solvers warn at each matrix conversion
        density = module.Signal("x", state=np.full(domain.nel, volume))
        constant = _springs(load, output, springs)
        with module.Network() as network:
            chosen = module.SetValue(indices=grid.solid, value=1.0)(density)
            chosen = module.SetValue(indices=grid.empty, value=0.0)(chosen)
            smooth = module.DensityFilter(domain, radius=radius)(chosen)
            stiff = module.MathExpression(f"{LEAST} + {1.0 - LEAST}*inp0^3")(smooth)
            matrix = module.AssembleStiffness(
                domain, e_modulus=1.0, poisson_ratio=POISSON, plane="stress", bc=grid.held,
                add_constant=constant,
            )(stiff)  # fmt: skip
            moved = module.LinSolve(symmetric=True, positive_definite=True)(
                matrix, module.Signal("f", state=load)
            )
            reached = module.EinSum("i,i->")(moved, module.Signal("l", state=-output))
            size_of_motion = abs(float(load @ np.asarray(moved.state)))
            if abs(float(reached.state)) > 1e-6 * size_of_motion:
                objective = module.Scaling(scaling=10.0)(reached)
            else:  # by symmetry: a scale by the initial value would be infinite
                objective = module.MathExpression(f"{10.0 / size_of_motion}*inp0")(reached)
            used = module.EinSum("i->")(smooth)
            limit = module.Scaling(scaling=10.0, maxval=volume * domain.nel)(used)
            responses = [objective, limit]
            if off_axis is not None:
                pushed = module.EinSum("i,i->")(moved, module.Signal("a", state=load))
                aside = module.EinSum("i,i->")(moved, module.Signal("c", state=_across(output)))
                # The signal `reached` is the negative motion along the direction.
                responses += [
                    module.MathExpression(f"({sign}*inp0 + {off_axis}*inp1) / inp2")(
                        aside, reached, pushed
                    )
                    for sign in (1.0, -1.0)
                ]
        with contextlib.redirect_stdout(io.StringIO()):
            module.minimize_mma(density, responses, network, maxit=iterations, verbosity=0)
    return np.asarray(smooth.state), np.asarray(moved.state)


def _across(output: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the mean output turned by a right angle."""
    along = output.reshape(-1, 2)
    return np.column_stack([-along[:, 1], along[:, 0]]).ravel()


def _springs(
    load: NDArray[np.float64], output: NDArray[np.float64], springs: tuple[float, float]
) -> Any:
    """Return the stiffness matrix of springs along the mean input and output displacements."""
    from scipy.sparse import csr_matrix

    vectors = [csr_matrix(vector) for vector in (load, output)]
    return sum(k * (v.T @ v) for k, v in zip(springs, vectors, strict=True))
