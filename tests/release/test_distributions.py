"""What a wheel and a source distribution hold."""

from __future__ import annotations

import re
import subprocess
import tarfile
import tomllib
import zipfile
from pathlib import Path, PurePosixPath

import pytest
from hatchling.builders.sdist import SdistBuilder
from hatchling.builders.wheel import WheelBuilder

import bellcrank

ROOT = Path(__file__).parents[2]
LARGEST = {"wheel": 6_000_000, "sdist": 15_000_000}
"""Bytes; the wheel's are mostly a network and a library."""
REFUSE = re.compile(r"__pycache__|\.pyc$|\.pytest_cache|node_modules|docs/(run|gallery)/|/raw/")


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """Both, built from this checkout."""
    if not (ROOT / "pyproject.toml").is_file():
        pytest.skip("no checkout to build from")
    folder = str(tmp_path_factory.mktemp("dist"))
    makers = {"wheel": WheelBuilder, "sdist": SdistBuilder}
    return {
        kind: Path(next(maker(str(ROOT)).build(directory=folder, versions=["standard"])))
        for kind, maker in makers.items()
    }


def tracked(*folders: str) -> set[str]:
    """Files that git knows."""
    listed = subprocess.run(
        ["git", "ls-files", *folders], cwd=ROOT, capture_output=True, text=True, check=False
    )
    if listed.returncode:
        pytest.skip("no git, or no checkout of it")
    return {name for name in listed.stdout.splitlines() if (ROOT / name).exists()}


def names(path: Path) -> set[str]:
    if path.suffix == ".whl":
        return set(zipfile.ZipFile(path).namelist())
    with tarfile.open(path) as archive:
        return {str(PurePosixPath(*PurePosixPath(name).parts[1:])) for name in archive.getnames()}


def test_the_wheel_holds_the_package_and_nothing_else(built: dict[str, Path]) -> None:
    held = {name for name in names(built["wheel"]) if ".dist-info/" not in name}
    tasks = {name.replace("examples/tasks", "bellcrank/task/bundled") for name in
             tracked("examples/tasks")}  # fmt: skip
    assert held == {name.removeprefix("src/") for name in tracked("src")} | tasks
    assert "bellcrank/py.typed" in held
    for folder, suffix, least in (
        ("web/static", ".js", 1),
        ("machines/library", ".json", 72),
        ("machines/bundled", ".toml", 6),
        ("model/gallery", ".json", 8),
        ("task/bundled", ".toml", 12),
        ("surrogate/pretrained", ".safetensors", 1),
    ):
        found = [n for n in held if n.startswith(f"bellcrank/{folder}/") and n.endswith(suffix)]
        assert len(found) >= least, folder


def test_the_source_holds_what_is_needed_to_build_document_and_test(
    built: dict[str, Path],
) -> None:
    held = names(built["sdist"])
    needed = tracked(
        "src", "tests", "docs", "examples", "benchmarks", "web", "README.md", "LICENSE"
    )
    assert needed <= held
    assert {"CHANGELOG.md", "CITATION.cff", "CONTRIBUTING.md", "PKG-INFO"} <= held


@pytest.mark.parametrize("kind", LARGEST)
def test_no_caches_and_no_bulk(built: dict[str, Path], kind: str) -> None:
    assert [name for name in names(built[kind]) if REFUSE.search(name)] == []
    assert built[kind].stat().st_size < LARGEST[kind]


def test_metadata_of_the_wheel(built: dict[str, Path]) -> None:
    with zipfile.ZipFile(built["wheel"]) as wheel:
        folder = next(name for name in wheel.namelist() if name.endswith("/METADATA"))
        told = wheel.read(folder).decode()
        entry = wheel.read(folder.replace("METADATA", "entry_points.txt")).decode()
        assert folder.replace("METADATA", "licenses/LICENSE") in wheel.namelist()
    assert f"\nVersion: {bellcrank.__version__}\n" in told
    assert "\nLicense-Expression: MIT\n" in told
    assert "bellcrank = bellcrank.cli:main" in entry


def test_there_is_one_version() -> None:
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    assert settings["project"]["dynamic"] == ["version"]
    cited = re.search(r"^version: (.+)$", (ROOT / "CITATION.cff").read_text(), re.MULTILINE)
    changed = re.search(r"^## (\d\S*)", (ROOT / "CHANGELOG.md").read_text(), re.MULTILINE)
    assert cited is not None
    assert changed is not None
    assert {cited[1], changed[1]} == {bellcrank.__version__}
