// Pictures of the bundled tasks, computed when they are opened.

import { get, type GalleryEntry } from "./api";
import { thumbnail } from "./collections";
import { clear, h, s } from "./dom";
import { sentence } from "./text";

/** A bundled task: its lattice, and arrows (x, y and direction) at inputs and outputs. */
interface TaskPicture extends Pick<GalleryEntry, "picture"> { name: string; about: string; arrows: { input: number[][]; output: number[][] } }

/** Length of an arrow and of its head, in the width of a picture. */
const LONG = 0.2;
const HEAD = 0.07;

/** A part of the page that unfolds to tiles of all tasks; one opens its task. */
export function taskPictures(open: (name: string) => void): HTMLElement {
  const tiles = h("div", { class: "tiles" }, h("p", { class: "note" }, "Loading the pictures …"));
  const element = h("details", { class: "collections task-pictures" }, h("summary", { "data-key": "pictures" }, "Pictures of the tasks"), tiles);
  let asked = false;
  element.addEventListener("toggle", () => {
    if (asked || !element.open) return;
    asked = true;
    get<TaskPicture[]>("/tasks/pictures").then(
      (found) => clear(tiles, ...found.map((each) => tile(each, () => { element.open = false; open(each.name); }))),
      (error: Error) => { asked = false; clear(tiles, h("p", { class: "fault", role: "alert" }, sentence(error.message))); });
  });
  return element;
}

function tile(task: TaskPicture, press: () => void): HTMLElement {
  const drawing = thumbnail(task);
  const [x0, y0, x1, y1] = task.picture.box as [number, number, number, number];
  const size = Math.max(x1 - x0, y1 - y0);
  for (const kind of ["input", "output"] as const) {
    drawing.append(s("path", { class: `task-arrow ${kind}`, d: task.arrows[kind].map((arrow) => arrowPath(arrow, size)).join("") }));
  }
  // Room for arrows that point out of the lattice.
  const margin = LONG * size;
  drawing.setAttribute("viewBox", `${x0 - margin} ${-y1 - margin} ${x1 - x0 + 2 * margin} ${y1 - y0 + 2 * margin}`);
  return h("button", { type: "button", class: "tile", "data-task": task.name, onclick: press },
    drawing, h("span", { class: "title" }, task.name), h("span", { class: "note" }, task.about));
}

/** An arrow from a place in its direction; none for a direction towards the viewer. */
function arrowPath([x, y, dx, dy]: number[], size: number): string {
  const length = Math.hypot(dx!, dy!);
  if (length < 0.1) return "";
  const [ux, uy] = [dx! / length, dy! / length];
  const [tx, ty] = [x! + LONG * size * ux, y! + LONG * size * uy];
  const side = (turn: number): string => `${(tx - HEAD * size * (ux - turn * uy)).toFixed(2)} ${(-(ty - HEAD * size * (uy + turn * ux))).toFixed(2)}`;
  return `M${x!.toFixed(2)} ${(-y!).toFixed(2)}L${tx.toFixed(2)} ${(-ty).toFixed(2)}M${side(0.7)}L${tx.toFixed(2)} ${(-ty).toFixed(2)}L${side(-0.7)}`;
}
