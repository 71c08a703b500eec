"""Check that code and documentation use the vocabulary of docs/glossary.md.

Two lists: words that occur nowhere, and words that are no name of a module, class, function,
parameter, attribute or variable although prose may use them. Run in the root of the repository:

    python tools/check_words.py
"""

from __future__ import annotations

import ast
import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]

WORDS = {
    r"foretell\w*|foretold": "predict, prediction",
    r"foresee\w*|foreseen": "predict, predicted",
    r"heard": "name the record: prediction_log",
    r"shelf|shelves": "cache, collection",
    r"told": "name the content",
    r"warmth": "temperature_factor",
    r"thinnest": "min_density",
    r"harvest\w*": "results",
    r"comes? along|coming along|came along": "bundled",
    r"last word": "name the method that decides",
    r"in vain": "without improvement",
    r"dangling": "unloaded beams",
    r"wanders?|wandering": "Metropolis phase",
    r"Confirmer": "surrogate_transition",
    r"respond_nearby": "evaluate(warm_start=True)",
    r"Workshop|Complaint": "AppState, ErrorResponse",
    r"--caution|--beside": "--uncertainty-penalty, --compare",
}
"""Regular expressions of words that occur nowhere, with what replaces them."""

NAMES = {
    "standing": "part_model", "stand": "part_model", "felt": "PortResponse", "feel": "linearize",
    "chaining": "prediction", "unite": "merge_nodes", "union": "merge_nodes",
    "straight": "LinearResponse", "stretches": "surrogate_transition",
    "course": "settings of active learning", "knowledge": "state of active learning",
    "lesson": "state of active learning", "driving": "surrogate_search",
    "driven": "surrogate_search", "finding": "surrogate_search", "place": "EvaluatedDesign",
    "kept": "EliteArchive", "walking": "metropolis_phase", "walker": "metropolis_phase",
    "kick": "perturbation", "remember": "set_reference", "screening": "flip_prediction",
    "excess": "violation", "term": "Constraint", "price": "evaluation_cost",
    "careful": "VERIFICATION_INCREMENT", "hope": "MAX_RESIDUAL_INCREASES", "firm": "nonsingular",
    "pull": "load_derivative", "rings": "incident_beams", "choosing": "candidate_ranking",
    "trial": "CandidateAnalysis", "seeing": "attribution", "longer": "training_records",
    "words": "formatting", "duels": "comparisons", "beginning": "training_setup",
    "feeding": "input_pipeline", "relaxing": "differentiable_views", "shop": "AppState",
    "caution": "uncertainty_penalty", "beside": "compare",
}  # fmt: skip
"""Lower-case names that are not used, with what replaces them."""

READ_BY_PEOPLE = ("src/*.py", "src/*.toml", "reproduction/*.py", "benchmarks/*.py", "web/src/*",
                  "docs/*.md", "docs/*.py", "examples/*.py", "README.md")  # fmt: skip
EXCEPT = {"docs/changelog.md"}


def tracked(*patterns: str) -> list[Path]:
    """Return the files of the repository that match patterns of git."""
    listed = subprocess.run(
        ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard", *patterns],
        cwd=ROOT, capture_output=True, check=True, text=True,
    )  # fmt: skip
    return [ROOT / name for name in listed.stdout.split("\0") if name and name not in EXCEPT]


def names_of(tree: ast.AST) -> list[tuple[int, str]]:
    """Return line and spelling of each name that a module defines."""
    found = []
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
            found.append((node.lineno, node.name))
        elif isinstance(node, ast.arg):
            found.append((node.lineno, node.arg))
        elif isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            found.append((node.lineno, node.id))
        elif isinstance(node, ast.Attribute) and isinstance(node.ctx, ast.Store):
            found.append((node.lineno, node.attr))
    return found


def defects() -> list[str]:
    """Return a line for each word or name that is not used here."""
    found = []
    for path in tracked(*READ_BY_PEOPLE):
        where = path.relative_to(ROOT)
        text = path.read_text(encoding="utf-8")
        for number, line in enumerate(text.splitlines(), 1):
            for pattern, instead in WORDS.items():
                if match := re.search(rf"(?<![\w-])(?:{pattern})(?!\w)", line, re.IGNORECASE):
                    found.append(f"{where}:{number}: {match[0]!r}: {instead}")
        if path.stem.lower() in NAMES:
            found.append(f"{where}: name of the file: {NAMES[path.stem.lower()]}")
        if path.suffix == ".py":
            for number, name in names_of(ast.parse(text)):
                if (instead := NAMES.get(name.strip("_").lower())) is not None:
                    found.append(f"{where}:{number}: name {name!r}: {instead}")
    return found


if __name__ == "__main__":
    lines = defects()
    print("\n".join(lines))
    sys.exit(1 if lines else 0)
