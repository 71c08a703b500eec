"""Linear two-port of an actuator: input stiffness, efficiency and output compliance.

With u_in, u_out the motions of the ports along their directions and F_in, F_out the conjugate
external forces, the hybrid form is

    F_in  = k u_in - eta F_out,
    u_out = eta u_in + C F_out,

where k is the input stiffness with a free output, eta the free efficiency, and C the output
compliance with the input held. Both coefficients eta are equal by the reciprocal theorem of Maxwell
and Betti. Solved for the forces, the stiffness form is

    [F_in ]   [k + eta^2 / C   -eta / C] [u_in ]
    [F_out] = [   -eta / C        1 / C] [u_out].
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.errors import InvalidSettings
from bellcrank.machines.ports import INPUT, OUTPUT
from bellcrank.mechanics import Conditions

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bellcrank.mechanics import Movable, State

ROUNDING = 1e-8
"""Ratio of free to blocked input stiffness below which the free one is attributed to rounding."""


@dataclass(frozen=True, slots=True)
class TwoPort:
    """Linear response of an actuator around one of its equilibria.

    Parameters
    ----------
    input_stiffness
        k = dF_in / du_in with a free output.
    efficiency
        eta = du_out / du_in with a free output.
    output_compliance
        C = du_out / dF_out with the input held. Infinite for an output that is not connected:
        the stiffness form then contains zeros, and there is no hybrid form.

    Examples
    --------
    >>> lever = TwoPort(input_stiffness=1.0, efficiency=2.0, output_compliance=4.0)
    >>> lever.stiffness.tolist()
    [[2.0, -0.5], [-0.5, 0.25]]
    >>> lever.efficiency_against(0.25)
    1.0
    """

    input_stiffness: float
    efficiency: float
    output_compliance: float

    @property
    def connected(self) -> bool:
        """Whether the output is connected to the structure."""
        return math.isfinite(self.output_compliance)

    @property
    def output_stiffness(self) -> float:
        """dF_out / du_out = 1 / C with the input held."""
        return 1.0 / self.output_compliance

    @property
    def transmitted_stiffness(self) -> float:
        """Blocked force per input motion, eta / C."""
        return self.efficiency / self.output_compliance

    @property
    def blocked_input_stiffness(self) -> float:
        """dF_in / du_in = k + eta^2 / C with the output held."""
        return self.input_stiffness + self.efficiency * self.transmitted_stiffness

    @property
    def force_efficiency(self) -> float:
        """Blocked force over input force; nan if the input force vanishes."""
        if self.blocked_input_stiffness == 0.0:
            return math.nan
        return self.transmitted_stiffness / self.blocked_input_stiffness

    @property
    def coupling(self) -> float:
        """Share of the input work with a blocked output that is released with the output.

        ``eta^2 / (eta^2 + k C)``, between 0 and 1; nan for an input without resistance. It is
        the square of the coupling factor of electromechanical transducers.
        """
        return self.efficiency * self.force_efficiency

    @property
    def matched_spring(self) -> float:
        """Stiffness of the output spring that takes the largest share of the input work.

        It is 0 for an input without resistance.
        """
        return self._uncoupled * self.output_stiffness

    @property
    def best_work_share(self) -> float:
        """Energy in the matched spring over the input work."""
        return (1.0 - self._uncoupled) / (1.0 + self._uncoupled)

    @property
    def _uncoupled(self) -> float:
        """sqrt(1 - coupling); 0 where the difference is of the order of rounding errors."""
        rest = 1.0 - self.coupling
        return 0.0 if rest < ROUNDING else math.sqrt(rest)

    @property
    def stiffness(self) -> NDArray[np.float64]:
        """(2, 2) stiffness form, symmetric and positive semidefinite."""
        across = -self.transmitted_stiffness
        return np.array([[self.blocked_input_stiffness, across], [across, self.output_stiffness]])

    @property
    def hybrid(self) -> NDArray[np.float64]:
        """(2, 2) hybrid form, from (u_in, F_out) to (F_in, u_out).

        Raises
        ------
        InvalidSettings
            If the output is not connected.
        """
        if not self.connected:
            raise InvalidSettings(
                "a two-port has no hybrid form if its output is not connected: a force there has "
                "no equilibrium"
            )
        return np.array(
            [[self.input_stiffness, -self.efficiency], [self.efficiency, self.output_compliance]]
        )

    def efficiency_against(self, spring: float) -> float:
        """Return u_out / u_in against an output spring: eta / (1 + k_s C)."""
        if spring == 0.0:  # also for an infinite compliance
            return self.efficiency
        return self.efficiency / (1.0 + spring * self.output_compliance)

    def input_stiffness_against(self, spring: float) -> float:
        """Return F_in / u_in against an output spring: k + eta^2 k_s / (1 + k_s C)."""
        return self.input_stiffness + self.efficiency * spring * self.efficiency_against(spring)


def two_port_at(element: Movable, state: State) -> TwoPort:
    """Return the linear two-port of an actuator around one of its equilibria.

    Parameters
    ----------
    element
        Actuator from `mean_ports`.
    state
        Equilibrium, at rest or along the stroke.

    Raises
    ------
    InvalidSettings
        If the equilibrium with the input held is unstable, or the output is connected but moves
        without resistance.

    Examples
    --------
    >>> from bellcrank.machines.ports import mean_ports
    >>> from bellcrank.model import find_problem
    >>> element = mean_ports(find_problem("crane").full_design())
    >>> port = two_port_at(element, element.rest())
    >>> print(f"{port.input_stiffness:.3f} {port.efficiency:.4f} {port.output_compliance:.4f}")
    9.686 -0.0439 0.1675
    """
    linear = element.linear(state, Conditions(np.array([True, False]), np.zeros(2), np.zeros(2)))
    if not linear.is_stable():
        raise InvalidSettings(
            f"{element.design.problem.name}: nothing resists the output while the input is held; "
            "there is no two-port"
        )
    hybrid = linear.transfer()
    connected = bool(element.reached[OUTPUT])
    return TwoPort(
        input_stiffness=float(hybrid[INPUT, INPUT]),
        efficiency=float(hybrid[OUTPUT, INPUT]) if connected else 0.0,
        output_compliance=float(hybrid[OUTPUT, OUTPUT]) if connected else math.inf,
    )
