// The gallery of designs and the list of searches.

import { get, type Run, type Collection } from "./api";
import { ago, count, figure, h } from "./dom";
import { collectionView, tile } from "./collections";
import { sentence, statusName } from "./text";

/** Number of designs of a collection shown at first: three rows. */
const SHOWN = 15;

export async function galleryPage(): Promise<HTMLElement> {
  const collections = await get<Collection[]>("/gallery");
  return h("div", { class: "page wide" },
    h("div", { class: "intro" }, h("h1", {}, "Gallery"), h("p", {}, "Open a design to see its motion, to download it, or to use it as a starting point.")),
    ...collections.filter(({ entries }) => entries.length).map((collection) => collectionView(collection, (entry) =>
      tile(entry, entry.source === "runs" ? `#/run/${entry.key}` : `#/design/${entry.source}/${entry.key}`), SHOWN)));
}

/** The status of a search; one that has run and waits for its turn is not like one that has not started. */
function statusText(run: Run, share: number): string {
  if (run.status !== "queued") return statusName(run.status);
  const state = run.done > 0 ? `waiting for its turn, ${figure(100 * share, 0)} % done` : "queued";
  return run.place ? `${state}, ${count(run.place, "search", "searches")} ahead` : state;
}

export class RunsPage {
  readonly element = h("div", { class: "page wide" });
  private readonly list = h("ul", { class: "list" });
  private readonly timer: number;

  constructor() {
    this.element.append(h("div", { class: "intro" }, h("h1", {}, "Searches"),
      h("p", {}, "Searches continue on the server when this page is closed.")), this.list);
    void this.refresh();
    this.timer = window.setInterval(() => void this.refresh(), 1000);
  }

  close(): void { clearInterval(this.timer); }

  private async refresh(): Promise<void> {
    let runs: Run[];
    try {
      runs = await get<Run[]>("/runs");
    } catch (error) {
      if (!this.list.childElementCount) this.list.replaceChildren(h("li", { class: "empty" }, sentence((error as Error).message)));
      return;
    }
    const focused = document.activeElement?.getAttribute("href");
    if (!runs.length) {
      this.list.replaceChildren(h("li", { class: "empty" }, "No searches. ", h("a", { href: "#/draw" }, "Define a task"), " and press Design it."));
      return;
    }
    this.list.replaceChildren(...runs.map((run) => {
      const share = run.status === "finished" ? 1 : run.done / run.total;
      const active = run.status === "running" || run.status === "queued" || run.status === "paused";
      return h("li", {}, h("a", { class: "line", href: `#/run/${run.id}` },
        h("span", { class: "title" }, run.title),
        h("span", { class: `status ${run.status}` }, statusText(run, share),
          run.met !== null && h("b", { class: run.met ? "met" : "missed" }, run.met ? "all items met" : "items missed")),
        h("span", { class: "value" }, run.objective || (run.efficiency === null || active ? "" : `output / input ${figure(run.efficiency)}`)),
        h("span", { class: "more" }, `${run.method}, ${count(run.settings.chains, "chain")} of ${run.settings.steps.toLocaleString("en")} steps, seed ${run.settings.seed} · ${ago(run.created)} · id ${run.id.slice(0, 4)}`),
        active && h("progress", { max: 1, value: share, "aria-label": `${run.title}: progress` })));
    }));
    if (focused) this.list.querySelector<HTMLElement>(`[href="${focused}"]`)?.focus({ preventScroll: true });
  }
}
