"""Where a result comes from, without saying whose."""

from __future__ import annotations

import getpass
import json
import subprocess
import sys
from datetime import datetime, timedelta
from pathlib import Path

import pytest

from bellcrank import provenance as module
from bellcrank.provenance import provenance

COMMIT = "0123456789abcdef0123456789abcdef01234567"


def test_it_names_versions_machine_and_time_and_what_is_added() -> None:
    note = provenance(seed=3)
    assert note["seed"] == 3
    assert note["python"] == sys.version.split()[0]
    assert all(note[key] for key in ("version", "numpy", "numba", "machine"))
    assert datetime.fromisoformat(note["time"]).utcoffset() == timedelta(0)


def test_it_names_no_person_and_no_folder() -> None:
    text = json.dumps(provenance())
    assert "/" not in text
    assert getpass.getuser() not in text


def test_the_commit_is_the_one_git_tells() -> None:
    root = Path(module.__file__).parents[2]
    if not (root / ".git").exists():
        pytest.skip("bellcrank is not run from a checkout")
    # Another commit may be made in between: look before and after.
    command = ["git", "-C", str(root), "rev-parse", "HEAD"]
    before = subprocess.run(command, check=True, capture_output=True, text=True).stdout.strip()
    found = provenance()["commit"]
    after = subprocess.run(command, check=True, capture_output=True, text=True).stdout.strip()
    assert found in {before, after}


def test_a_commit_is_read_from_every_form_a_checkout_takes(tmp_path: Path) -> None:
    git = tmp_path / "loose" / ".git"
    (git / "refs" / "heads").mkdir(parents=True)
    (git / "HEAD").write_text("ref: refs/heads/main\n")
    (git / "refs" / "heads" / "main").write_text(f"{COMMIT}\n")
    assert module._commit_of_checkout(tmp_path / "loose") == COMMIT

    (git / "refs" / "heads" / "main").unlink()
    (git / "packed-refs").write_text(f"# pack-refs with: peeled\n{COMMIT} refs/heads/main\n")
    assert module._commit_of_checkout(tmp_path / "loose") == COMMIT

    linked = git / "worktrees" / "linked"
    linked.mkdir(parents=True)
    (linked / "HEAD").write_text("ref: refs/heads/main\n")
    (linked / "commondir").write_text("../..\n")
    (tmp_path / "linked").mkdir()
    (tmp_path / "linked" / ".git").write_text(f"gitdir: {linked}\n")
    assert module._commit_of_checkout(tmp_path / "linked") == COMMIT

    (git / "HEAD").write_text(f"{COMMIT}\n")
    assert module._commit_of_checkout(tmp_path / "loose") == COMMIT


def test_without_a_checkout_there_is_no_commit_and_no_error(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "__file__", str(tmp_path / "a" / "b" / "c" / "provenance.py"))
    assert provenance()["commit"] is None
