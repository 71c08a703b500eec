"""`bellcrank onnx`: a trained network for ONNX Runtime and for other programs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from bellcrank.cli.app import app
from bellcrank.cli.console import plain, results
from bellcrank.errors import InvalidSettings


@app.command()
def onnx(
    problem: Annotated[str, typer.Argument(help="What the network has learnt.")],
    file: Annotated[Path, typer.Argument(help="A name ending in .onnx.")],
    model: Annotated[
        Path | None,
        typer.Option(
            help="A trained model, or the folder of a training. \\[that which comes with bellcrank]"
        ),
    ] = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace the file.")] = False,
) -> None:
    """Write a trained network as ONNX; `predict --model FILE.onnx` is the faster for it."""
    from bellcrank.learning.fitting import model_files
    from bellcrank.model.storage import already_exists, check_folder
    from bellcrank.surrogate.onnx import write_onnx
    from bellcrank.surrogate.predictor import load_models
    from bellcrank.workflows import find_design

    if file.suffix != ".onnx":
        raise InvalidSettings(f"{file}: expected a name ending in .onnx")
    if file.exists() and not overwrite:
        raise already_exists(file)
    check_folder(file)
    paths = model_files(model) if model else []
    if len(paths) > 1:
        raise InvalidSettings(f"{model}: holds {len(paths)} networks; name one of their folders")
    (found,) = load_models(find_design(problem).problem, paths)
    write_onnx(found, file, overwrite=overwrite)
    results.print(f"wrote {plain(file)}")
