"""An archive keeps exactly what no other beats."""

from __future__ import annotations

import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bellcrank.errors import InvalidSettings, UnknownName
from bellcrank.search.goals import MEASURES, ParetoArchive

small = st.integers(-3, 3).map(float)
ANY_MEASURES = st.permutations(list(MEASURES)).flatmap(
    lambda names: st.sampled_from([tuple(names), tuple(names[:2])])
)


def beats(one: dict[str, float], other: dict[str, float]) -> bool:
    better = [MEASURES[n] * (one[n] - other[n]) for n in one]
    return min(better) >= 0.0 and max(better) > 0.0


@given(ANY_MEASURES, st.lists(st.tuples(small, small, small), max_size=25))
def test_the_front_is_what_comparing_all_pairs_leaves(names, points) -> None:
    archive = ParetoArchive(names)
    shown = [dict(zip(names, point, strict=False)) for point in points]
    for number, values in enumerate(shown):
        archive.add(str(number), values)
    expected = {
        tuple(values.items()) for values in shown if not any(beats(o, values) for o in shown)
    }
    front = [tuple(values.items()) for _, values in archive.front()]
    assert len(set(front)) == len(front) == len(archive)
    assert set(front) == expected
    for design, values in archive.front():
        assert shown[int(design)] == values


@given(ANY_MEASURES, st.lists(st.tuples(*[st.floats(-1e9, 1e9)] * 3), max_size=12))
def test_an_archive_survives_plain_data(names, points) -> None:
    archive = ParetoArchive(names)
    for number, point in enumerate(points):
        archive.add(str(number), dict(zip(names, point, strict=False)))
    again = ParetoArchive.from_dict(json.loads(json.dumps(archive.to_dict())))
    assert again.front() == archive.front()
    assert again.to_dict() == archive.to_dict()


def test_bad_measures_and_values_are_refused() -> None:
    with pytest.raises(UnknownName, match="unknown measure 'cost'; known: efficiency"):
        ParetoArchive(("cost", "mass"))
    with pytest.raises(InvalidSettings, match="two or three different"):
        ParetoArchive(("mass",))
    with pytest.raises(InvalidSettings, match="two or three different"):
        ParetoArchive(("mass", "mass"))
    with pytest.raises(InvalidSettings, match="a number for each of mass, efficiency"):
        ParetoArchive(("mass", "efficiency")).add("a", {"mass": 0.1})
