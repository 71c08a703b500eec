"""A chain that is computed in a process of its own.

Searches with evaluators in Python hold the interpreter lock most of the time, so that threads do
not speed them up. The process computes blocks and sends them to its parent, which stores them.
"""

from __future__ import annotations

import json
import os
import pickle
import signal
import subprocess
import sys
from typing import TYPE_CHECKING, BinaryIO

from bellcrank import errors
from bellcrank.errors import BellcrankError
from bellcrank.search.evaluator import make_evaluator
from bellcrank.search.registry import (
    State,
    advance_chain,
    is_done,
    read_settings,
    read_state,
    start_chain,
)
from bellcrank.storage import Proposals, RunFolder

if TYPE_CHECKING:
    from collections.abc import Iterator

    from bellcrank.search.settings import SearchSettings

PROGRAM = """
import json, sys
sys.path[:] = json.loads(sys.argv[1])
from bellcrank.search.chain_process import main
main(sys.argv[2], int(sys.argv[3]))
"""
"""Program of the process. It does not import the main module of its parent."""
SINGLE_THREAD = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}


def chain_steps(
    folder: RunFolder, settings: SearchSettings, chain: int
) -> Iterator[tuple[State, Proposals]]:
    """Yield the states of a chain after each block and its proposals, from its stored state.

    Parameters
    ----------
    folder
        Run that the chain belongs to.
    settings
        Settings of the search.
    chain
        Number of the chain.
    """
    _, stored = folder.progress(chain)
    evaluator = make_evaluator(folder.problem, settings)
    state = read_state(settings, stored) if stored else start_chain(evaluator, settings, chain)
    while not is_done(state, settings):
        state, proposals = advance_chain(evaluator, settings, chain, state)
        yield state, proposals


class ChainProcess:
    """The blocks of a chain, computed in a process.

    Parameters
    ----------
    folder, settings, chain
        As in `chain_steps`; the process reads the settings from the folder.
    """

    def __init__(self, folder: RunFolder, settings: SearchSettings, chain: int) -> None:
        self._settings = settings
        arguments = [json.dumps(sys.path), str(folder.path.resolve()), str(chain)]
        self._process = subprocess.Popen(
            [sys.executable, "-c", PROGRAM, *arguments],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            env={**os.environ, **SINGLE_THREAD},
        )

    def __iter__(self) -> Iterator[tuple[State, Proposals]]:
        """Yield the state after each block and its proposals.

        Raises
        ------
        BellcrankError
            The error of the process.
        RuntimeError
            If the process ended early.
        """
        assert self._process.stdout is not None
        with self._process.stdout as stream:
            while True:
                try:
                    message = pickle.load(stream)
                except (EOFError, pickle.UnpicklingError, ValueError, OSError):
                    code = self._process.wait()
                    raise RuntimeError(f"the process of a chain ended with status {code}") from None
                if message is None:
                    self._process.wait()
                    return
                kind, content = message
                if kind is not None:
                    raise _error(kind, content)
                state, proposals = content
                yield read_state(self._settings, state), Proposals(*proposals)

    def kill(self) -> None:
        """End the process."""
        self._process.kill()
        self._process.wait()


def _error(name: str, message: str) -> Exception:
    """Return the error of a process."""
    kind = getattr(errors, name, None)
    if isinstance(kind, type) and issubclass(kind, BellcrankError):
        return kind(message)
    return RuntimeError(f"{name}: {message}")


def main(path: str, chain: int) -> None:
    """Compute the blocks of a chain and write them to standard output."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent ends this process
    stream = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    try:
        folder = RunFolder.open(path)
        settings = read_settings(folder.settings)
        for state, proposals in chain_steps(folder, settings, chain):
            _send(stream, (None, (state.to_dict(), tuple(proposals))))
        _send(stream, None)
    except (BrokenPipeError, KeyboardInterrupt):
        os._exit(1)  # the parent has ended
    except Exception as error:
        _send(stream, (type(error).__name__, str(error)))


def _send(stream: BinaryIO, message: object) -> None:
    pickle.dump(message, stream)
    stream.flush()
