"""The README gives one command to start with and one to test with, ready to be copied."""

from __future__ import annotations

from pathlib import Path

import pytest

README = Path(__file__).parents[2] / "README.md"


def code_lines(text: str) -> list[str]:
    """Return the lines between fences."""
    blocks = text.split("```")[1::2]
    return [line.strip() for block in blocks for line in block.splitlines()[1:]]


@pytest.mark.parametrize(
    "command",
    ["pip install '.[fem]' && bellcrank design straight-crane", "pip install '.[test]' && pytest"],
)
def test_the_readme_gives_each_of_the_two_commands_on_a_line_of_its_own(command: str) -> None:
    assert code_lines(README.read_text()).count(command) == 1
