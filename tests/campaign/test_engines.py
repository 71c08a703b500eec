"""All engines leave the same bytes and no process behind, and check their options."""

from __future__ import annotations

import subprocess
import sys
import textwrap
from typing import TYPE_CHECKING

import pytest

from bellcrank.campaign import EngineOptions, Shard, Store, complete, engines
from bellcrank.campaign.engines import cluster
from bellcrank.errors import ClusterError, InvalidSettings, UnknownName

from .helpers import everything, write_spec
from .processes import (
    DEADLINE,
    campaign,
    process,
    segment_count,
    session,
    wait_until,
    workers_of,
)

if TYPE_CHECKING:
    from pathlib import Path

    from bellcrank.campaign import Spec


@pytest.mark.slow
def test_a_campaign_in_processes_is_the_serial_one(tmp_path: Path, tabled: Path) -> None:
    log = tmp_path / "log"
    words = ("run", write_spec(tmp_path), "--out", tmp_path / "store", "--workers", 3)
    with process(campaign(*words), log) as running:
        assert running.wait(120) == 0, log.read_text()
        assert everything(tmp_path / "store") == everything(tabled)
        assert workers_of(running.pid) == []
    assert "Traceback" not in log.read_text()


def test_shards_together_are_the_whole(tmp_path: Path, spec: Spec, tabled: Path) -> None:
    for index in (3, 1, 2):
        store = Store.create(tmp_path / "store", spec)
        assert complete(store, "serial", shard=Shard(index, 3))
    assert store.compacted
    assert everything(store.path) == everything(tabled)


def test_one_machine_needs_no_dask(tmp_path: Path) -> None:
    script = f"""
        import sys
        from bellcrank.cli import main
        sys.argv = ["bellcrank", "campaign", "run", {str(write_spec(tmp_path))!r},
                    "--out", {str(tmp_path / "store")!r}, "--shard", "2/2", "--engine", "processes"]
        try:
            main()
        finally:
            assert not {{"dask", "distributed"}} & set(sys.modules)
    """
    subprocess.run([sys.executable, "-c", textwrap.dedent(script)], check=True)
    assert segment_count(tmp_path / "store") == 4


@pytest.mark.parametrize("text", ["0/3", "4/3", "1", "a/b", "1/2/3", ""])
def test_a_shard_that_makes_no_sense_is_refused(text: str) -> None:
    with pytest.raises(InvalidSettings, match="shard: expected i/N"):
        Shard.parse(text)


def test_an_engine_refuses_options_that_it_cannot_use(tmp_path: Path, spec: Spec) -> None:
    store = Store.create(tmp_path / "store", spec)
    with pytest.raises(UnknownName, match="unknown engine 'ray'; known: "):
        complete(store, "ray")
    with pytest.raises(InvalidSettings, match="engine 'serial' has one worker; got 2"):
        complete(store, "serial", EngineOptions(workers=2))
    with pytest.raises(InvalidSettings, match="expected an address like tcp://host:8786"):
        complete(store, "dask", EngineOptions(scheduler="localhost:8786"))
    assert set(engines) == {"processes", "dask", "slurm", "serial"}


@pytest.mark.parametrize(
    ("engine", "missing"), [("dask", "distributed"), ("slurm", "dask_jobqueue")]
)
def test_a_missing_extra_is_named(
    tmp_path: Path, spec: Spec, monkeypatch: pytest.MonkeyPatch, engine: str, missing: str
) -> None:
    monkeypatch.setattr(
        cluster,
        "find_spec",
        lambda name: None if name == missing else name,
    )
    store = Store.create(tmp_path / "store", spec)
    with pytest.raises(ClusterError, match=rf"{missing}.*bellcrank\[cluster\]"):
        complete(store, engine, EngineOptions(scheduler="tcp://127.0.0.1:1"))


ENDLESS = """
name = "endless"
segment = 1_000_000_000

[[tasks]]
problem = "scaling-8"
search = "paper"
steps = 1_000_000_000
seeds = 2
"""
"""Runs whose first segment takes days."""


@pytest.mark.slow
def test_a_stop_does_not_wait_for_the_end_of_a_segment(tmp_path: Path) -> None:
    log, store = tmp_path / "log", tmp_path / "store"
    words = ("run", write_spec(tmp_path, ENDLESS), "--out", store, "--workers", 2)
    with process(campaign(*words), log) as running:
        wait_until(lambda: len(workers_of(running.pid)) == 2, running)
        running.terminate()
        assert running.wait(DEADLINE) == 130, log.read_text()
        wait_until(lambda: not session(running.pid))
    assert f"bellcrank campaign resume {store}" in log.read_text()


@pytest.mark.slow
def test_workers_end_with_a_killed_command_and_the_campaign_resumes_to_the_same_bytes(
    tmp_path: Path, tabled: Path
) -> None:
    log, store = tmp_path / "log", tmp_path / "store"
    words = ("run", write_spec(tmp_path), "--out", store, "--workers", 2)
    with process(campaign(*words), log) as running:
        wait_until(lambda: segment_count(store) >= 1, running)
        running.kill()
        running.wait(DEADLINE)
        wait_until(lambda: not session(running.pid))
    assert complete(Store.open(store), "serial")
    assert everything(store) == everything(tabled)
