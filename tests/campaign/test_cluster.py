"""Campaigns on a Dask cluster and in SLURM jobs."""

from __future__ import annotations

import datetime as dt
import os
import socket
import time
from typing import TYPE_CHECKING

import pytest

from bellcrank.campaign import EngineOptions, Store, complete
from bellcrank.campaign.engines import cluster as cluster_module
from bellcrank.campaign.engines.cluster import software
from bellcrank.errors import ClusterError

from .helpers import everything, write_spec
from .processes import campaign, process, scheduler, segment_count, session, worker

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from bellcrank.campaign import Spec

pytest.importorskip("distributed")
pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def cluster(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """A scheduler with two workers on this machine."""
    place = tmp_path_factory.mktemp("cluster")
    with scheduler(place) as address, worker(place, address, "one"), worker(place, address, "two"):
        yield address


def test_a_campaign_on_a_running_cluster_is_the_serial_one(
    tmp_path: Path, spec: Spec, tabled: Path, cluster: str
) -> None:
    store = Store.create(tmp_path / "store", spec)
    notes: list[str] = []
    assert complete(store, "dask", EngineOptions(scheduler=cluster), announce=notes.append)
    assert notes == [f"scheduler: {cluster}"]
    assert everything(store.path) == everything(tabled)


def test_workers_with_other_versions_are_refused_before_any_work(
    tmp_path: Path, spec: Spec, cluster: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    store = Store.create(tmp_path / "store", spec)
    ours = {**software(), "numpy": "1.0"}
    monkeypatch.setattr(cluster_module, "software", lambda: ours)
    with pytest.raises(ClusterError, match=r"worker tcp://.*: has other versions.*numpy .* there"):
        complete(store, "dask", EngineOptions(scheduler=cluster))
    assert segment_count(store.path) == 0


def test_a_worker_that_sees_another_store_is_refused_before_any_work(
    tmp_path: Path, spec: Spec, cluster: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    store = Store.create(tmp_path / "store", spec)
    (tmp_path / "store").rename(tmp_path / "elsewhere")
    other = Store.open(tmp_path / "elsewhere")
    monkeypatch.setattr(type(other), "compacted", False)
    monkeypatch.setattr(other, "path", store.path)
    with pytest.raises(ClusterError, match=r"does not find this campaign in .*; choose a folder"):
        complete(other, "dask", EngineOptions(scheduler=cluster))


def test_an_unreachable_scheduler_is_said_in_time(tmp_path: Path, spec: Spec) -> None:
    with socket.socket() as taken:  # bound, but nobody listens
        taken.bind(("127.0.0.1", 0))
        where = f"tcp://127.0.0.1:{taken.getsockname()[1]}"
        options = EngineOptions(scheduler=where, timeout=1.0)
        begin = time.monotonic()
        with pytest.raises(ClusterError, match=rf"scheduler {where}: cannot be reached within 1 s"):
            complete(Store.create(tmp_path / "store", spec), "dask", options)
        assert time.monotonic() - begin < 20.0


def test_a_campaign_over_tls_is_the_serial_one(tmp_path: Path, spec: Spec, tabled: Path) -> None:
    dask = pytest.importorskip("dask")
    pytest.importorskip("cryptography")
    cert, key = self_signed(tmp_path)
    flags = ("--tls-ca-file", str(cert), "--tls-cert", str(cert), "--tls-key", str(key))
    with (
        scheduler(tmp_path, "127.0.0.1", (), "--protocol", "tls", *flags) as address,
        worker(tmp_path, address, "one", (), "--protocol", "tls", *flags),
    ):
        assert address.startswith("tls://")
        store = Store.create(tmp_path / "store", spec)
        files = {"ca-file": str(cert), "client.cert": str(cert), "client.key": str(key)}
        with dask.config.set(
            {f"distributed.comm.tls.{name}": path for name, path in files.items()}
        ):
            assert complete(store, "dask", EngineOptions(scheduler=address))
        assert everything(store.path) == everything(tabled)
        plain = EngineOptions(scheduler=address.replace("tls", "tcp"), timeout=2.0)
        with pytest.raises(ClusterError, match="cannot be reached within 2 s"):
            complete(Store.create(tmp_path / "other", spec), "dask", plain)


def self_signed(folder: Path) -> tuple[Path, Path]:
    """Make a certificate that is its own authority, and its key."""
    from cryptography import x509
    from cryptography.hazmat.primitives import hashes, serialization
    from cryptography.hazmat.primitives.asymmetric import ec

    key = ec.generate_private_key(ec.SECP256R1())
    name = x509.Name([x509.NameAttribute(x509.NameOID.COMMON_NAME, "campaign")])
    now = dt.datetime.now(dt.UTC)
    certificate = (
        x509.CertificateBuilder()
        .subject_name(name)
        .issuer_name(name)
        .public_key(key.public_key())
        .serial_number(1)
        .not_valid_before(now - dt.timedelta(days=1))
        .not_valid_after(now + dt.timedelta(days=1))
        .sign(key, hashes.SHA256())
    )
    paths = folder / "campaign.crt", folder / "campaign.key"
    paths[0].write_bytes(certificate.public_bytes(serialization.Encoding.PEM))
    paths[1].write_bytes(
        key.private_bytes(
            serialization.Encoding.PEM,
            serialization.PrivateFormat.PKCS8,
            serialization.NoEncryption(),
        )
    )
    return paths


SBATCH = """#!/bin/sh
# SLURM, as far as it is needed here: a job is a process.
cp "$1" "$JOBS.$$"
setsid sh "$JOBS.$$" > "$JOBS.$$.log" 2>&1 < /dev/null &
echo $! >> "$JOBS"
echo "Submitted batch job $!"
"""
SCANCEL = """#!/bin/sh
kill -TERM -- "-$1"
"""


def test_a_campaign_in_slurm_jobs_is_the_serial_one(tmp_path: Path, tabled: Path) -> None:
    pytest.importorskip("dask_jobqueue")
    pytest.importorskip("cryptography")
    tools = tmp_path / "tools"
    tools.mkdir()
    for name, text in (("sbatch", SBATCH), ("scancel", SCANCEL)):
        (tools / name).write_text(text)
        (tools / name).chmod(0o755)
    jobs, log, store = tmp_path / "jobs", tmp_path / "log", tmp_path / "store"
    words = (
        "run", write_spec(tmp_path), "--out", store, "--engine", "slurm", "--workers", 2,
        "--host", "127.0.0.1", "--slurm", f"local_directory={tmp_path}",
    )  # fmt: skip
    environment = {"PATH": f"{tools}:{os.environ['PATH']}", "JOBS": str(jobs)}
    with process(campaign(*words), log, **environment) as running:
        code = running.wait(120)
    assert code == 0, log.read_text()
    assert everything(store) == everything(tabled)
    numbers = [int(line) for line in jobs.read_text().split()]
    assert len(numbers) == 2
    end = time.monotonic() + 30.0
    while any(session(number) for number in numbers):
        assert time.monotonic() < end, "a job outlived the campaign"
        time.sleep(0.1)
