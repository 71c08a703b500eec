from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import bellcrank
from reproduction import studies

from .helpers import call


def test_the_list_names_all_studies() -> None:
    outcome = call("study", "list")
    assert outcome.code == 0
    for name in studies:
        assert name in outcome.out
    rows = json.loads(call("study", "list", "--json").out)
    assert [each["name"] for each in rows] == studies.names()


def test_a_study_writes_its_record_and_prints_the_comparison(tmp_path: Path) -> None:
    outcome = call("study", "angular-springs", "--quick", "--out", tmp_path)
    assert outcome.code == 0, outcome.err
    assert "re-neighbouring" in outcome.out
    assert (tmp_path / "angular-springs.png").is_file()
    record = json.loads((tmp_path / "angular-springs.json").read_text())
    again = call("study", "angular-springs", "--quick", "--out", tmp_path, "--json")
    assert json.loads(again.out)["figures"] == record["figures"]


def test_the_page_is_written_from_the_records_in_a_folder(tmp_path: Path) -> None:
    out = tmp_path / "studies"
    assert call("study", "angular-springs", "--quick", "--out", out).code == 0
    assert call("study", "page", "--out", out).code == 0
    page = (tmp_path / "paper.md").read_text(encoding="utf-8")
    assert "(studies/angular-springs.png)" in page


def test_unknown_studies_and_empty_folders_are_rejected(tmp_path: Path) -> None:
    outcome = call("study", "crain")
    assert outcome.code == 2
    assert "unknown study 'crain'; known: structure" in outcome.err
    outcome = call("study", "page", "--out", tmp_path)
    assert outcome.code == 2
    assert "no records" in outcome.err
    assert str(tmp_path) in outcome.err.replace("\n", "")
    assert call("study", "paths", "--workers", "0").code == 2


def test_the_command_names_the_missing_folder_outside_a_checkout(tmp_path: Path) -> None:
    packages = tmp_path / "site-packages"
    packages.mkdir()
    (packages / "bellcrank").symlink_to(Path(bellcrank.__file__).parent)
    done = subprocess.run(
        [sys.executable, "-m", "bellcrank", "study", "list"],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(packages)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 2
    assert "reproduction/" in done.stderr
    assert "Traceback" not in done.stderr
