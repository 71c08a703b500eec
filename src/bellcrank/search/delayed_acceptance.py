"""Delayed acceptance: a cheap scorer screens what is proposed, the mechanics decides.

A flip must first pass by what the scorer says of it; only then is its response computed, and a
second rule sets right whatever the scorer got wrong (J. A. Christen and C. Fox, J. Comput.
Graph. Stat. 14, 795, 2005). With a(x, y) the chance that a flip from x to y passes the first
rule, the second accepts with probability

    min(1, exp(-(cost(y) - cost(x)) / T) a(y, x) / a(x, y)),

so that at a fixed temperature the chain visits each design with probability exp(-cost / T) / Z,
however bad the scorer. A bad one costs time, never truth: it lets useless flips pass, or holds
good ones back, which a floor under a(x, y) limits.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

from bellcrank.errors import InvalidSettings
from bellcrank.search.metropolis import MetropolisSettings
from bellcrank.search.scorers import require_plain_flips
from bellcrank.search.settings import check_whole, is_number


@dataclass(frozen=True, slots=True, kw_only=True)
class ScreenedSettings(MetropolisSettings):
    """Settings of a chain whose proposals are screened; for the rest, see `MetropolisSettings`.

    Parameters
    ----------
    doubt
        Error of the scorer's differences, in units of the cost: the first rule is that of a
        temperature so much higher. 0 takes the scorer at its word.
    least_chance
        With which any flip passes the first rule, whatever the scorer says.
    lookahead
        Proposals scored in one batch; changes nothing but the time it takes.

    Raises
    ------
    InvalidSettings, UnknownName
    """

    name: ClassVar[str] = "screened"

    doubt: float = 0.0
    least_chance: float = 0.02
    lookahead: int = 16

    def __post_init__(self) -> None:
        MetropolisSettings.__post_init__(self)
        require_plain_flips(self)
        check_whole("lookahead", self.lookahead, 1)
        if not (is_number(self.doubt) and 0.0 <= self.doubt < math.inf):
            raise InvalidSettings(f"doubt: expected a cost of at least 0, got {self.doubt!r}")
        if not (is_number(self.least_chance) and 0.0 < self.least_chance <= 1.0):
            raise InvalidSettings(
                f"least_chance: expected a probability above 0, got {self.least_chance!r}; at 0 "
                f"there may be designs that the chain never reaches"
            )


def log_passes(rise: float, temperature: float, settings: ScreenedSettings) -> float:
    """Log of the chance that a flip passes the first rule.

    Parameters
    ----------
    rise
        Of the cost, as the scorer has it; nan, of which it says nothing, passes always.

    Examples
    --------
    >>> log_passes(-1.0, 0.01, ScreenedSettings()), log_passes(0.01, 0.01, ScreenedSettings())
    (0.0, -1.0)
    """
    if math.isnan(rise):
        return 0.0
    gain = -rise / (temperature + settings.doubt)
    return max(math.log(settings.least_chance), min(0.0, gain))


def corrected(gain: float, there_passes: float, back_passes: float) -> float:
    """Log of the second rule's ratio.

    Parameters
    ----------
    gain
        Log of the ratio of the designs' probabilities, by the mechanics.
    there_passes, back_passes
        Log of the chances that the flip, and that its reverse, pass the first rule.
    """
    return gain + back_passes - there_passes
