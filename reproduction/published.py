"""Values reported by the paper.

Bonfanti, Guerra, Font-Clos, Rayneau-Kirkhope and Zapperi, Nat. Commun. 11, 4162 (2020).
Efficiencies of actuators are from finite elements and confirmed by prints unless noted.
"""

CRANE_HUMAN = 1.00
CRANE_MACHINE = 1.52
ANTI_PARALLEL_HUMAN = 0.66
ANTI_PARALLEL_MACHINE = 2.41
PLIERS_HUMAN = 0.22
"""Simulated."""
PLIERS_MACHINE = 0.50
"""Simulated."""
R_SQUARED = 0.966
PICTURES = 1_163_733
BEAMS_APART = 65
"""Typical number of differing beams between a design by the network and the nearest training
design."""
SPEED_UP = 100
"""Approximate ratio of the times of the authors' simulation and of the network."""
EXPONENT = 2.97
"""Exponent of the computing time as a power of the number of beams."""
HOT, COLD, ANNEALING = 0.06, 1e-3, 100
"""Initial and final temperature, and number of accepted steps between them."""
BOND, ANGLE = 5.0, 0.1
"""Stiffness of beams and of angular springs."""
