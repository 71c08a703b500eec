"""A worker process of the engine ``processes``.

It reads numbers of runs and the word ``stop`` from standard input, one per line, and writes one
line of JSON for each run that has ended. It ends as soon as its standard input is closed, also in
the middle of a run, so that it never survives the process that started it.
"""

from __future__ import annotations

import json
import os
import queue
import signal
import sys
import threading

from bellcrank.campaign.work import request_stop, work

STOP = "stop"


def main(store_path: str) -> None:
    """Compute runs of a store until standard input is closed."""
    # Signals are for the process that started this one.
    for each in (signal.SIGINT, signal.SIGTERM):
        signal.signal(each, signal.SIG_IGN)
    replies = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)  # whatever a library prints must not be taken for a reply
    runs: queue.SimpleQueue[int] = queue.SimpleQueue()
    threading.Thread(target=_listen, args=(store_path, runs), daemon=True).start()
    while True:
        number = runs.get()
        reply: dict[str, object] = {"number": number}
        try:
            work(store_path, number)
        except Exception as error:  # reported to the process that started this one
            reply |= {"error": type(error).__name__, "message": str(error)}
        print(json.dumps(reply), file=replies, flush=True)


def _listen(store_path: str, runs: queue.SimpleQueue[int]) -> None:
    for line in sys.stdin:
        if line.strip() == STOP:
            request_stop(store_path)
        else:
            runs.put(int(line))
    os._exit(0)
