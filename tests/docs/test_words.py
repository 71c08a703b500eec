"""Code and documentation use the vocabulary of docs/glossary.md."""

from __future__ import annotations

import runpy
from pathlib import Path

ROOT = Path(__file__).parents[2]


def test_no_word_of_the_list_is_used() -> None:
    script = runpy.run_path(str(ROOT / "tools" / "check_words.py"))
    assert script["defects"]() == []
