"""Cost of campaigns: ``python -m benchmarks.campaign [--quick]``.

Measure the speed-up with two workers, the overhead of a run, the size of a store of ten million
proposals and the times of operations on it; estimate the limits for ten thousand cores. Markdown
tables are printed.
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
        Number of rows (proposals) and of runs of the large store.
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


def new_store(folder: Path, name: str, **values: object) -> Store:
    """Create the store of a campaign of one task."""
    path = folder / f"{name}.toml"
    path.write_text(SPEC.format(name=name, **{"segment": 4000, **values}))
    return Store.create(folder / name, read_spec(path))


def run(store: Store, *arguments: str) -> float:
    """Complete a campaign with the command line; return the wall time in seconds."""
    start = time.perf_counter()
    command = [sys.executable, "-m", "bellcrank", "campaign", "resume", str(store.path)]
    subprocess.run([*command, *arguments], check=True, capture_output=True)
    return time.perf_counter() - start


def speed_up(folder: Path, effort: Effort) -> float:
    """Measure a campaign with one and two workers, twice each; return the seconds of a run."""
    print("| workers | seconds | speed-up |")
    print("|---|---|---|")
    values = {"problem": "crane", "search": "basin-hopping"}
    seconds: dict[int, list[float]] = {}
    for number, workers in enumerate((1, 2, 1, 2)):
        name = f"speed-{number}"
        store = new_store(folder, name, steps=effort.steps, seeds=effort.seeds, **values)
        elapsed = run(store, "--workers", str(workers), "--keep-segments")
        seconds.setdefault(workers, []).append(elapsed)
    for workers, times in seconds.items():
        ratio = sum(seconds[1]) / sum(times)
        print(f"| {workers} | {', '.join(f'{value:.1f}' for value in times)} | {ratio:.2f} |")
    print("\nTimes of whole commands, including the start of the workers.\n")
    return min(seconds[1]) / effort.seeds


@dataclass(frozen=True, slots=True)
class Overhead:
    """Time of a run in addition to its search, in seconds.

    Parameters
    ----------
    worker
        Time in the worker, to read the problem and to write files.
    dispatch
        Time to submit a run and to collect its result.
    """

    worker: float
    dispatch: float


def overhead(folder: Path, effort: Effort) -> Overhead:
    """Measure the overhead with short runs."""
    values = {"problem": "scaling-8", "search": "paper", "steps": 250, "segment": 250}
    store = new_store(folder, "short", seeds=effort.short_runs, **values)
    start = time.perf_counter()
    complete(store, "serial", compacting=False)
    serial = (time.perf_counter() - start) / effort.short_runs
    search = sum(map(search_time, store.spec.runs())) / effort.short_runs
    start = time.perf_counter()
    with engines["processes"](store, EngineOptions(workers=2)) as engine:
        startup = time.perf_counter() - start
        dispatch = dispatch_time(engine, store.spec.run_count)
    print("| run of 250 steps | milliseconds |")
    print("|---|---|")
    print(f"| search | {1e3 * search:.1f} |")
    print(f"| search, reading of the problem, writing of a segment | {1e3 * serial:.1f} |")
    print(f"| submission to a worker process | {1e3 * dispatch:.1f} |")
    print(f"\nTime to start two workers: {startup:.1f} s.\n")
    return Overhead(serial - search, dispatch)


def search_time(job: Run) -> float:
    """Return the time of the steps of a run without its overhead, in seconds."""
    settings = read_settings(job.settings)
    evaluator = make_evaluator(problem_from_dict(job.task.problem, "problem"), settings)
    start = time.perf_counter()
    advance_chain(evaluator, settings, 0, start_chain(evaluator, settings, 0))
    return time.perf_counter() - start


def dispatch_time(engine: Engine, count: int) -> float:
    """Submit runs that are complete; return the time of each in seconds."""
    engine.submit(0)
    while not engine.collect(1.0):
        pass
    start = time.perf_counter()
    queued, finished, submitted = list(range(count)), 0, 0
    while finished < count:
        while queued and submitted < engine.capacity():
            engine.submit(queued.pop())
            submitted += 1
        collected = len(engine.collect(1.0))
        submitted, finished = submitted - collected, finished + collected
    return (time.perf_counter() - start) / count


@dataclass(frozen=True, slots=True)
class StoreCost:
    """Cost of a large store.

    Parameters
    ----------
    row
        Size of a proposal in segments, in bytes.
    status
        Time to read the status of a run, in seconds.
    compaction
        Time of compaction per row, in seconds.
    """

    row: float
    status: float
    compaction: float


def large_store(folder: Path, effort: Effort) -> StoreCost:
    """Measure a large store: its size, and the times of operations before and after compaction."""
    steps = effort.rows // effort.row_seeds
    values = {"problem": "crane", "search": "paper", "steps": steps, "seeds": effort.row_seeds}
    store = new_store(folder, "large", **values)
    seconds = {"searches, on all cores": run(store, "--keep-segments")}
    segments = store.files()
    size = {"segments": (len(segments), sum(path.stat().st_size for path in segments))}
    with timed(seconds, "status, read from segments"):
        assert StatusReader(store).read().steps_done == effort.rows
    with timed(seconds, "best 1000 designs, read from segments"):
        from_segments = best_designs(store, 1000)
    with timed(seconds, "compaction"):
        compact(store)
    with timed(seconds, "status, read from the compacted table"):
        assert StatusReader(store).read().steps_done == effort.rows
    with timed(seconds, "best 1000 designs, read from the compacted table"):
        assert best_designs(store, 1000) == from_segments
    with timed(seconds, "results: cleaning and verification of the best design"):
        write_results(store, folder / "designs")
    with timed(seconds, "verification of all files"):
        assert verify(store).damage == []
    parts = store.files()
    size["compacted table"] = (len(parts), sum(path.stat().st_size for path in parts))
    print(f"| {effort.rows} proposals for the crane | files | MB | bytes per proposal |")
    print("|---|---|---|---|")
    for name, (count, total) in size.items():
        print(f"| {name} | {count} | {total / 1e6:.1f} | {total / effort.rows:.1f} |")
    print("\n| operation | seconds |\n|---|---|")
    for name, value in seconds.items():
        print(f"| {name} | {value:.2f} |")
    parent, children = (
        resource.getrusage(who).ru_maxrss / 1024
        for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)
    )
    print(
        f"\nLargest memory: {parent:.0f} MB in this process, {children:.0f} MB in the largest "
        f"child process.\n"
    )
    return StoreCost(
        size["segments"][1] / effort.rows,
        seconds["status, read from segments"] / effort.row_seeds,
        seconds["compaction"] / effort.rows,
    )


@contextmanager
def timed(seconds: dict[str, float], operation: str) -> Iterator[None]:
    """Record the wall time of a block, in seconds."""
    start = time.perf_counter()
    yield
    seconds[operation] = time.perf_counter() - start


def estimate(effort: Effort, seconds: float, added: Overhead, store: StoreCost) -> None:
    """Print an estimate for many cores with runs like those of the speed-up."""
    segments = -(-effort.steps // SEGMENT)
    run_rate = CORES / (seconds + added.worker)
    rows = run_rate * effort.steps
    print(f"| {CORES} cores, runs of {effort.steps} steps for the crane | |")
    print("|---|---|")
    print(f"| time of a run, s | {seconds:.1f} |")
    print(f"| overhead in the worker | {added.worker / seconds:.2%} |")
    print(f"| completed runs per second | {run_rate:.0f} |")
    print(f"| runs per second that one command can submit | {1.0 / added.dispatch:.0f} |")
    print(f"| cores that one command can supply with runs | {seconds / added.dispatch:.0f} |")
    print(f"| files written per second | {run_rate * segments:.0f} |")
    print(f"| MB written per second | {rows * store.row / 1e6:.0f} |")
    print(f"| rows per hour | {3600 * rows:.1e} |")
    print(f"| GB per hour | {3600 * rows * store.row / 1e9:.0f} |")
    print(f"| compaction of these rows on one core, h | {rows * store.compaction:.1f} |")
    print(f"| reading the status of these runs, s | {3600 * run_rate * store.status:.0f} |")


def main() -> None:
    """Measure and print tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "--quick", action="store_true", help="one fiftieth of the proposals, fewer runs"
    )
    effort = QUICK if parser.parse_args().quick else FULL
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        run(new_store(folder, "warm-up", problem="crane", search="paper", steps=250, seeds=1))
        seconds = speed_up(folder, effort)
        added = overhead(folder, effort)
        estimate(effort, seconds, added, large_store(folder, effort))


if __name__ == "__main__":
    main()
