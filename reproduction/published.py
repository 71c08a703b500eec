"""What the paper reports, as far as it is known to us.

Bonfanti, Guerra, Font-Clos, Rayneau-Kirkhope and Zapperi, Nat. Commun. 11, 4162 (2020).
Efficiencies of actuators are by finite elements and confirmed by print unless said otherwise.
"""

CRANE_HUMAN = 1.00
CRANE_MACHINE = 1.52
ANTI_PARALLEL_HUMAN = 0.66
ANTI_PARALLEL_MACHINE = 2.41
PLIERS_HUMAN = 0.22
"""By simulation."""
PLIERS_MACHINE = 0.50
"""By simulation."""
R_SQUARED = 0.966
PICTURES = 1_163_733
BEAMS_APART = 65
"""Between designs made by the network and the nearest of its training set, typically."""
SPEED_UP = 100
"""Of the network over the authors' simulation, about."""
EXPONENT = 2.97
"""Of the time with the number of beams."""
HOT, COLD, ANNEALING = 0.06, 1e-3, 100
"""Temperatures, and accepted steps over which they fall."""
BOND, ANGLE = 5.0, 0.1
"""Stiffness of beams and of angular springs."""
