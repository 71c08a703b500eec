"""The page that is shipped is the one that its sources make."""

from __future__ import annotations

import hashlib
import re
import shutil
import subprocess
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

pytest.importorskip("fastapi", reason="needs the extra [web]")

from bellcrank.web.app import PAGES, STATIC

WEB = Path(__file__).parents[2] / "web"
WEIGHT = 1_000_000
"""Bytes that the page may have in all."""

pytestmark = pytest.mark.skipif(not WEB.is_dir(), reason="the sources of the page are not here")


def test_the_page_was_built_from_its_sources() -> None:
    digest = hashlib.sha256()
    for path in sorted((WEB / "src").iterdir(), key=lambda path: path.name):
        digest.update(path.name.encode() + b"\0" + path.read_bytes() + b"\0")
    noted = (STATIC / "sources.sha256").read_text().strip()
    assert noted == digest.hexdigest(), "build the page again: cd web && npm run build"


def test_the_sources_import_each_other_without_a_circle() -> None:
    imports = {
        path.stem: re.findall(r'from "\./(\w+)"', path.read_text(encoding="utf-8"))
        for path in (WEB / "src").glob("*.ts")
    }
    order = TopologicalSorter(imports)
    assert set(order.static_order()) == set(imports)  # raises CycleError for a circle


def test_the_page_is_light() -> None:
    assert sum((STATIC / name).stat().st_size for name, _ in PAGES.values()) < WEIGHT


def test_building_the_page_again_changes_nothing(tmp_path: Path) -> None:
    tools = WEB / "node_modules" / ".bin"
    if shutil.which("node") is None or not (tools / "esbuild").exists():
        pytest.skip("needs node, and npm install in web/")
    # The command of package.json, elsewhere: what is shipped stays as it is.
    root = tmp_path / "src" / "bellcrank" / "web" / "static"
    root.mkdir(parents=True)
    here = tmp_path / "web"
    shutil.copytree(WEB, here, symlinks=True, ignore=shutil.ignore_patterns("node_modules"))
    (here / "node_modules").symlink_to(WEB / "node_modules", target_is_directory=True)
    subprocess.run(["npm", "run", "build"], cwd=here, check=True, capture_output=True, timeout=120)
    for path in sorted(STATIC.iterdir()):
        assert (root / path.name).read_bytes() == path.read_bytes(), path.name
