// Designs side by side: their motions, figures and items.

import { post, type PartReport, type ServerError } from "./api";
import { clear, h } from "./dom";
import { Player } from "./player";
import { designSubject, partOf, type Subject } from "./result";
import { figureColumns, figureTable, type FigureColumn, itemTable, verdictOf } from "./specification";
import { sentence } from "./text";

/** One of the compared designs. */
class Side {
  readonly player: Player;
  readonly element: HTMLElement;
  private readonly verdict = h("p", { class: "verdict" });
  private readonly items: HTMLElement;

  constructor(readonly subject: Subject) {
    const { title, note, problem, mask } = subject;
    const trouble = h("p", { class: "fault", role: "alert" });
    this.player = new Player(problem, mask, partOf(subject).scale);
    this.player.onError = (text) => { trouble.textContent = text; };
    this.items = h("div", { class: "report", tabindex: 0, role: "region", "aria-label": `Specification of ${title}` });
    this.element = h("section", { class: "stage", "aria-label": title }, h("h2", {}, title), note && h("p", { class: "note content" }, sentence(note)),
      this.player.element, h("div", { class: "content" }, this.verdict, this.items, trouble));
  }

  /** Compute the part, show its items and return its figures with a title each. */
  async load(): Promise<FigureColumn[]> {
    const { title, problem, mask } = this.subject;
    const { figures, items: { frames }, specified } = await post<PartReport>("/report", { problem, mask, part: partOf(this.subject) });
    this.verdict.className = `verdict ${frames === null ? "none" : frames.every(({ met }) => met) ? "met" : "missed"}`;
    clear(this.verdict, frames ? `${verdictOf(frames)}.` : specified ? "The path is not stable." : "No specification.");
    clear(this.items, frames && itemTable([{ title: "frames", items: frames }]));
    return figureColumns([[title, figures]]);
  }
}

export class ComparePage {
  readonly element = h("div", { class: "page wide compare" });
  private readonly table = h("section", { class: "card" });

  private constructor(private readonly sides: Side[]) {
    this.element.append(
      h("div", { class: "intro" }, h("h1", {}, "Comparison"), h("p", {}, "Figures of the parts, by frames with 8 elements in each strut.")),
      h("div", { class: "pair" }, ...sides.map(({ element }) => element)), this.table);
    void this.load();
  }

  /** Open the page of designs given by sources and keys in turn. */
  static async open(parts: string[]): Promise<ComparePage> {
    const pairs = Array.from({ length: Math.floor(parts.length / 2) }, (_, k) => [parts[2 * k]!, parts[2 * k + 1]!] as const);
    const subjects = await Promise.all(pairs.map(([source, key]) => designSubject(source, key)));
    return new ComparePage(subjects.map((subject) => new Side(subject)));
  }

  close(): void { this.sides.forEach(({ player }) => player.close()); }

  private async load(): Promise<void> {
    try {
      const shown = (await Promise.all(this.sides.map((side) => side.load()))).flat();
      clear(this.table, figureTable(shown));
    } catch (error) {
      clear(this.table, h("p", { class: "fault", role: "alert" }, sentence((error as ServerError).message)));
    }
  }
}
