"""The errors that bellcrank raises on purpose.

Every one derives from `BellcrankError` and from the builtin a caller would
expect, so that both ``except BellcrankError`` and ``except ValueError`` work.
A message says which argument, what was expected, what came, and what to do.
"""

from __future__ import annotations


class BellcrankError(Exception):
    """Root of all errors raised on purpose by bellcrank."""


class InvalidProblem(BellcrankError, ValueError):
    """A lattice, problem or design breaks a rule that everything relies on."""


class InvalidFile(BellcrankError, ValueError):
    """A file cannot be read as what it should be."""


class InvalidSettings(BellcrankError, ValueError):
    """A search, run or command was given settings that make no sense."""


class NoDesignFound(BellcrankError, RuntimeError):
    """A search found no design that can be built and satisfies its goals."""


class UnknownName(BellcrankError, KeyError):
    """A registry has no entry of that name."""

    def __str__(self) -> str:  # KeyError would print the repr of the message
        return str(self.args[0])


class OutputExists(BellcrankError, FileExistsError):
    """Writing would overwrite something and nobody asked for that."""


class StorageError(BellcrankError, OSError):
    """A result could not be written (disk full, folder not writable)."""


class CorruptRun(BellcrankError, ValueError):
    """A run directory does not hold what its own description says."""


class ClusterError(BellcrankError, RuntimeError):
    """The machines of a campaign cannot be reached, or do not fit together."""


class RunFailed(BellcrankError, RuntimeError):
    """Runs of a campaign could not be brought to their end."""


class InvalidDataset(BellcrankError, ValueError):
    """Data to learn from is empty, inconsistent or has labels that are no numbers."""


class InvalidModel(BellcrankError, ValueError):
    """A trained network cannot be read, or is not for the lattice it is asked about."""


def first_line(error: BaseException) -> str:
    r"""Return what an error of somebody else's says, in one line to go into a message of ours.

    Examples
    --------
    >>> first_line(ValueError("too short\nsee the manual")), first_line(KeyError())
    ('too short', 'KeyError()')
    """
    return (str(error).strip() or repr(error)).splitlines()[0]
