// Designs and searches to open.

import { get, type Run, type Shelf } from "./api";
import { ago, count, figure, h } from "./dom";
import { shelfView, tile } from "./shelves";

/** Designs of a shelf before one asks for all: three rows. */
const SHOWN = 15;

export async function galleryPage(): Promise<HTMLElement> {
  const shelves = await get<Shelf[]>("/gallery");
  return h("div", { class: "page wide" },
    h("div", { class: "intro" }, h("h1", {}, "Gallery"), h("p", {}, "Open a design to see it move, to take it, or to go on from it.")),
    ...shelves.filter(({ entries }) => entries.length).map((shelf) => shelfView(shelf, (small) =>
      tile(small, small.source === "runs" ? `#/run/${small.key}` : `#/design/${small.source}/${small.key}`), SHOWN)));
}

export class RunsPage {
  readonly element = h("div", { class: "page wide" });
  private readonly list = h("ul", { class: "list" });
  private readonly timer: number;

  constructor() {
    this.element.append(h("div", { class: "intro" }, h("h1", {}, "Searches"),
      h("p", {}, "They go on when this page is closed, and are here when you come back.")), this.list);
    void this.refresh();
    this.timer = window.setInterval(() => void this.refresh(), 1000);
  }

  close(): void { clearInterval(this.timer); }

  private async refresh(): Promise<void> {
    let runs: Run[];
    try {
      runs = await get<Run[]>("/runs");
    } catch { return; }
    const focused = document.activeElement?.getAttribute("href");
    if (!runs.length) {
      this.list.replaceChildren(h("li", { class: "empty" }, "None yet. ", h("a", { href: "#/draw" }, "Draw a task"), " and press Design it."));
      return;
    }
    this.list.replaceChildren(...runs.map((run) => {
      const share = run.status === "finished" ? 1 : run.done / run.total;
      const active = run.status === "running" || run.status === "queued" || run.status === "paused";
      return h("li", {}, h("a", { class: "line", href: `#/run/${run.id}` },
        h("span", { class: "title" }, run.title),
        h("span", { class: `status ${run.status}` }, run.status === "queued" && run.place ? `${count(run.place, "search", "searches")} before it` : run.status),
        h("span", { class: "value" }, figure(run.efficiency)),
        h("span", { class: "more" }, `${run.method} · ${ago(run.created)}`),
        active && h("progress", { max: 1, value: share, "aria-label": `${run.title}: part that is done` })));
    }));
    if (focused) this.list.querySelector<HTMLElement>(`[href="${focused}"]`)?.focus({ preventScroll: true });
  }
}
