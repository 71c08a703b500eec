"""Cost of campaigns: ``python -m benchmarks.campaign [--quick]``.

Measures the speed-up by a second worker, the cost of a run beside its search, and the size of ten
million proposals with the time to search them; estimates the limits for ten thousand cores.
"""

from __future__ import annotations

import argparse
import resource
import subprocess
import sys
import tempfile
import time
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from bellcrank.campaign import (
    EngineOptions,
    StatusReader,
    Store,
    best_designs,
    compact,
    complete,
    engines,
    read_spec,
    verify,
    write_results,
)
from bellcrank.campaign.spec import SEGMENT
from bellcrank.model import problem_from_dict
from bellcrank.search import advance_chain, make_evaluator, read_settings, start_chain

if TYPE_CHECKING:
    from collections.abc import Iterator

    from bellcrank.campaign import Run
    from bellcrank.campaign.engines import Engine

CORES = 10_000


@dataclass(frozen=True, slots=True)
class Effort:
    """Sizes of the measurements.

    Parameters
    ----------
    steps, seeds
        Steps and number of runs of the campaign for the speed-up.
    short_runs
        Number of runs of one segment of 250 steps, for the overhead.
    rows, row_seeds
        Rows and number of runs of the large store.
    """

    steps: int
    seeds: int
    short_runs: int
    rows: int
    row_seeds: int


FULL = Effort(20_000, 30, 400, 10_000_000, 100)
QUICK = Effort(4_000, 4, 40, 200_000, 10)

SPEC = """
name = "{name}"
segment = {segment}

[[tasks]]
problem = "{problem}"
search = "{search}"
steps = {steps}
seeds = {seeds}
"""


def new_store(place: Path, name: str, **values: object) -> Store:
    """Create a campaign of one task."""
    path = place / f"{name}.toml"
    path.write_text(SPEC.format(name=name, **{"segment": 4000, **values}))
    return Store.create(place / name, read_spec(path))


def run(store: Store, *words: str) -> float:
    """Complete a campaign by the command line; return the seconds."""
    start = time.perf_counter()
    command = [sys.executable, "-m", "bellcrank", "campaign", "resume", str(store.path), *words]
    subprocess.run(command, check=True, capture_output=True)
    return time.perf_counter() - start


def speed_up(place: Path, effort: Effort) -> float:
    """Compute the same campaign with one and two workers, twice; return the seconds of a run."""
    print("| workers | seconds | speed-up |")
    print("|---|---|---|")
    values = {"problem": "crane", "search": "basin-hopping"}
    seconds: dict[int, list[float]] = {}
    for number, workers in enumerate((1, 2, 1, 2)):
        name = f"speed-{number}"
        store = new_store(place, name, steps=effort.steps, seeds=effort.seeds, **values)
        spent = run(store, "--workers", str(workers), "--keep-segments")
        seconds.setdefault(workers, []).append(spent)
    for workers, spent in seconds.items():
        ratio = sum(seconds[1]) / sum(spent)
        print(f"| {workers} | {', '.join(f'{value:.1f}' for value in spent)} | {ratio:.2f} |")
    print("\nWhole commands, from start to exit, starting the workers included.\n")
    return min(seconds[1]) / effort.seeds


@dataclass(frozen=True, slots=True)
class Overhead:
    """Seconds of a run beside its search.

    Parameters
    ----------
    worker
        Seconds in the worker, for problem and files.
    dispatch
        Seconds to submit a run and to record its end.
    """

    worker: float
    dispatch: float


def overhead(place: Path, effort: Effort) -> Overhead:
    """Measure runs that are so short that the overhead dominates."""
    values = {"problem": "scaling-8", "search": "paper", "steps": 250, "segment": 250}
    store = new_store(place, "short", seeds=effort.short_runs, **values)
    start = time.perf_counter()
    complete(store, "serial", compacting=False)
    serial = (time.perf_counter() - start) / effort.short_runs
    searching = sum(map(search_alone, store.spec.runs())) / effort.short_runs
    start = time.perf_counter()
    with engines["processes"](store, EngineOptions(workers=2)) as engine:
        starting = time.perf_counter() - start
        dispatch = dispatch_all(engine, store.spec.run_count)
    print("| a run of 250 steps | milliseconds |")
    print("|---|---|")
    print(f"| the search alone | {1e3 * searching:.1f} |")
    print(f"| with its problem, its segment and that on disk | {1e3 * serial:.1f} |")
    print(f"| submission to a worker process | {1e3 * dispatch:.1f} |")
    print(f"\nTwo workers take {starting:.1f} s to start.\n")
    return Overhead(serial - searching, dispatch)


def search_alone(chosen: Run) -> float:
    """Return the seconds of the steps of a run alone."""
    settings = read_settings(chosen.settings)
    evaluator = make_evaluator(problem_from_dict(chosen.task.problem, "it"), settings)
    start = time.perf_counter()
    advance_chain(evaluator, settings, 0, start_chain(evaluator, settings, 0))
    return time.perf_counter() - start


def dispatch_all(engine: Engine, count: int) -> float:
    """Submit runs that are done already; return the seconds for each."""
    engine.submit(0)
    while not engine.collect(1.0):
        pass
    start = time.perf_counter()
    waiting, done = list(range(count)), 0
    hand = 0
    while done < count:
        while waiting and hand < engine.capacity():
            engine.submit(waiting.pop())
            hand += 1
        ended = len(engine.collect(1.0))
        hand, done = hand - ended, done + ended
    return (time.perf_counter() - start) / count


@dataclass(frozen=True, slots=True)
class Weight:
    """Cost of a large store.

    Parameters
    ----------
    row
        Bytes of a proposal in segments.
    status
        Seconds to read the status of a run.
    compaction
        Seconds of compaction per row.
    """

    row: float
    status: float
    compaction: float


def large(place: Path, effort: Effort) -> Weight:
    """Fill a store on all cores, compact and search it."""
    steps = effort.rows // effort.row_seeds
    values = {"problem": "crane", "search": "paper", "steps": steps, "seeds": effort.row_seeds}
    store = new_store(place, "large", **values)
    seconds = {"filling it, on all cores": run(store, "--keep-segments")}
    segments = store.files()
    size = {"segments": (len(segments), sum(path.stat().st_size for path in segments))}
    with timed(seconds, "status, from segments"):
        assert StatusReader(store).read().steps_done == effort.rows
    with timed(seconds, "top 1000, from segments"):
        from_segments = best_designs(store, 1000)
    with timed(seconds, "compaction"):
        compact(store)
    with timed(seconds, "status, from the table"):
        assert StatusReader(store).read().steps_done == effort.rows
    with timed(seconds, "top 1000, from the table"):
        assert best_designs(store, 1000) == from_segments
    with timed(seconds, "results: the best design, cleaned and verified"):
        write_results(store, place / "designs")
    with timed(seconds, "every byte verified"):
        assert verify(store).damage == []
    parts = store.files()
    size["table"] = (len(parts), sum(path.stat().st_size for path in parts))
    print(f"| {effort.rows} proposals of the crane | files | MB | bytes for each |")
    print("|---|---|---|---|")
    for name, (count, total) in size.items():
        print(f"| {name} | {count} | {total / 1e6:.1f} | {total / effort.rows:.1f} |")
    print("\n| on it | seconds |\n|---|---|")
    for name, value in seconds.items():
        print(f"| {name} | {value:.2f} |")
    here, below = (
        resource.getrusage(who).ru_maxrss / 1024
        for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)
    )
    print(f"\nMemory at most: {here:.0f} MB here, {below:.0f} MB in the largest other process.\n")
    return Weight(
        size["segments"][1] / effort.rows,
        seconds["status, from segments"] / effort.row_seeds,
        seconds["compaction"] / effort.rows,
    )


@contextmanager
def timed(seconds: dict[str, float], what: str) -> Iterator[None]:
    """Record the seconds that a block takes."""
    start = time.perf_counter()
    yield
    seconds[what] = time.perf_counter() - start


def estimate(effort: Effort, seconds: float, beside: Overhead, weight: Weight) -> None:
    """Print an estimate for many cores with runs like those of the speed-up."""
    segments = -(-effort.steps // SEGMENT)
    ends = CORES / (seconds + beside.worker)
    files = ends * segments
    rows = ends * effort.steps
    print(f"| {CORES} cores, runs of {effort.steps} steps of the crane | |")
    print("|---|---|")
    print(f"| seconds of a run | {seconds:.1f} |")
    print(f"| overhead in the worker | {beside.worker / seconds:.2%} |")
    print(f"| runs that end in a second | {ends:.0f} |")
    print(f"| runs that one command can submit in a second | {1.0 / beside.dispatch:.0f} |")
    print(f"| cores that one command can supply | {seconds / beside.dispatch:.0f} |")
    print(f"| files written in a second | {files:.0f} |")
    print(f"| MB written in a second | {rows * weight.row / 1e6:.0f} |")
    print(f"| rows in an hour | {3600 * rows:.1e} |")
    print(f"| GB in an hour | {3600 * rows * weight.row / 1e9:.0f} |")
    print(f"| compaction of that hour on one core, hours | {rows * weight.compaction:.1f} |")
    print(f"| seconds to read the status of that hour | {3600 * ends * weight.status:.0f} |")


def main() -> None:
    """Measure and print tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="A fiftieth of the work.")
    effort = QUICK if parser.parse_args().quick else FULL
    with tempfile.TemporaryDirectory() as scratch:
        place = Path(scratch)
        new = new_store(place, "warm", problem="crane", search="paper", steps=250, seeds=1)
        run(new)  # compiles
        seconds = speed_up(place, effort)
        beside = overhead(place, effort)
        estimate(effort, seconds, beside, large(place, effort))


if __name__ == "__main__":
    main()
