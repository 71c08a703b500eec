"""The page "paper beside bellcrank", made of records and of nothing else.

Every figure on it comes out of a committed record through the claims of its study, so that no
sentence can say what no record shows; a test makes the page again and compares.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from reproduction.registry import studies

if TYPE_CHECKING:
    from collections.abc import Mapping

    from reproduction.registry import Claim

INTRODUCTION = """\
# The paper beside bellcrank

Bonfanti, Guerra, Font-Clos, Rayneau-Kirkhope and Zapperi, *Automatic design of mechanical
metamaterial actuators*, Nature Communications 11, 4162 (2020), claim by claim: what the paper
reports, what comes out here, the command that remakes it, and where the two differ.

This page is made from the records in `docs/studies` by `bellcrank study page --out docs/studies`;
a test compares them. Each record has the settings, figures, versions and commit; `bellcrank study
NAME` computes it again, with `--quick` for a first look, and goes on where it was stopped.

The paper's figures are known to us from its text and at second hand. A dash stands where it
gives none that we know. Efficiencies of the paper are by finite elements, confirmed by print,
unless said otherwise; nothing of ours has been printed.
"""

RUNS = 100
"""Of each size in the paper's scaling."""
NOT_REMADE = """\
## What is not remade

- Prints and measurements: there is no printer and no testing machine here. Files for printing are
  checked by reading and slicing them (`docs/fabrication.md`).
- The full training of the paper's ResNet50: 8.7 million looks need a GPU.
- Machines that combine actuators have no figure in the paper to compare with; `docs/machines.md`
  describes ours.
{scaling}"""


def page_of(records: Mapping[str, Mapping[str, Any]], pictures: str = "") -> str:
    """Return the page as Markdown.

    Parameters
    ----------
    records
        Of studies, by name.
    pictures
        Folder of the pictures, as seen from the page.
    """
    parts = [INTRODUCTION, _overview(records)]
    parts += [_section(record, pictures) for record in records.values()]
    runs = records["scaling"]["figures"]["runs"] if "scaling" in records else [RUNS]
    fewer = (
        f"- All of the {RUNS} runs of each size in the paper's scaling: there are "
        f"{', '.join(map(str, runs))}, from the smallest size to the largest.\n"
    )
    return "\n".join([*parts, NOT_REMADE.format(scaling=fewer if min(runs) < RUNS else "")])


def _overview(records: Mapping[str, Mapping[str, Any]]) -> str:
    lines = ["| study | remakes | how much was computed | command |", "|---|---|---|---|"]
    for name, record in records.items():
        study = studies[name]
        lines.append(
            f"| [{name}](#{name}) | {study.after} | {record['mode']}: "
            f"{study.runs(record['figures'])} | `bellcrank study {name}` |"
        )
    return "\n".join(lines) + "\n"


def _section(record: Mapping[str, Any], pictures: str) -> str:
    """Return what the page says of one study."""
    study = studies[str(record["study"])]
    origin = record["provenance"]
    lines = [
        f"## {study.name}",
        "",
        (
            f"{study.title} ({study.after}). `{record['command']}`, {record['mode']} mode, "
            f"{study.runs(record['figures'])}; version {origin['version']}, commit "
            f"{str(origin['commit'])[:7]}, {str(origin['time'])[:10]}."
        ),
        "",
        f"![{study.title}]({pictures}{study.name}.png)",
        "",
        "| claim | the paper | bellcrank | remarks |",
        "|---|---|---|---|",
        *(_row(claim) for claim in study.claims(record["figures"])),
        "",
    ]
    if study.deviations:
        lines += ["Where this differs from what the paper did:", ""]
        lines += [f"- {words}" for words in study.deviations]
        lines.append("")
    return "\n".join(lines)


def _row(claim: Claim) -> str:
    cells = (claim.what, claim.paper or "–", claim.ours, claim.note)
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"
