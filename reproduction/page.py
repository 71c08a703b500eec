"""The page that compares bellcrank with the paper, generated from the records.

All figures on the page come from committed records through the claims of their studies. A test
generates the page again and compares it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from reproduction.registry import studies

if TYPE_CHECKING:
    from collections.abc import Mapping

    from reproduction.registry import Claim

INTRODUCTION = """\
# Comparison with the paper

This page compares bellcrank with Bonfanti, Guerra, Font-Clos, Rayneau-Kirkhope and Zapperi,
*Automatic design of mechanical metamaterial actuators*, Nature Communications 11, 4162 (2020).
Each section gives the values of the paper, the values computed here, the command that reproduces
them, and the differences in procedure.

The page is generated from the records in `docs/studies` by `bellcrank study page --out
docs/studies`; a test checks that they agree. Each record contains settings, figures, versions
and commit. `bellcrank study NAME` computes a study again and resumes an interrupted run; the
option `--quick` reduces the computation. The command needs a checkout of the repository.

The paper's values are taken from its text and from secondary sources. A dash means that we know
of no value. Efficiencies of the paper are from finite elements and confirmed by prints unless
noted. None of our designs has been printed.
"""

PAGE = "paper"
"""Name of this page."""
RUNS = 100
"""Runs of each size in the scaling study of the paper."""
NOT_REPRODUCED = """\
## Parts that are not reproduced

- Prints and measurements: no printer and no testing machine were available. Files for printing
  are checked by reading and slicing them (`docs/fabrication.md`). The models are compared with a
  lattice that others printed and measured ([a measured lattice](measured.md)).
- The full training of the paper's ResNet50: 8.7 million training samples require a GPU.
- Machines that combine actuators: the paper reports no values; `docs/machines.md` describes
  ours.
{scaling}"""


def page_of(records: Mapping[str, Mapping[str, Any]], pictures: str = "") -> str:
    """Return the page as Markdown.

    Parameters
    ----------
    records
        Records of studies by name; those of other pages are left out.
    pictures
        Path of the pictures relative to the page.
    """
    records = {name: record for name, record in records.items() if studies[name].page == PAGE}
    parts = [INTRODUCTION, _overview(records)]
    parts += [_section(record, pictures) for record in records.values()]
    runs = records["scaling"]["figures"]["runs"] if "scaling" in records else [RUNS]
    fewer = (
        f"- {RUNS} runs of each size in the scaling study: the numbers here are "
        f"{', '.join(map(str, runs))}, from the smallest to the largest size.\n"
    )
    return "\n".join([*parts, NOT_REPRODUCED.format(scaling=fewer if min(runs) < RUNS else "")])


def _overview(records: Mapping[str, Mapping[str, Any]]) -> str:
    lines = ["| study | part of the paper | computed | command |", "|---|---|---|---|"]
    for name, record in records.items():
        study = studies[name]
        lines.append(
            f"| [{name}](#{name}) | {study.after} | {record['mode']}: "
            f"{study.runs(record['figures'])} | `bellcrank study {name}` |"
        )
    return "\n".join(lines) + "\n"


def _section(record: Mapping[str, Any], pictures: str) -> str:
    """Return the section of one study."""
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
        "| quantity | paper | bellcrank | remarks |",
        "|---|---|---|---|",
        *(_row(claim) for claim in study.claims(record["figures"])),
        "",
    ]
    if study.deviations:
        lines += ["Differences from the procedure of the paper:", ""]
        lines += [f"- {sentence}" for sentence in study.deviations]
        lines.append("")
    return "\n".join(lines)


def _row(claim: Claim) -> str:
    cells = (claim.what, claim.paper or "–", claim.ours, claim.note)
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"
