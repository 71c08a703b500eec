from __future__ import annotations

import subprocess
import sys


def test_the_model_is_imported_without_heavy_libraries():
    code = (
        "import sys, bellcrank.model; "
        "print(*{'scipy', 'numba', 'matplotlib', 'pyarrow'} & set(sys.modules))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == ""
