"""Exceptions of bellcrank.

Each derives from `BellcrankError` and from the matching builtin exception, so that both
``except BellcrankError`` and ``except ValueError`` work. A message names the argument, the
expected value, the value received, and what to do.
"""

from __future__ import annotations


class BellcrankError(Exception):
    """Base class of all exceptions of bellcrank."""


class InvalidProblem(BellcrankError, ValueError):
    """A lattice, problem or design is not valid."""


class InvalidFile(BellcrankError, ValueError):
    """A file cannot be read or does not follow its schema."""


class InvalidSettings(BellcrankError, ValueError):
    """A setting or argument is not valid."""


class UnreadableFilm(BellcrankError, ValueError):
    """A film or its pictures do not show the motion of a part well enough to measure it."""


class NoDesignFound(BellcrankError, RuntimeError):
    """A search found no design that can be built and satisfies its goals."""


class UnknownName(BellcrankError, KeyError):
    """A registry has no entry of that name."""

    def __str__(self) -> str:  # KeyError would print the repr of the message
        return str(self.args[0])


class OutputExists(BellcrankError, FileExistsError):
    """The output exists already and is not to be overwritten."""


class StorageError(BellcrankError, OSError):
    """A result could not be written (disk full, folder not writable)."""


class CorruptRun(BellcrankError, ValueError):
    """The content of a run folder contradicts its description."""


class ClusterError(BellcrankError, RuntimeError):
    """The workers of a campaign cannot be reached or have different versions."""


class RunFailed(BellcrankError, RuntimeError):
    """A run or an external program failed."""


class InvalidDataset(BellcrankError, ValueError):
    """A training set is empty, inconsistent or has labels that are not finite."""


class InvalidModel(BellcrankError, ValueError):
    """A trained network cannot be read or belongs to another lattice."""


def first_line(error: BaseException) -> str:
    r"""Return the first line of an exception's message, for use in another message.

    Examples
    --------
    >>> first_line(ValueError("too short\nsee the manual")), first_line(KeyError())
    ('too short', 'KeyError()')
    """
    return (str(error).strip() or repr(error)).splitlines()[0]
