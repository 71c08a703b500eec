from __future__ import annotations

import json
from typing import TYPE_CHECKING

from reproduction import studies

from .helpers import call

if TYPE_CHECKING:
    from pathlib import Path


def test_the_list_names_all_studies() -> None:
    outcome = call("study", "list")
    assert outcome.code == 0
    for name in studies:
        assert name in outcome.out
    told = json.loads(call("study", "list", "--json").out)
    assert [each["name"] for each in told] == studies.names()


def test_a_study_leaves_its_record_and_says_what_it_found(tmp_path: Path) -> None:
    outcome = call("study", "angular-springs", "--quick", "--out", tmp_path)
    assert outcome.code == 0, outcome.err
    assert "re-neighbouring" in outcome.out
    assert (tmp_path / "angular-springs.png").is_file()
    record = json.loads((tmp_path / "angular-springs.json").read_text())
    again = call("study", "angular-springs", "--quick", "--out", tmp_path, "--json")
    assert json.loads(again.out)["figures"] == record["figures"]


def test_a_page_is_made_of_the_records_in_a_folder(tmp_path: Path) -> None:
    out = tmp_path / "studies"
    assert call("study", "angular-springs", "--quick", "--out", out).code == 0
    assert call("study", "page", "--out", out).code == 0
    page = (tmp_path / "paper.md").read_text(encoding="utf-8")
    assert "![Angular springs around a node, before and after removals](studies/" in page


def test_unknown_studies_and_empty_folders_are_refused_in_one_line(tmp_path: Path) -> None:
    outcome = call("study", "crain")
    assert outcome.code == 2
    assert "unknown study 'crain'; known: structure" in outcome.err
    outcome = call("study", "page", "--out", tmp_path)
    assert outcome.code == 2
    assert "no records of studies there" in outcome.err
    assert call("study", "paths", "--workers", "0").code == 2
