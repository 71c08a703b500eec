// Designs and searches with small pictures.

import { get, type Run, type Shelf, type Small } from "./api";
import { ago, count, figure, h, s } from "./dom";

export function thumbnail({ picture }: Small): SVGElement {
  const [x0, y0, x1, y1] = picture.box as [number, number, number, number];
  const margin = 0.7;
  let d = "";
  for (let k = 0; k < picture.lines.length; k += 4) {
    d += `M${picture.lines[k]} ${-picture.lines[k + 1]!}L${picture.lines[k + 2]} ${-picture.lines[k + 3]!}`;
  }
  const dots = (places: number[]): string => {
    let path = "";
    for (let k = 0; k < places.length; k += 2) path += `M${places[k]} ${-places[k + 1]!}h0`;
    return path;
  };
  return s("svg", { class: "drawing thumbnail", viewBox: `${x0 - margin} ${-y1 - margin} ${x1 - x0 + 2 * margin} ${y1 - y0 + 2 * margin}`, "aria-hidden": "true" },
    s("path", { class: "beam plain", d }),
    s("path", { class: "dot support", d: dots(picture.supports) }),
    s("path", { class: "dot input", d: dots(picture.input) }),
    s("path", { class: "dot output", d: dots(picture.output) }));
}

export function tile(small: Small, href: string): HTMLElement {
  return h("a", { class: "tile", href }, thumbnail(small),
    h("span", { class: "title" }, small.title),
    h("span", { class: "note" }, small.efficiency === null ? small.note : `${figure(small.efficiency)} · ${small.note}`));
}

export async function galleryPage(): Promise<HTMLElement> {
  const shelves = await get<Shelf[]>("/gallery");
  const page = h("div", { class: "page wide" },
    h("div", { class: "intro" }, h("h1", {}, "Gallery"), h("p", {}, "Open a design to see it move, to take it, or to go on from it.")));
  for (const { source, title, entries } of shelves) {
    if (!entries.length) continue;
    page.append(h("section", { "aria-label": title }, h("h2", {}, title),
      h("div", { class: "tiles" }, ...entries.map((entry) =>
        tile(entry, source === "runs" ? `#/run/${entry.key}` : `#/design/${source}/${entry.key}`)))));
  }
  return page;
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
