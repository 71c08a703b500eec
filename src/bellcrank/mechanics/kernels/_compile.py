"""Compilation of kernels by numba: deferred to the first call, and cached on disk.

numba names its cache files after the file of the compiled function alone: when a callee in
another file changes, outdated machine code of the caller is used. The cache folder is therefore
named by a hash of the sources of all kernels, of the package version and of the versions of
numba and Python. Any change leads to a new folder; old folders are removed.

numba takes a third of a second to import, which commands that only refuse their input need not
spend. The decorators below therefore return a `_Deferred` function; the first call imports numba
and replaces all of them in the modules of the kernels by compiled functions.
"""

from __future__ import annotations

import hashlib
import importlib.metadata
import os
import shutil
import sys
import tempfile
import threading
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar, cast

from bellcrank import __version__

if TYPE_CHECKING:
    from types import FunctionType

F = TypeVar("F", bound=Callable[..., Any])

MAX_CACHES = 4
"""Number of old cache folders that are left in place."""


def _source_hash() -> str:
    numba_version = importlib.metadata.version("numba")
    digest = hashlib.sha256(f"{__version__} {numba_version} {sys.version}".encode())
    package = Path(__file__).resolve().parents[2]
    for path in sorted(package.rglob("kernels/*.py")):
        digest.update(str(path.relative_to(package)).encode())
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


def _is_writable(folder: Path) -> bool:
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return True
    except OSError:
        return False


@cache
def cache_folder() -> Path:
    """Return the folder of the compiled kernels, and create it if it is missing."""
    base = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    candidates = [base / "bellcrank", Path(tempfile.gettempdir()) / f"bellcrank-{os.getuid()}"]
    if chosen := os.environ.get("BELLCRANK_CACHE"):
        candidates.insert(0, Path(chosen))
    for candidate in candidates:
        folder = candidate / "kernels" / _source_hash()
        if _is_writable(folder):
            _remove_old_caches(folder)
            return folder
    return Path(tempfile.mkdtemp(prefix="bellcrank-"))


def _remove_old_caches(current: Path) -> None:
    """Remove all but the most recently used caches; another process may do the same."""
    try:
        others = [folder for folder in current.parent.iterdir() if folder != current]
        others.sort(key=lambda folder: folder.stat().st_mtime, reverse=True)
        for folder in others[MAX_CACHES:]:
            shutil.rmtree(folder, ignore_errors=True)
    except OSError:
        return


_lock = threading.RLock()
_pending: list[_Deferred] = []


class _Deferred:
    """A function that is compiled, together with all others, when one of them is called.

    Parameters
    ----------
    function
        Python function of a module.
    options
        Of `numba.njit`; None for an intrinsic, a function that generates machine code.
    """

    def __init__(self, function: FunctionType, options: dict[str, Any] | None) -> None:
        self.function = function
        self.options = options
        self.compiled: Callable[..., Any] | None = None
        self.__doc__ = function.__doc__
        with _lock:
            _pending.append(self)

    def __call__(self, *args: Any) -> Any:
        """Call the compiled function."""
        if self.compiled is None:
            _compile_pending()
        return self.compiled(*args)  # type: ignore[misc]


def _compile_pending() -> None:
    """Create the compiled function of each pending one, and enter it into the kernel modules.

    numba looks up the names that a kernel uses in the globals of its module when it compiles the
    kernel, and expects compiled functions there.
    """
    with _lock:
        if not _pending:
            return
        compiled = {each: _compiled(each) for each in _pending}
        modules = {id(each.function.__globals__): each.function.__globals__ for each in _pending}
        for namespace in modules.values():
            for name, value in list(namespace.items()):
                if isinstance(value, _Deferred):
                    namespace[name] = compiled.get(value, value.compiled)
        for each in _pending:  # other threads call it from here on
            each.compiled = compiled[each]
        _pending.clear()


def _compiled(deferred: _Deferred) -> Callable[..., Any]:
    """Return the compiled function: cached on disk, without the interpreter lock.

    Strict floating point (no re-association, no contraction), so that the same machine always
    gives the same bits; divisions follow IEEE 754 instead of raising. Kernels allocate nothing,
    so numba's reference counting, a sixth of the compilation time, is omitted.
    """
    import numba
    from numba.extending import intrinsic as make_intrinsic

    if deferred.options is None:
        return cast("Callable[..., Any]", make_intrinsic(deferred.function))
    config: Any = numba.config
    before = config.CACHE_DIR
    config.CACHE_DIR = str(cache_folder())
    try:
        options: dict[str, Any] = {**deferred.options, "error_model": "numpy", "_nrt": False}
        compiler = numba.njit(cache=True, nogil=True, **options)
        return cast("Callable[..., Any]", compiler(deferred.function))
    finally:
        config.CACHE_DIR = before


def _defer(function: F, options: dict[str, Any] | None) -> F:
    return cast("F", _Deferred(cast("FunctionType", function), options))


def kernel(function: F) -> F:
    """Compile a function that only other kernels call.

    It gets no wrapper for calls from Python, which would only take time to compile.
    """
    return cast(
        "F",
        _Deferred(
            cast("FunctionType", function), {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}
        ),
    )


def inlined(function: F) -> F:
    """Compile a function as part of each kernel that calls it, not by itself.

    For outer layers: numba optimises everything below a kernel again at each level.
    """
    options = {"inline": "always", "no_cpython_wrapper": True, "no_cfunc_wrapper": True}
    return _defer(function, options)


def entry(function: F) -> F:
    """Compile a function that Python calls."""
    return _defer(function, {"no_cfunc_wrapper": True})


def intrinsic(function: F) -> F:
    """Define a function that generates machine code, by numba's protocol."""
    return _defer(function, None)


def compile_for(function: Callable[..., Any], *arguments: object) -> None:
    """Compile a kernel for the types of its arguments, and store it on disk, without a call."""
    import numba

    _compile_pending()
    compiled: Any = function.compiled if isinstance(function, _Deferred) else function
    compiled.compile(tuple(numba.typeof(each) for each in arguments))


def kernels_are_compiled() -> bool:
    """Return whether an earlier process on this machine has compiled the kernels."""
    return any(cache_folder().rglob("*.nbc"))
