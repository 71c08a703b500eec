"""What is foretold of a machine beside what it does: the full simulation along the stroke."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.machines.curves import PortCurve, trace
from bellcrank.machines.loads import Load
from bellcrank.machines.ports import mean_ports

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bellcrank.machines.assembly import Machine
    from bellcrank.machines.foretelling import Foretold
    from bellcrank.machines.standing import Stand


@dataclass(frozen=True, slots=True, eq=False)
class Check:
    """A stroke foretold against the same stroke of the whole lattice.

    Parameters
    ----------
    simulated
        Of the lattice, with nothing on its output.
    output_error, force_error
        Largest difference as far as both go, as a part of the largest simulated value.
    """

    simulated: PortCurve
    output_error: float
    force_error: float


def simulate(machine: Machine, points: int = 20) -> PortCurve:
    """Push the one lattice of a machine along its stroke, with nothing on its output."""
    return trace(mean_ports(machine.design), Load("free"), points)


def compare(found: Foretold, simulated: PortCurve) -> Check:
    """Set what is foretold against a simulation."""

    def error(told: NDArray[np.float64], true: NDArray[np.float64]) -> float:
        both = found.motion <= simulated.motion[-1] * (1.0 + 1e-9)
        expected = np.interp(found.motion[both], simulated.motion, true)
        size = float(np.abs(true).max())
        return float(np.abs(told[both] - expected).max()) / size if size > 0.0 else 0.0

    return Check(
        simulated,
        error(found.output, simulated.output),
        error(found.input_force, simulated.input_force),
    )


def foretold_to_dict(found: Foretold, check: Check | None = None) -> dict[str, Any]:
    """Return a stroke that is foretold as plain data, ready for JSON; lattice units."""
    curves = ("motion", "output", "input_force", "energy")
    told: dict[str, Any] = {
        "efficiency": found.efficiency if np.isfinite(found.efficiency) else None,
        "status": found.stroke.status.label,
        "reached": found.stroke.reached,
        **{name: getattr(found, name).tolist() for name in curves},
        "stands": [_stand(stand) for stand in found.stands],
        "seconds": round(found.seconds, 4),
        "doubts": list(found.doubts),
    }
    if check is not None:
        whole = check.simulated
        told["check"] = {
            "efficiency": float(whole.efficiency[-1]) if len(whole.motion) > 1 else None,
            "status": whole.status.label,
            "reached": whole.reached,
            **{name: getattr(whole, name).tolist() for name in curves},
            "output_error": check.output_error,
            "force_error": check.force_error,
        }
    return told


def _stand(stand: Stand) -> dict[str, Any]:
    told: dict[str, Any] = {"part": stand.name, "kind": stand.kind}
    if stand.fit is not None:
        told |= {
            "degree": stand.fit.degree,
            "samples": stand.fit.samples,
            "lost": stand.fit.lost,
            "error": float(stand.fit.error.max()),
            "typical_error": float(stand.fit.typical_error.max()),
        }
    return told
