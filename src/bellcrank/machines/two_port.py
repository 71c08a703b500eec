"""An actuator as a linear two-port: three figures from which all its answers follow.

With u_in, u_out the motions of the ports along their directions and F_in, F_out the forces from
outside that do work on them, the hybrid form is

    F_in  = k u_in - eta F_out,
    u_out = eta u_in + C F_out:

k the stiffness of the input while the output is free, eta the free efficiency, C the compliance of
the output while the input is held. That one eta stands in both places is the reciprocity of
Maxwell and Betti. Solved for the forces it is the stiffness form

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

    from bellcrank.mechanics import State, Superelement

ROUNDED = 1e-8
"""Of the input stiffness with a blocked output: what rounding may leave of that with a free one."""


@dataclass(frozen=True, slots=True)
class TwoPort:
    """The linear answers of an actuator around one of its states.

    Parameters
    ----------
    input_stiffness
        k = dF_in / du_in, output free.
    efficiency
        eta = du_out / du_in, output free.
    output_compliance
        C = du_out / dF_out, input held. Infinite for an output that nothing holds: then there
        is a stiffness form, with zeros, but no hybrid one.

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
        """Whether the structure holds the output at all."""
        return math.isfinite(self.output_compliance)

    @property
    def output_stiffness(self) -> float:
        """1 / C = dF_out / du_out, input held."""
        return 1.0 / self.output_compliance

    @property
    def transmitted_stiffness(self) -> float:
        """Force on what blocks the output, per input motion: eta / C."""
        return self.efficiency / self.output_compliance

    @property
    def blocked_input_stiffness(self) -> float:
        """dF_in / du_in, output held: k + eta^2 / C."""
        return self.input_stiffness + self.efficiency * self.transmitted_stiffness

    @property
    def force_efficiency(self) -> float:
        """Force on what blocks the output, over the input force; nan if that vanishes."""
        if self.blocked_input_stiffness == 0.0:
            return math.nan
        return self.transmitted_stiffness / self.blocked_input_stiffness

    @property
    def coupling(self) -> float:
        """Share of the input's work, output blocked, that letting the output go sets free.

        ``eta^2 / (eta^2 + k C)``, between 0 and 1; nan for an input without any resistance. The
        square of what is called coupling factor where electricity drives.
        """
        return self.efficiency * self.force_efficiency

    @property
    def matched_spring(self) -> float:
        """Stiffness of the spring at the output that takes the largest share of the work.

        For an input without resistance that is the softest, which takes it all: 0.
        """
        return self._uncoupled * self.output_stiffness

    @property
    def best_work_share(self) -> float:
        """That share: energy in the matched spring over work of the input."""
        return (1.0 - self._uncoupled) / (1.0 + self._uncoupled)

    @property
    def _uncoupled(self) -> float:
        """The s = sqrt(1 - coupling); rounding may leave a little of no resistance, or less."""
        rest = 1.0 - self.coupling
        return 0.0 if rest < ROUNDED else math.sqrt(rest)

    @property
    def stiffness(self) -> NDArray[np.float64]:
        """(2, 2) symmetric and positive semidefinite."""
        across = -self.transmitted_stiffness
        return np.array([[self.blocked_input_stiffness, across], [across, self.output_stiffness]])

    @property
    def hybrid(self) -> NDArray[np.float64]:
        """(2, 2) from (u_in, F_out) to (F_in, u_out).

        Raises
        ------
        InvalidSettings
            If nothing holds the output.
        """
        if not self.connected:
            raise InvalidSettings(
                "a two-port has no hybrid form where nothing holds the output: a force there has "
                "no equilibrium"
            )
        return np.array(
            [[self.input_stiffness, -self.efficiency], [self.efficiency, self.output_compliance]]
        )

    def efficiency_against(self, spring: float) -> float:
        """Return u_out / u_in against a spring of some stiffness: eta / (1 + k_s C)."""
        if spring == 0.0:  # also where nothing holds the output
            return self.efficiency
        return self.efficiency / (1.0 + spring * self.output_compliance)

    def input_stiffness_against(self, spring: float) -> float:
        """Return F_in / u_in against a spring: k + eta^2 k_s / (1 + k_s C)."""
        return self.input_stiffness + self.efficiency * spring * self.efficiency_against(spring)

    def output_under(self, motion: float, force: float) -> float:
        """Return u_out for an input motion and a dead force on the output."""
        return self.efficiency * motion + (self.output_compliance * force if force else 0.0)


def two_port_at(element: Superelement, state: State) -> TwoPort:
    """Condense an actuator to a two-port around one of its states.

    Parameters
    ----------
    element
        From `mean_ports`.
    state
        At rest, or anywhere along the stroke.

    Raises
    ------
    InvalidSettings
        If the output is connected and swings freely while the input is held, or has lost its
        stability there.

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
            f"{element.design.problem.name}: nothing resists the output while the input is held: "
            "no two-port there"
        )
    answer = linear.transfer()
    connected = bool(element.reached[OUTPUT])
    return TwoPort(
        input_stiffness=float(answer[INPUT, INPUT]),
        efficiency=float(answer[OUTPUT, INPUT]) if connected else 0.0,
        output_compliance=float(answer[OUTPUT, OUTPUT]) if connected else math.inf,
    )
