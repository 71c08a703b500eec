// Collections of designs with thumbnails and filters.

import type { Collection, GalleryEntry } from "./api";
import { thicken } from "./drawing";
import { button, count, field, figure, h, s, select } from "./dom";

export function thumbnail({ picture }: Pick<GalleryEntry, "picture">): SVGElement {
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
  const svg = s("svg", { class: "drawing thumbnail", viewBox: `${x0 - margin} ${-y1 - margin} ${x1 - x0 + 2 * margin} ${y1 - y0 + 2 * margin}`, "aria-hidden": "true" },
    s("path", { class: "beam plain", d }),
    s("path", { class: "dot support", d: dots(picture.supports) }),
    s("path", { class: "dot input", d: dots(picture.input) }),
    s("path", { class: "dot output", d: dots(picture.output) }));
  thicken(svg, x1 - x0, 20);
  return svg;
}

export function tile(entry: GalleryEntry, href: string): HTMLElement {
  return h("a", { class: "tile", href }, thumbnail(entry),
    h("span", { class: "title" }, entry.title),
    h("span", { class: "note" }, entry.efficiency === null ? entry.note : `output / input motion ${figure(entry.efficiency)} · ${entry.note}`));
}

/** Show a collection as tiles, with filters for its facets, and at most `most` entries until all are requested. */
export function collectionView(collection: Collection, make: (entry: GalleryEntry) => HTMLElement, most = Infinity): HTMLElement {
  const picked: Record<string, string> = {};
  const tiles = h("div", { class: "tiles" });
  const counter = h("p", { class: "note", role: "status" });
  let all = false;
  const more = button("", () => { all = true; show(); });
  const show = (): void => {
    const fitting = collection.entries.filter(({ facets }) => Object.entries(picked).every(([name, value]) => !value || facets[name] === value));
    const shown = all ? fitting : fitting.slice(0, most);
    tiles.replaceChildren(...shown.map(make));
    more.hidden = shown.length === fitting.length;
    more.textContent = `Show all ${fitting.length}`;
    counter.textContent = count(fitting.length, "design");
  };
  const names = [...new Set(collection.entries.flatMap(({ facets }) => Object.keys(facets)))];
  const choices = names.map((name) => {
    const values = [...new Set(collection.entries.map(({ facets }) => facets[name] ?? ""))].filter(Boolean)
      .sort((a, b) => a.localeCompare(b, "en", { numeric: true }));
    return field(name, select([["", "any"], ...values.map((value): [string, string] => [value, value])], "", (value) => {
      picked[name] = value;
      show();
    }));
  });
  show();
  return h("section", { class: "collection", "aria-label": collection.title, "data-source": collection.source },
    h("div", { class: "collection-head" }, h("h2", {}, collection.title), choices.length > 0 && h("div", { class: "facets" }, ...choices, counter)), tiles, more);
}
