"""Kills, full disks and cut links, by chance, again and again.

``python -m tests.campaign.faults --kills 50`` is the long form of ``test_faults``. Every
campaign ends with the bytes of one that nothing interrupted.
"""

from __future__ import annotations

import argparse
import contextlib
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from bellcrank.campaign import Store, complete, read_spec, verify

from .helpers import everything, write_spec
from .processes import (
    DEADLINE,
    campaign,
    process,
    scheduler,
    segment_count,
    session,
    wait_until,
    worker,
    workers_of,
)

if TYPE_CHECKING:
    from collections.abc import Iterator

SPEC = """
name = "faults"
segment = 250

[[tasks]]
problem = "scaling-8"
search = "paper"
steps = {steps}
seeds = 6
"""


def reference(place: Path, steps: int) -> tuple[Path, dict[str, bytes | str]]:
    """Return a spec, and what its campaign leaves if nothing interrupts it."""
    path = write_spec(place, SPEC.format(steps=steps))
    store = Store.create(place / "uninterrupted", read_spec(path))
    assert complete(store, "serial")
    return path, everything(store.path)


# Kills.


@dataclass(slots=True)
class Tally:
    """What was done to the campaigns."""

    workers: int = 0
    drivers: int = 0
    campaigns: int = 0
    phases: dict[str, int] = field(default_factory=dict)

    @property
    def kills(self) -> int:
        """Number of processes killed."""
        return self.workers + self.drivers


def kill_at_random(
    place: Path, spec: Path, expected: dict[str, bytes | str], kills: int, chance: random.Random
) -> Tally:
    """Run campaigns to their end, killing workers and drivers on the way, until enough died."""
    tally = Tally()
    while tally.kills < kills:
        folder = place / f"store-{tally.campaigns}"
        while not _ended(folder, spec, tally, kills, chance, place / "log"):
            pass
        assert everything(folder) == expected
        assert verify(Store.open(folder)).damage == []
        tally.campaigns += 1
    return tally


def _ended(
    folder: Path, spec: Path, tally: Tally, kills: int, chance: random.Random, log: Path
) -> bool:
    """Begin or go on, and kill now and then; return whether the campaign came to its end."""
    begun = (folder / "campaign.json").exists()
    words = ("resume", folder) if begun else ("run", spec, "--out", folder)
    with process(campaign(*words, "--workers", chance.randint(1, 3)), log) as running:
        # From some instant on, which may be in the middle of the beginning.
        time.sleep(chance.choice([0.0, 0.0, 0.5, 2.0]))
        if chance.random() < 0.7:
            wait_until(lambda: workers_of(running.pid) or running.poll() is not None)
        while running.poll() is None and tally.kills < kills:
            time.sleep(chance.uniform(0.0, 1.5))
            living = workers_of(running.pid)
            if living and chance.random() < 0.6:
                if _kill(chance.choice(living)):
                    tally.workers += 1
            elif chance.random() < 0.5 and running.poll() is None:
                _count_phase(folder, tally)
                running.kill()
                running.wait(DEADLINE)
                tally.drivers += 1
                # Without its driver, no worker works on.
                wait_until(lambda: not session(running.pid))
                return False
        code = running.wait(DEADLINE)
    said = log.read_text()
    assert "Traceback" not in said, said
    if code != 0:  # too many deaths at the same run, one after the other
        assert code == 1, said
        assert said.count("error: ") == 1, said
        assert "workers died during this run" in said, said
    return code == 0


def _kill(pid: int) -> bool:
    with contextlib.suppress(ProcessLookupError):
        os.kill(pid, signal.SIGKILL)
        return True
    return False


def _count_phase(folder: Path, tally: Tally) -> None:
    phase = "before the first segment"
    if segment_count(folder):
        phase = "compacting" if (folder / "table").exists() else "in the middle"
    elif (folder / "table").exists():
        phase = "after compaction"
    tally.phases[phase] = tally.phases.get(phase, 0) + 1


# A full disk.


@contextlib.contextmanager
def small_disk(place: Path, kilobytes: int) -> Iterator[Path]:
    """Mount a file system of some size.

    Raises
    ------
    OSError
        If that is not allowed.
    """
    place.mkdir()
    command = ["mount", "-t", "tmpfs", "-o", f"size={kilobytes}k", "tmpfs", str(place)]
    if subprocess.run(command, capture_output=True, check=False).returncode:
        raise OSError("no right to mount a file system")
    try:
        yield place
    finally:
        subprocess.run(["umount", "-l", str(place)], check=True)


def fill_disk(
    place: Path, spec: Path, expected: dict[str, bytes | str], engine: str, more: int
) -> int:
    """Run a campaign on a disk that is too small, and make room bit by bit until it ends."""
    room, log, failures = 100, place / "log", 0
    with small_disk(place / "disk", room) as disk:
        folder = disk / "store"
        while True:
            begun = (folder / "campaign.json").exists()
            words = ("resume", folder) if begun else ("run", spec, "--out", folder)
            with process(campaign(*words, "--engine", engine), log) as running:
                code = running.wait(DEADLINE)
            if code == 0:
                break
            said = log.read_text()
            assert code == 1, said
            assert said.count("error: ") == 1, said
            assert "No space left on device)" in said, said
            failures += 1
            room += more
            remount = ["mount", "-o", f"remount,size={room}k", str(disk)]
            subprocess.run(remount, check=True)
        assert everything(folder) == expected
    return failures


# A cut link.


@contextlib.contextmanager
def two_machines() -> Iterator[tuple[list[str], list[str], list[str]]]:
    """Make two network namespaces with a link between them.

    Yields how to run a command in each, and what `ip` needs to find the link. The first is
    10.213.0.1, the second 10.213.0.2.

    Raises
    ------
    OSError
        If that is not possible here.
    """
    mark = os.getpid()
    names = [f"bellcrank-{mark}-a", f"bellcrank-{mark}-b"]
    link = [f"bca{mark}", f"bcb{mark}"]
    commands = [["netns", "add", name] for name in names]
    commands.append(["link", "add", link[0], "type", "veth", "peer", "name", link[1]])
    for number, (name, end) in enumerate(zip(names, link, strict=True)):
        commands += [
            ["link", "set", end, "netns", name],
            ["-n", name, "addr", "add", f"10.213.0.{number + 1}/24", "dev", end],
            ["-n", name, "link", "set", "lo", "up"],
            ["-n", name, "link", "set", end, "up"],
        ]
    try:
        for command in commands:
            _ip(*command)
        first, second = (["ip", "netns", "exec", name] for name in names)
        yield first, second, ["-n", names[0], "link", "set", link[0]]
    finally:
        for name in names:
            with contextlib.suppress(OSError):
                _ip("netns", "delete", name)


def _ip(*words: str) -> None:
    try:
        done = subprocess.run(["ip", *words], capture_output=True, text=True, check=False)
    except FileNotFoundError:
        raise OSError("there is no command ip here") from None
    if done.returncode:
        raise OSError(f"ip {' '.join(words)}: {done.stderr.strip()}")


def cut_off_worker(place: Path, spec: Path, expected: dict[str, bytes | str]) -> None:
    """Cut the link to one of two workers in the middle: the other one finishes its run."""
    folder, log = place / "store-of-cut-worker", place / "log-of-cut-worker"
    with (
        two_machines() as (here, there, link),
        scheduler(place, "10.213.0.1", here) as address,
        worker(place, address, "near", here),
        worker(place, address, "far", there),
        process(campaign("run", spec, "--out", folder, "--scheduler", address), log, here) as run,
    ):
        wait_until(lambda: segment_count(folder) >= 4, run)
        _ip(*link, "down")
        assert run.wait(DEADLINE) == 0, log.read_text()
        _ip(*link, "up")
    assert everything(folder) == expected


def cut_off_driver(place: Path, spec: Path, expected: dict[str, bytes | str]) -> None:
    """Cut the link between driver and scheduler: one message, and resuming ends the same."""
    folder, log = place / "store-of-cut-driver", place / "log-of-cut-driver"
    with (
        two_machines() as (here, there, link),
        scheduler(place, "10.213.0.1", here) as address,
        worker(place, address, "near", here),
    ):
        begin = campaign("run", spec, "--out", folder, "--scheduler", address)
        with process(begin, log, there) as run:
            wait_until(lambda: segment_count(folder) >= 2, run)
            _ip(*link, "down")
            assert run.wait(DEADLINE) == 2, log.read_text()
        said = log.read_text()
        assert said.count("error: ") == 1, said
        assert "the connection to the scheduler was lost" in said, said
        assert "Traceback" not in said, said
        _ip(*link, "up")
        with process(campaign("resume", folder, "--scheduler", address), log, there) as run:
            assert run.wait(DEADLINE) == 0, log.read_text()
    assert everything(folder) == expected


def main() -> None:
    """Do all of it, and say what was done."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--kills", type=int, default=50)
    parser.add_argument("--steps", type=int, default=8000, help="of each of the six runs")
    parser.add_argument("--seed", type=int, default=None)
    options = parser.parse_args()
    seed = options.seed if options.seed is not None else random.SystemRandom().randrange(10**6)
    say = sys.stdout.write
    say(f"seed {seed}\n")
    with tempfile.TemporaryDirectory() as scratch:
        place = Path(scratch)
        spec, expected = reference(place, options.steps)
        begin = time.monotonic()
        tally = kill_at_random(place, spec, expected, options.kills, random.Random(seed))
        say(
            f"{tally.workers} workers and {tally.drivers} drivers killed in {tally.campaigns} "
            f"campaigns, {time.monotonic() - begin:.0f} s: no bit differs\n"
            f"drivers were killed: {tally.phases}\n"
        )
        try:
            failures = fill_disk(place, spec, expected, "processes", 150)
            say(f"a disk full {failures} times: no bit differs\n")
        except OSError as error:
            say(f"full disk: left out ({error})\n")
        try:
            cut_off_worker(place, spec, expected)
            say("a worker cut off: no bit differs\n")
            cut_off_driver(place, spec, expected)
            say("a driver cut off: no bit differs\n")
        except OSError as error:
            say(f"cut link: left out ({error})\n")


if __name__ == "__main__":
    main()
