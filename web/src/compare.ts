// Designs side by side: their motions, figures and items.

import { post, type PartFigures, type PartReport, type ServerError } from "./api";
import { clear, h } from "./dom";
import { Player } from "./player";
import { designSubject, partOf, type Subject } from "./result";
import { figureTable, itemTable, verdictOf } from "./specification";
import { sentence } from "./text";

export class ComparePage {
  readonly element = h("div", { class: "page wide compare" });
  private readonly players: Player[] = [];

  private constructor(private readonly subjects: Subject[]) {}

  /** Open the page of designs given by sources and keys in turn. */
  static async open(parts: string[]): Promise<ComparePage> {
    const pairs = Array.from({ length: Math.floor(parts.length / 2) }, (_, k) => [parts[2 * k]!, parts[2 * k + 1]!] as const);
    const page = new ComparePage(await Promise.all(pairs.map(([source, key]) => designSubject(source, key))));
    page.layOut();
    return page;
  }

  close(): void { this.players.forEach((player) => player.close()); }

  private layOut(): void {
    const table = h("section", { class: "card" });
    this.element.append(
      h("div", { class: "intro" }, h("h1", {}, "Comparison"), h("p", {}, "Figures of the parts, by frames with 8 elements in each strut.")),
      h("div", { class: "pair" }, ...this.subjects.map((subject) => {
        const player = new Player(subject.problem, subject.mask, partOf(subject).scale);
        this.players.push(player);
        const verdict = h("p", { class: "verdict" });
        const items = h("div", { class: "report", tabindex: 0, role: "region", "aria-label": `Specification of ${subject.title}` });
        const trouble = h("p", { class: "fault", role: "alert" });
        player.onError = (text) => { trouble.textContent = text; };
        subject.show = (report) => {
          const found = report.items.frames;
          verdict.className = `verdict ${found === null ? "none" : found.every(({ met }) => met) ? "met" : "missed"}`;
          clear(verdict, found ? `${verdictOf(found)}.` : report.specified ? "The path is not stable." : "No specification.");
          clear(items, found && itemTable([{ title: "frames", items: found }]));
        };
        return h("section", { class: "stage", "aria-label": subject.title }, h("h2", {}, subject.title), subject.note && h("p", { class: "note content" }, sentence(subject.note)), player.element, h("div", { class: "content" }, verdict, items, trouble));
      })),
      table);
    void this.load(table);
  }

  private async load(table: HTMLElement): Promise<void> {
    const shown: { title: string; row: PartFigures }[] = [];
    for (const subject of this.subjects) {
      try {
        const report = await post<PartReport>("/report", { problem: subject.problem, mask: subject.mask, part: partOf(subject) });
        subject.show?.(report);
        shown.push(...report.figures.map((row) => ({ title: `${subject.title}${report.figures.length > 1 ? `: ${row.case}, ${row.output}` : ""}`, row })));
      } catch (error) {
        clear(table, h("p", { class: "fault", role: "alert" }, sentence((error as ServerError).message)));
        return;
      }
    }
    clear(table, figureTable(shown.map(({ row }) => row), shown.map(({ title }) => title)));
  }
}
