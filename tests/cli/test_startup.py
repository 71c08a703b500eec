"""Commands refuse wrong input before they import libraries that take long to load."""

from __future__ import annotations

import subprocess
import sys

import pytest

SLOW_LIBRARIES = {"numba", "scipy", "matplotlib", "pyarrow", "torch"}
PROGRAM = f"""
import sys
from bellcrank.cli import main
try:
    main()
except SystemExit as exit:
    print(exit.code, *({SLOW_LIBRARIES!r} & set(sys.modules)))
"""


@pytest.mark.parametrize(
    "command",
    [
        "design nosuch", "design crane --steps 0", "design crane --search nosuch",
        "evaluate nosuch", "validate nosuch", "export nosuch part.stl", "print nosuch a.gcode",
        "card nosuch a.pdf", "campaign run nosuch.toml", "library search --direction nosuch",
        "machine build nosuch", "design crane --nosuch", "measure nosuch.mp4 --design crane",
    ],
)  # fmt: skip
def test_wrong_input_is_refused_without_slow_libraries(command: str, tmp_path) -> None:
    ended = subprocess.run(
        [sys.executable, "-c", PROGRAM, *command.split()],
        cwd=tmp_path, capture_output=True, text=True, timeout=120, check=True,
    )  # fmt: skip
    assert ended.stdout.split() == ["2"], ended.stderr
