"""Short refinements for tests of what is done with their results."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from bellcrank.refine import RefinementSettings
from bellcrank.workflows.refinement import refine_selection

if TYPE_CHECKING:
    import pytest

    from bellcrank.part import PartSpec
    from bellcrank.search import Selection


def shorten(patch: pytest.MonkeyPatch, first: int, further: int) -> None:
    """Refine designs of searches for fewer geometries, all of them first and the best further."""
    patch.setattr("bellcrank.workflows.refinement.FIRST", RefinementSettings(evaluations=first))
    patch.setattr("bellcrank.workflows.refiners.SETTINGS", RefinementSettings(evaluations=further))


def make_without_sheet(patch: pytest.MonkeyPatch) -> None:
    """Make entries of a library by short refinements, in frames alone."""

    def refine(selection: Selection, _part: PartSpec, **options: Any) -> Any:
        return refine_selection(selection, None, **options)

    shorten(patch, 10, 30)
    patch.setattr("bellcrank.workflows.library_making.refine_selection", refine)
