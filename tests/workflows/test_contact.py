"""Contact is found along the whole stroke, not only at its end."""

from __future__ import annotations

import numpy as np
import pytest

from bellcrank.export import Export
from bellcrank.fem import FemSettings, levels
from bellcrank.fem.contact import centre_lines, find_contacts
from bellcrank.mechanics import VERIFICATION_INCREMENT, Status
from bellcrank.model import Design, Input, Lattice, Output, Problem, Supports
from bellcrank.part import PartSpec, frame_problem
from bellcrank.search import HoppingSettings, Verdict
from bellcrank.search.constraints import ConstrainedEvaluator, LoadCase
from bellcrank.search.verification import Verifier
from bellcrank.workflows.fabricate import print_warnings, profile_for

SPEC = PartSpec(width=1.5)


@pytest.fixture(scope="module")
def sweep() -> Design:
    """A cantilever whose tip passes the end of a fixed strut, and is clear of it at both ends."""
    positions = [[0.0, 0.0], [0.0, 0.5], [0.0, 1.0], [0.4, 1.05], [0.4, 2.0]]
    problem = Problem(
        name="sweep",
        lattice=Lattice(positions, [[0, 1], [1, 2], [3, 4], [2, 3]]),
        supports=Supports(fixed=[0, 3, 4]),
        input=Input(nodes=[2], direction=[1.0, 0.0], drive="displacement", amount=0.8),
        output=Output(nodes=[1], direction=[1.0, 0.0]),
        designable=[3],
    )
    return Design(problem, [True, True, True, False])


def test_a_frame_reports_contact_in_the_middle_of_the_stroke(sweep: Design) -> None:
    analysis = levels["frame"](SPEC.of(sweep), FemSettings())
    assert analysis.last.load == 1.0
    [contact] = analysis.to_dict()["contacts"]
    assert contact["beams"] == [1, 2]
    assert contact["first_at"] == analysis.contacts.first
    assert 0.35 < contact["first_at"] < 0.65
    assert 0.5 < contact["overlap_mm"] <= 1.0
    assert f"{contact['first_at']:.0%} of the stroke" in " ".join(analysis.warnings)


def test_pairs_that_meet_in_a_node_are_named() -> None:
    # A fold: the second strut turns onto the first, with which it shares a node.
    rest = centre_lines(np.array([[[0.0, 0.0], [10.0, 0.0]], [[10.0, 0.0], [10.0, 10.0]]]))
    folded = centre_lines(np.array([[[0.0, 0.0], [10.0, 0.0]], [[10.0, 0.0], [0.2, 1.0]]]))
    fold = find_contacts(np.array([3, 5]), rest, [(0.5, folded)], 2.0)
    assert fold.pairs.tolist() == [[3, 5]]
    assert fold.meets.tolist() == [True]
    assert fold.message.startswith("a pair of struts that meet in a node touches or crosses")
    three = np.concatenate([rest, centre_lines(np.array([[[0.0, 4.0], [8.0, 4.0]]]))])
    moved = np.concatenate([folded, centre_lines(np.array([[[0.0, 1.0], [8.0, 1.0]]]))])
    both = find_contacts(np.array([3, 5, 8]), three, [(0.5, moved)], 2.0)
    assert both.pairs.tolist() == [[3, 5], [3, 8], [5, 8]]
    assert both.meets.tolist() == [True, False, False]
    assert "3 pairs of struts touch or cross, 1 of struts that meet in a node" in both.message


def test_a_frame_with_contact_along_the_stroke_has_a_fault(sweep: Design) -> None:
    verifier = Verifier(frame_problem(sweep.problem, SPEC), HoppingSettings())
    verification = verifier.verify(sweep.mask)
    assert verification.is_stable
    assert verification.fault == "beams touch along the stroke"
    assert verification.contacts.pairs.tolist() == [[1, 2]]
    assert verification.contacts.first == 0.375


def test_a_linear_analysis_checks_its_only_state(sweep: Design) -> None:
    linear = levels["frame"](SPEC.of(sweep), FemSettings(linear=True))
    assert linear.contacts.first is None
    assert linear.contacts.to_list() == []


def test_a_sheet_reports_contact_in_the_middle_of_the_stroke(sweep: Design) -> None:
    pytest.importorskip("ngsolve", reason="NGSolve is not installed")
    analysis = levels["plane"](SPEC.of(sweep), FemSettings())
    assert analysis.contacts.pairs.tolist() == [[1, 2]]
    assert analysis.contacts.first is not None
    assert 0.3 < analysis.contacts.first < 0.7


def test_no_contact_is_verified_along_the_stroke(sweep: Design) -> None:
    evaluator = ConstrainedEvaluator([LoadCase(sweep.problem)], ["no-contact 0.15"])
    assert evaluator.evaluate(sweep.mask).status is Status.CONVERGED
    assert evaluator.evaluate(sweep.mask, VERIFICATION_INCREMENT).status is Verdict.UNMET
    assert evaluator.violated(sweep.mask) == ["no-contact 0.15"]
    clear = ConstrainedEvaluator([LoadCase(sweep.problem)], ["no-contact 0.01"])
    assert clear.evaluate(sweep.mask, VERIFICATION_INCREMENT).status is Status.CONVERGED


def test_the_report_before_printing_names_contact_along_the_stroke(sweep: Design) -> None:
    bundle = Export(part=SPEC.of(sweep))
    findings = " ".join(print_warnings(bundle, profile_for(None, SPEC)))
    assert "beams 1 and 2 from 38% of the stroke" in findings
