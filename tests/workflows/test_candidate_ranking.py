"""Ranking of candidates by nonlinear frame analysis."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from bellcrank.fem import FemSettings, levels
from bellcrank.mechanics import VERIFICATION_INCREMENT, SpringEvaluator
from bellcrank.model import Design, Problem, pack_mask, read_problem, unpack_mask
from bellcrank.part import PartSpec, calibrated
from bellcrank.search import Candidate, Finalist, HoppingSettings, read_settings
from bellcrank.workflows import complete_design, start_design
from bellcrank.workflows.candidate_ranking import (
    COARSE,
    FINE,
    CandidateAnalysis,
    CandidateRanking,
    fault_of,
    shortlist,
)
from bellcrank.workflows.design import conclude

if TYPE_CHECKING:
    from pathlib import Path

    from bellcrank.storage import RunFolder

LIFT = """
schema = "bellcrank/problem/1"
name = "lift"
[lattice]
kind = "triangular-rows"
counts = [8, 9, 8, 9, 8, 9]
first_x = [0.5, 0.0, 0.5, 0.0, 0.5, 0.0]
[supports]
fixed = [{ row = 0 }]
[input]
nodes = [{ row = -1, rightmost = 2 }]
direction = [0, -1]
drive = "displacement"
amount = 0.2
[output]
nodes = [{ row = -1, leftmost = 2 }]
direction = [0, 1]
"""
TURNS_OVER = "fffff1ffaf21f4acda0d83d1fdd47ff8"
"""Efficiency 13.12 in the model; -12.85 as a frame, whose struts run into each other."""
WORKS = "ffffff492db1d814dfec03f3e6c47ff8"
"""13.09 in the model, 13.01 as a frame. One search found both, and preferred the other."""
FULL = "f" * 31 + "8"
SPEC = PartSpec(width=2.0)


@pytest.fixture
def task(tmp_path: Path) -> Problem:
    path = tmp_path / "lift.toml"
    path.write_text(LIFT)
    return calibrated(read_problem(path), SPEC.width)


def finalist(task: Problem, mask: str, chain: int = 0) -> Finalist:
    """A cleaned design, with its response."""
    design = Design(task, unpack_mask(mask, task.lattice.beam_count))
    response = SpringEvaluator(task).evaluate(design.mask, VERIFICATION_INCREMENT)
    return Finalist(Candidate(response.efficiency, chain, 0, b""), design, response)


def test_a_part_that_turns_over_is_passed_over(task: Problem) -> None:
    best, second = finalist(task, TURNS_OVER), finalist(task, WORKS)
    assert best.response.efficiency > second.response.efficiency
    reported: list[tuple[int, int]] = []
    choice = CandidateRanking(
        SPEC, HoppingSettings(), lambda done, total: reported.append((done, total))
    )
    chosen, refused = choice([best, second])
    assert chosen is second
    assert refused == [(best.response.efficiency, "struts touch as a frame")]
    assert reported == [(0, 2), (1, 2), (2, 2)]


def test_the_more_efficient_of_two_sound_parts_is_chosen(task: Problem) -> None:
    full = finalist(task, FULL)
    works = finalist(task, WORKS)
    chosen, refused = CandidateRanking(SPEC, HoppingSettings())([works, full])
    assert chosen is works
    assert refused == [(full.response.efficiency, "smaller efficiency as a frame")]


def test_frames_are_ranked_by_the_objective_of_the_design(task: Problem) -> None:
    works = finalist(task, WORKS)
    other = finalist(replace(task, objective="directional:40"), WORKS)
    analyse = CandidateRanking(SPEC, HoppingSettings()).analyse
    own, directional = analyse(works), analyse(other)
    assert own.rank == (2, own.analysis.efficiency)
    assert directional.rank == (2, directional.analysis.efficiency)
    assert directional.analysis.efficiency < own.analysis.efficiency
    # The factor of motion along the wanted direction is that of the spring model's objective.
    loss = other.response.efficiency / works.response.efficiency
    assert directional.analysis.efficiency / own.analysis.efficiency == pytest.approx(loss, rel=0.1)
    mean = CandidateRanking(SPEC, HoppingSettings(strokes=(0.5, 1.0))).analyse(works)
    assert mean.rank == (2, works.response.efficiency)


def test_where_no_part_is_sound_one_is_chosen_nevertheless(task: Problem) -> None:
    best = finalist(task, TURNS_OVER)
    chosen, refused = CandidateRanking(SPEC, HoppingSettings())([best])
    assert chosen is best
    assert refused == []


def test_what_closer_analysis_finds_worse_is_passed_over_for_what_it_found(
    task: Problem, monkeypatch: pytest.MonkeyPatch
) -> None:
    best, works = finalist(task, TURNS_OVER), finalist(task, WORKS)
    analyse = CandidateRanking.analyse

    def blind(
        self: CandidateRanking, each: Finalist, settings: FemSettings = FINE
    ) -> CandidateAnalysis:
        seen = analyse(self, works if settings is COARSE else each, settings)
        return CandidateAnalysis(each, seen.analysis, each.response.efficiency)

    monkeypatch.setattr(CandidateRanking, "analyse", blind)
    chosen, refused = CandidateRanking(SPEC, HoppingSettings())([best, works])
    assert chosen is works
    assert refused == [(best.response.efficiency, "struts touch as a frame")]


def test_what_hangs_on_no_support_is_no_part(task: Problem) -> None:
    held = np.isin(task.lattice.beams, task.supports.nodes).any(axis=1)
    bridge = finalist(task, pack_mask(~held))
    works = finalist(task, WORKS)
    chosen, refused = CandidateRanking(SPEC, HoppingSettings())([bridge, works])
    assert chosen is works
    assert refused == [(bridge.response.efficiency, "not supported")]
    assert CandidateRanking(SPEC, HoppingSettings())([bridge]) == (bridge, [])


def test_a_strain_beyond_the_material_is_a_fault(task: Problem) -> None:
    design = finalist(task, WORKS).design
    soft = levels["frame"](SPEC.of(design), FemSettings(elements=3))
    brittle = levels["frame"](
        PartSpec(width=2.0, material="pla").of(design), FemSettings(elements=3)
    )
    assert fault_of(soft) is None
    assert fault_of(brittle) == "strain above the limit as a frame"


def test_each_chain_has_its_turn(task: Problem) -> None:
    listed = [finalist(task, WORKS, chain) for chain in (0, 0, 0, 1, 2, 1)]
    assert [each.found.chain for each in shortlist(listed)] == [0, 1, 2, 0, 1, 0]
    assert shortlist(listed)[0] is listed[0]
    many = [listed[0]] * 100
    assert len(shortlist(many)) == 24


def designed(task_file: Path, out: Path, **settings: Any) -> RunFolder:
    """A short search for a part."""
    search = read_settings({"steps": 500, "chains": 2, **settings})
    folder = start_design(read_problem(task_file), search, out, SPEC)
    assert complete_design(folder, workers=1) is not None
    return folder


def test_a_search_for_a_part_ends_with_its_validation(task: Problem, tmp_path: Path) -> None:
    folder = designed(tmp_path / "lift.toml", tmp_path / "out")
    record = json.loads((folder.path / "validation.json").read_text())
    summary = json.loads((folder.path / "summary.json").read_text())
    assert record["mask"] == summary["mask"]
    [result] = record["results"]
    assert summary["as_part"]["efficiency"] == result["efficiency"]
    assert result["part"]["width"] == 2.0
    text = (folder.path / "summary.md").read_text()
    assert re.search(rf"efficiency, frame of 2 mm struts \| {result['efficiency']:.4f} ", text)
    assert f"| {result['von_mises_MPa']:.2g} MPa" in text


@pytest.mark.slow
def test_the_record_of_another_design_is_removed(task: Problem, tmp_path: Path) -> None:
    folder = designed(tmp_path / "lift.toml", tmp_path / "out")
    path = folder.path / "validation.json"
    record = json.loads(path.read_text())
    path.write_text(json.dumps({**record, "mask": TURNS_OVER}))
    conclude(folder, read_settings(folder.settings))
    assert json.loads(path.read_text())["mask"] == record["mask"]


def test_a_design_for_no_part_has_no_validation(task: Problem, tmp_path: Path) -> None:
    settings = read_settings({"steps": 300, "chains": 1})
    folder = start_design(read_problem(tmp_path / "lift.toml"), settings, tmp_path / "plain")
    report = complete_design(folder, workers=1)
    assert report is not None
    assert report.validation is None
    assert not (folder.path / "validation.json").exists()
    assert json.loads((folder.path / "summary.json").read_text())["as_part"] is None
