"""Print the tests that were skipped, one in a line, to be run by ``pytest @FILE``.

``pytest --junitxml=FILE`` writes the report; ``python tools/skipped_tests.py FILE`` reads it.
"""

from __future__ import annotations

import sys
import xml.etree.ElementTree as ET
from pathlib import Path


def skipped(report: Path) -> list[str]:
    """Return the tests of a report that were skipped; of a skipped module its path."""
    found: dict[str, None] = {}
    for case in ET.parse(report).iter("testcase"):
        if case.find("skipped") is not None:
            module, name = case.get("classname", ""), case.get("name", "")
            # A module that is skipped as a whole is the name, without a class.
            parts = [*module.split("."), name] if module else name.split(".")
            found["::".join(_node(parts))] = None
    return list(found)


def _node(parts: list[str]) -> list[str]:
    """Return the path of a file and the names inside of it."""
    for count in range(len(parts), 0, -1):
        path = Path(*parts[:count]).with_suffix(".py")
        if path.is_file():
            return [path.as_posix(), *parts[count:]]
    raise SystemExit(f"no file of {'.'.join(parts)}")


if __name__ == "__main__":
    print("\n".join(skipped(Path(sys.argv[1]))))
