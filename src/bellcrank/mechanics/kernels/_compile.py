"""One way to compile a kernel, and a cache folder that cannot go stale.

numba keys its on-disk cache by the file of the compiled function alone: when a
callee in another file changes, the caller's old machine code is used without a
word. The cache folder is therefore named by a hash of the sources of all
kernels, of the package version and of the versions of numba and Python: any
change means a new folder, and old folders are cleared away.
"""

from __future__ import annotations

import hashlib
import os
import shutil
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar, cast

import numba

from bellcrank import __version__

F = TypeVar("F", bound=Callable[..., Any])

KEPT_CACHES = 4


def _source_hash() -> str:
    digest = hashlib.sha256(f"{__version__} {numba.__version__} {sys.version}".encode())
    package = Path(__file__).resolve().parents[2]
    for path in sorted(package.rglob("kernels/*.py")):
        digest.update(str(path.relative_to(package)).encode())
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


def _usable(folder: Path) -> bool:
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return True
    except OSError:
        return False


def _cache_folder() -> Path:
    base = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    candidates = [base / "bellcrank", Path(tempfile.gettempdir()) / f"bellcrank-{os.getuid()}"]
    if chosen := os.environ.get("BELLCRANK_CACHE"):
        candidates.insert(0, Path(chosen))
    for candidate in candidates:
        folder = candidate / "kernels" / _source_hash()
        if _usable(folder):
            _forget_old_caches(folder)
            return folder
    return Path(tempfile.mkdtemp(prefix="bellcrank-"))


def _forget_old_caches(current: Path) -> None:
    """Remove all but the most recently used caches; another process may do the same."""
    try:
        others = [folder for folder in current.parent.iterdir() if folder != current]
        others.sort(key=lambda folder: folder.stat().st_mtime, reverse=True)
        for folder in others[KEPT_CACHES:]:
            shutil.rmtree(folder, ignore_errors=True)
    except OSError:
        return


CACHE_FOLDER = _cache_folder()


def _compile(function: F, **options: Any) -> F:
    """Compile with numba: cached on disk, without the interpreter lock.

    Strict floating point (no re-association, no contraction), so that the same
    machine always gives the same bits; divisions follow IEEE 754 instead of raising.
    Kernels allocate nothing, so numba's counting of references, a sixth of the
    compilation, is left out.
    """
    config: Any = numba.config
    options["_nrt"] = False
    before = config.CACHE_DIR
    config.CACHE_DIR = str(CACHE_FOLDER)
    try:
        compiler = numba.njit(cache=True, nogil=True, error_model="numpy", **options)
        return cast("F", compiler(function))
    finally:
        config.CACHE_DIR = before


def kernel(function: F) -> F:
    """Compile a function that only other kernels call.

    It gets no wrapper for calls from Python: unpacking sixty arrays a call would
    take a third of the compilation.
    """
    return _compile(function, no_cpython_wrapper=True, no_cfunc_wrapper=True)


def inlined(function: F) -> F:
    """Compile a function as part of each kernel that calls it, not by itself.

    For outer layers: numba optimises everything below a kernel again at each level.
    """
    return _compile(function, inline="always", no_cpython_wrapper=True, no_cfunc_wrapper=True)


def entry(function: F) -> F:
    """Compile a function that Python calls."""
    return _compile(function, no_cfunc_wrapper=True)


def kernels_are_compiled() -> bool:
    """Whether an earlier process on this machine left compiled kernels behind."""
    return any(CACHE_FOLDER.rglob("*.nbc"))
