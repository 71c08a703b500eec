"""Settings of basin hopping; those that depend on the model of a problem."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar, NamedTuple

from bellcrank.search.settings import SearchSettings, check_fraction, check_positive, check_whole

if TYPE_CHECKING:
    from bellcrank.model import Problem


class Limits(NamedTuple):
    """Settings that depend on the problem; see `HoppingSettings`."""

    max_failures: int
    min_stall: int
    stall: float
    largest_batch: int
    restart_after: float
    coarse_beams: int


SPRINGS = Limits(
    max_failures=12, min_stall=2000, stall=0.4, largest_batch=1, restart_after=15.0,
    coarse_beams=5000,
)  # fmt: skip
FRAMES = Limits(
    max_failures=24, min_stall=1000, stall=0.15, largest_batch=1, restart_after=0.0,
    coarse_beams=2500,
)  # fmt: skip
"""For frames, predictions are less accurate and Metropolis phases gain more: 8 chains of 20,000
designs of the crane ended at 9.9 in the mean, and with the values for springs at 8.6. With batches
of 64 flips, 6 such chains ended at 7.0 (median), and at 8.6 with single flips."""
SINGLE_FLIPS = 400
BEAMS_PER_FLIP = 50
BEAMS_PER_FLIP_IN_FRAMES = 500
"""Number of designable beams up to which single flips are made in springs, and of further beams
for each flip of a batch; in frames all beams count."""
BEAMS_PER_FAILURE = 100
"""Designable beams for each failed flip that a local search makes at least before it ends."""


@dataclass(frozen=True, slots=True, kw_only=True)
class HoppingSettings(SearchSettings):
    """Settings of basin hopping.

    Parameters
    ----------
    radius
        Mean radius of a perturbation, in mean beam lengths.
    min_density
        Least value of the probability, drawn anew for each perturbation, with which a beam in the
        disc is present.
    largest_batch
        Largest number of flips that a local search makes together. If it is not given, it depends
        on the model and on the number of beams.
    max_failures
        Consecutive failed flips that end a local search; depends on them, too.
    max_predicted_loss
        Largest predicted loss, as a fraction of the efficiency, with which a flip is evaluated.
    phase_steps
        Steps of a Metropolis phase; 0 for no such phases.
    temperature_factor
        Temperature of a Metropolis phase, as a fraction of the best score (without the base penalty
        of violated goals).
    phase_share
        Largest fraction of the steps that go to Metropolis phases while progress stalls; a phase
        begins between two local searches.
    min_stall, stall
        Steps without progress after which Metropolis phases begin: at least this number, and at
        least this fraction of all steps so far. They depend on the model, too.
    restart_after
        Steps without progress that end the first stage, for each designable beam; 0 for no
        restarts. It depends on the model, too.
    restart_patience
        Steps without progress that end any later stage, for each designable beam and design of the
        population.
    restart_chains
        Metropolis chains of a restart, each from the initial design.
    restart_steps
        Steps of such a chain for each designable beam.
    restart_temperature
        Temperature of such a chain, as a fraction of the best score.
    restart_recombination
        Fraction of the local searches that start from a combination of two designs.
    restart_archive
        Largest number of designs in the archive.
    coarse_beams
        Number of designable beams above which the search starts from the result of a search on a
        coarser lattice. It depends on the model, too.
    coarse_steps
        Steps of that search, at most as many as of the search itself.

    Raises
    ------
    InvalidSettings, UnknownName
    """

    name: ClassVar[str] = "basin-hopping"
    predicts_flips: ClassVar[bool] = True

    radius: float = 2.5
    min_density: float = 0.95
    largest_batch: int | None = None
    max_failures: int | None = None
    max_predicted_loss: float = 0.01
    phase_steps: int = 1000
    temperature_factor: float = 0.01
    phase_share: float = 0.7
    min_stall: int | None = None
    stall: float | None = None
    restart_after: float | None = None
    restart_patience: float = 3.0
    restart_chains: int = 4
    restart_steps: float = 30.0
    restart_temperature: float = 0.003
    restart_recombination: float = 0.5
    restart_archive: int = 8
    coarse_beams: int | None = None
    coarse_steps: int = 5000

    def __post_init__(self) -> None:
        SearchSettings.__post_init__(self)
        for name, least in (
            ("largest_batch", 1), ("max_failures", 1), ("phase_steps", 0), ("min_stall", 0),
            ("restart_chains", 1), ("restart_archive", 1), ("coarse_beams", 0),
            ("coarse_steps", 1),
        ):  # fmt: skip
            if getattr(self, name) is not None:
                check_whole(name, getattr(self, name), least)
        for name in (
            "radius", "temperature_factor", "phase_share",
            "restart_patience", "restart_steps", "restart_temperature",
        ):  # fmt: skip
            check_positive(name, getattr(self, name))
        if self.restart_after:
            check_positive("restart_after", self.restart_after)
        for name in (
            "min_density",
            "max_predicted_loss",
            "stall",
            "phase_share",
            "restart_recombination",
        ):
            if getattr(self, name) is not None:
                check_fraction(name, getattr(self, name))

    def limits(self, problem: Problem) -> Limits:
        """Return the settings that depend on the problem."""
        beams = len(problem.designable)
        if problem.section is None:
            default, batch = SPRINGS, (beams - SINGLE_FLIPS) // BEAMS_PER_FLIP
        else:
            default, batch = FRAMES, beams // BEAMS_PER_FLIP_IN_FRAMES
        default = default._replace(
            max_failures=max(default.max_failures, beams // BEAMS_PER_FAILURE),
            largest_batch=max(default.largest_batch, batch),
        )
        given = {name: getattr(self, name) for name in Limits._fields}
        return default._replace(**{key: value for key, value in given.items() if value is not None})
