"""The results of `bellcrank design` as tables, with warnings."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from rich.table import Table

from bellcrank.cli.console import notes, plain, results, text_grid

if TYPE_CHECKING:
    from bellcrank.workflows import DesignReport


def _warn_of_second_model(report: DesignReport) -> None:
    """Print what a refined design misses in the sheet, or in space with imperfections."""
    refinement = report.refinement
    in_plane = report.selection.design.problem.lattice.dimension == 2
    where = "in the sheet" if in_plane else "with displaced nodes and other joints"
    if refinement is None or not refinement.sheets:
        return
    if not (items := refinement.after.sheet):
        text = "is not stable along its stroke, or moves otherwise"
    elif missed := [each.item.name for each in items if not each.met]:
        text = f"misses {', '.join(missed)}"
    else:
        return
    notes.print(f"[bold yellow]warning:[/] {where} the design {text}")


def _print_conditions(report: DesignReport) -> None:
    """Print the inputs and loads with which the items of a specification hold."""
    from bellcrank.workflows.condition_texts import condition_texts

    if report.items and report.part is not None:
        conditions = condition_texts(report.selection.design.problem, report.part)
        results.print(plain(f"items with {'; '.join(conditions)}:"))


def print_report(report: DesignReport) -> None:
    """Print the results in a table, with warnings."""
    from bellcrank.workflows.refinement import refinement_text
    from bellcrank.workflows.report_tables import (
        figure_table,
        item_table,
        nearest_table,
        part_figure_table,
    )
    from bellcrank.workflows.tolerance import tolerance_rows, tolerance_sentence

    selection = report.selection
    _print_conditions(report)
    table = Table.grid(padding=(0, 2))
    shown = [item_table(report), nearest_table(report), figure_table(report)]
    for rows in (*shown, part_figure_table(report)):
        if rows:
            results.print(text_grid(rows))
            if report.part is not None:
                results.print()
    if report.tolerance is not None:
        results.print(tolerance_sentence(report.tolerance))
        results.print(text_grid(tolerance_rows(report.tolerance)))
        results.print()
    if report.refinement is not None:
        table.add_row("refined", refinement_text(report.refinement))
    table.add_row("before cleaning", f"{selection.efficiency_before:.4f}")
    table.add_row("initial design", f"{report.initial_efficiency:.4f}")
    if report.human_response is not None:
        table.add_row("human design", f"{report.human_response.efficiency:.4f}")
    if report.settings.goals:
        table.add_row("goals satisfied", plain(", ".join(report.settings.goals)))
    table.add_row("beams", f"{selection.design.beam_count}")
    unstable = [name for name, value in report.checks.items() if not math.isfinite(value)]
    compared = f"from rest in {' and '.join(report.checks)}, which differ by {report.agreement:.0e}"
    table.add_row("verified", f"not stable in {' and '.join(unstable)}" if unstable else compared)
    table.add_row("designs evaluated", f"{report.proposals}")
    table.add_row("results", plain(f"{report.folder}/"))
    results.print(table)
    _warn_of_second_model(report)
    if report.missed:
        first, *others = report.missed
        rest = f", then {', '.join(each.item.name for each in others)}" if others else ""
        notes.print(
            "[bold yellow]warning:[/] no design meets the specification; the binding item is "
            f"{plain(first.item.name)}{plain(rest)}. Relax it, use more steps (--steps) or more "
            "chains (--chains), or give the part more room: a larger domain, a smaller spacing, "
            "thinner struts."
        )
    elif report.low_yield:
        notes.print(
            f"[bold yellow]warning:[/] {report.low_yield}. Relax the items or the tolerances, use "
            "more chains (--chains), or give the part more room."
        )
    elif report.failures:
        notes.print(
            f"[bold yellow]warning:[/] no design works: {plain('; '.join(report.failures))}. "
            "Use more steps (--steps), more chains (--chains), another initial design (--from) or, "
            "for a part, other struts (--strut-width)."
        )
    if not report.verified:
        notes.print(
            "[bold yellow]warning:[/] the efficiency depends on the load increments: the design "
            "may snap."
        )
