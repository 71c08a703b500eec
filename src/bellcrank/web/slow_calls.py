"""Slow computations for the page: files, movies, finite elements, machines.

Arguments and results are plain data.
"""

from __future__ import annotations

import json
import math
from dataclasses import replace
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any
from zipfile import ZIP_DEFLATED, ZipFile

import numpy as np

from bellcrank.errors import InvalidFile, InvalidSettings
from bellcrank.fem.results import finite
from bellcrank.model import problem_to_dict, write_design
from bellcrank.web.items import item_states
from bellcrank.web.quick_calls import design_of
from bellcrank.web.share_file import ShareFile

if TYPE_CHECKING:
    from collections.abc import Callable

    from bellcrank.model import Design
    from bellcrank.part import PartSpec
    from bellcrank.workflows.fabricate import Grips

MOVIE_SECONDS = 4.0
MOVIE_SIZE = (1280, 720)
GIF_SIZE = (720, 404)
GIF_FPS = 20
BODIES = {"plane": "sheet", "solid": "solid"}
"""Names of the models of the printed body in which a specification is computed, by level."""
DRAWN_SAGITTA = 0.05
"""Largest distance of a drawn outline from its arcs, mm."""
MAX_VERTICES = 60_000
"""Largest number of vertices of a picture of stress."""


def design_file(
    text: str,
    mask: str,
    suffix: str,
    part: dict[str, Any],
    about: dict[str, Any],
    grips: dict[str, Any],
) -> bytes:
    """Return the content of a file of a design.

    Parameters
    ----------
    suffix
        A name in `bellcrank.web.page_files.page_files`, with a dot.
    part
        Dimensions and material, as `PartSpec.from_dict` reads them.
    about
        Efficiency and provenance, if known.
    grips
        Arguments of `bellcrank.workflows.fabricate.Grips`.
    """
    from bellcrank.part import PartSpec
    from bellcrank.workflows.fabricate import Grips

    design = replace(
        design_of(text, mask),
        efficiency=about.get("efficiency"),
        provenance=about.get("provenance") or {},
    )
    spec = PartSpec.from_dict(part)
    export = partial(_export, grips=Grips(**grips))
    archive = partial(_archive, grips=grips)
    makers: dict[str, Callable[[Design, PartSpec, Path], None]] = {
        ".json": _json, ".mp4": _movie, ".gif": _movie, ".pdf": _card, ".zip": archive
    }  # fmt: skip
    with TemporaryDirectory(prefix="bellcrank-") as folder:
        path = Path(folder) / f"part{suffix}"
        try:
            makers.get(suffix, export)(design, spec, path)
        except InvalidSettings as error:
            raise InvalidSettings(str(error).removeprefix(f"{path}: ")) from None
        return path.read_bytes()


def _archive(design: Design, spec: PartSpec, path: Path, grips: dict[str, Any]) -> None:
    """Write all other files into one archive."""
    from bellcrank.web.page_files import page_files

    text = json.dumps(problem_to_dict(design.problem))
    about = {"efficiency": design.efficiency, "provenance": dict(design.provenance)}
    with ZipFile(path, "w", ZIP_DEFLATED) as archive:
        for suffix, file in page_files.items():
            if suffix != "zip" and (design.problem.lattice.dimension == 2 or file.in_space):
                content = design_file(
                    text, design.mask_hex, f".{suffix}", spec.to_dict(), about, grips
                )
                archive.writestr(f"part.{suffix}", content)


def _json(design: Design, spec: PartSpec, path: Path) -> None:
    with_part = replace(design, provenance={**design.provenance, "part": spec.to_dict()})
    write_design(with_part, path)


def _movie(design: Design, _spec: PartSpec, path: Path) -> None:
    from bellcrank.plots.movies import movie_settings
    from bellcrank.workflows.animate import animate_motion

    gif = path.suffix == ".gif"
    settings = movie_settings(
        path, MOVIE_SECONDS, GIF_FPS if gif else None, GIF_SIZE if gif else MOVIE_SIZE
    )
    animate_motion([(design.problem.name, design)], path, settings)


def _card(design: Design, spec: PartSpec, path: Path) -> None:
    from bellcrank.workflows.card import make_card

    make_card(design, spec, path)


def _export(design: Design, spec: PartSpec, path: Path, grips: Grips) -> None:
    from bellcrank.export import export
    from bellcrank.export.formats.base import LAYER
    from bellcrank.workflows.fabricate import bundle_of

    export(bundle_of(design, spec, grips, layer=LAYER), path)


def part_summary(
    text: str, mask: str, part: dict[str, Any], grips: dict[str, Any] | None = None
) -> dict[str, Any]:
    """Return size, mass and stroke of a part, and remarks on its printability.

    Parameters
    ----------
    grips
        Arguments of `bellcrank.workflows.fabricate.Grips`: additions to the part.

    Returns
    -------
    dict
        Lengths in mm, ``volume`` in cm³, ``mass`` in g; ``swept``, the box that holds the part
        along the stroke; ``screws``, the centres of screw holes in the coordinates of the files;
        ``outline``, the loops of the outline in the same coordinates if there are additions,
        those of screw holes last.
    """
    from bellcrank.part import PartSpec
    from bellcrank.workflows.fabricate import (
        Grips,
        bundle_of,
        contacts_of,
        print_warnings,
        profile_for,
        size_and_volume,
        stroke_of,
        swept_size,
    )

    spec = PartSpec.from_dict(part)
    added = Grips(**(grips or {}))
    bundle = bundle_of(design_of(text, mask), spec, added, layer=0.32)
    size, volume = size_and_volume(bundle)
    holes = () if bundle.shape is None else bundle.shape.holes
    loops = bundle.shape.loops if bundle.shape is not None and added != Grips() else ()
    # Those of screws are the last ones.
    screws = [hole.points.mean(axis=0) for hole in holes[len(holes) - added.screws :]]
    stroke = stroke_of(bundle.part)
    contacts = contacts_of(bundle.part, stroke)
    mass = volume * bundle.part.material.density / 1000.0
    return {
        "size": [round(length, 3) for length in size],
        "swept": [round(length, 1) for length in swept_size(bundle, stroke)],
        "volume": round(volume / 1000.0, 3),
        "mass": round(mass, 2) if math.isfinite(mass) else None,
        "stroke": bundle.part.stroke if math.isfinite(bundle.part.stroke) else None,
        "remarks": print_warnings(bundle, profile_for(_profile_name(spec), spec), contacts),
        "touching": np.unique(contacts.pairs).tolist(),
        "screws": sorted(centre.round(2).tolist() for centre in screws),
        "outline": [loop.flattened(DRAWN_SAGITTA).round(2).tolist() for loop in loops],
    }


def _profile_name(spec: PartSpec) -> str:
    """Return the print profile of a material; for others that of the usual material."""
    from bellcrank.export.profiles import profiles
    from bellcrank.part import PartSpec

    name = spec.registered_material.name
    return name if name in profiles else str(PartSpec().material)


def print_estimate(text: str, mask: str, part: dict[str, Any]) -> dict[str, Any]:
    """Return printing time, layers and mass of a part by the slicer, with the usual profile.

    Raises
    ------
    InvalidSettings
        If there is no slicer.
    """
    from bellcrank.part import PartSpec
    from bellcrank.workflows.fabricate import Grips, bundle_of, print_design, profile_for

    spec = PartSpec.from_dict(part)
    profile = profile_for(None, spec)
    bundle = bundle_of(design_of(text, mask), spec, Grips(), layer=profile.layer)
    with TemporaryDirectory(prefix="bellcrank-") as folder:
        job = print_design(bundle, profile, Path(folder) / "part.gcode")
    deposit = job.sliced.deposit
    return {
        "minutes": finite(deposit.seconds / 60.0),
        "layers": deposit.layers,
        "layer_mm": profile.layer,
        "mass": finite(job.mass),
        "slicer": job.sliced.slicer,
        "profile": profile.name,
    }


def tolerance(text: str, mask: str, part: dict[str, Any], share: str = "") -> dict[str, Any]:
    """Return what a design does as a part in scenarios of tolerance, with the usual deviations.

    Parameters
    ----------
    share
        File for the fraction of the scenarios that is computed; empty for none.

    Returns
    -------
    dict
        ``sentence`` on the scenarios; ``rows`` of texts, the first with the names of the columns;
        ``met``, the number of random ``prints`` that meet all items, or what ``met_words`` say;
        ``losses``, the part of the ``measure``, efficiency or rotation, that the loss of each strut
        costs: ``beams``, and ``cost``, None where the full stroke is not reached.
    """
    from bellcrank.part import PartSpec
    from bellcrank.workflows.tolerance import (
        compute_tolerance,
        deviation_words,
        deviations_of,
        met_words,
        tolerance_rows,
        tolerance_sentence,
    )

    spec, design = PartSpec.from_dict(part), design_of(text, mask)
    write = ShareFile(share)
    report = compute_tolerance(
        design,
        deviations_of(design, spec),
        spec,
        lambda done, total: write(done / total),
        workers=1,
    )
    assert report is not None  # without a request to stop
    losses, prints = report.tolerance.strut_losses(), report.tolerance.of_kind("print")
    return {
        "sentence": tolerance_sentence(report),
        "prints": len(prints),
        "met": sum(report.tolerance.results[number].met for number in prints),
        "met_words": met_words(report),
        "deviations": deviation_words(report.deviations),
        "rows": tolerance_rows(report),
        "losses": {
            "measure": report.tolerance.measure,
            "beams": list(losses),
            "cost": [finite(each) for each in losses.values()],
        },
    }


def validation(
    text: str, mask: str, part: dict[str, Any], level: str, share: str = ""
) -> dict[str, Any]:
    """Analyse a design as a part by finite elements.

    Parameters
    ----------
    share
        File for the fraction of the analysis that is done; empty for none.

    Returns
    -------
    dict
        Results of one level, and ``picture``: deformed struts or triangles, in mm, with their
        stress; in the sheet, and in the solid of a part in space, also ``items``, those of the
        specification, and ``figures`` of each output, None without a stable path.
    """
    from bellcrank.fem import FemSettings
    from bellcrank.part import PartSpec
    from bellcrank.workflows import validate

    spec, design = PartSpec.from_dict(part), design_of(text, mask)
    # The specification is that of the part that is shown.
    design = replace(design, provenance={"part": part})
    # The first path is that of the analysis; the items need others, which take as long.
    paths, write = (1, _item_paths(design, spec, level)), ShareFile(share)
    validation = validate(
        design,
        spec,
        [(level, FemSettings())],
        lambda index, done: write((index + done * paths[index]) / sum(paths)),
    )
    analysis = validation.analyses[0]
    data: dict[str, Any] = validation.to_dict()["results"][0]
    field = analysis.field
    picture = None
    if len(field.rest) <= MAX_VERTICES and field.rest.shape[1] == 2:
        picture = {
            "points": (field.rest + field.displacement).round(3).ravel().tolist(),
            "cells": field.cells.ravel().tolist(),
            "corners": int(field.cells.shape[1]),
            "stress": [float(f"{each:.4g}") for each in field.stress.tolist()],
        }
    keys = (
        "level", "theory", "status", "stable", "reached", "efficiency", "von_mises_MPa",
        "principal_strain", "input_force_N", "input_push_N", "mean_output_displacement_mm",
        "off_axis", "output_rotation_deg",
        "warnings", "discrete_model",
    )  # fmt: skip
    results = validation.items.get(BODIES.get(level, ""))
    items = None if results is None else item_states(design.problem, spec, results)
    return {
        **{key: data[key] for key in keys},
        "doubts": validation.doubts,
        "picture": picture,
        "items": items,
        "figures": validation.figures.get(BODIES.get(level, "")),
    }


def _item_paths(design: Design, spec: PartSpec, level: str) -> int:
    """Return the number of paths that the items of a specification need at a level."""
    from bellcrank.workflows.validation import BODY_LEVELS, has_items

    problem = design.problem
    if not has_items(design, spec) or level != BODY_LEVELS[problem.lattice.dimension][0]:
        return 0
    from bellcrank.fem.specification import path_count

    return sum(path_count(problem, case) for case in problem.cases)


def machine(plan: dict[str, Any], designs: dict[str, str]) -> dict[str, Any]:
    """Assemble a machine.

    Parameters
    ----------
    plan
        Plan with the keys of the TOML files of `bellcrank.machines.plan`.
    designs
        Design of each entry in the plan: JSON text of ``problem`` and ``mask``.
    """
    from bellcrank.machines.assembly import assemble
    from bellcrank.machines.plan import MachineTable, plan_of
    from bellcrank.mechanics import VERIFICATION_INCREMENT, model_evaluator
    from bellcrank.model import problem_to_dict
    from bellcrank.model.parsing import parse
    from bellcrank.web.limits import check_size

    def find(entry: str) -> Design:
        if entry not in designs:
            raise InvalidFile(f"there is no design {entry!r} in the gallery")
        given = json.loads(designs[entry])
        return design_of(json.dumps(given["problem"]), given["mask"])

    source = "the machine"
    built = assemble(plan_of(parse(MachineTable, plan, source), source), find)
    problem = built.design.problem
    check_size(problem.lattice.node_count, problem.lattice.beam_count)
    evaluator = model_evaluator(problem)
    response = evaluator.evaluate(built.design.mask, VERIFICATION_INCREMENT)
    return {
        "problem": problem_to_dict(problem),
        "mask": built.design.mask_hex,
        "efficiency": response.efficiency if math.isfinite(response.efficiency) else None,
        "status": response.status.label,
        "message": response.status.message,
        "provenance": {**built.design.provenance, "kind": "assembled"},
        "parts": {name: beams.tolist() for name, beams in built.beams.items()},
    }
