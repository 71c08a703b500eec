// Functions that create elements, format numbers and announce messages to screen readers.

export type Child = Node | string | number | null | undefined | false;
type Props = Record<string, unknown>;

const SVG = "http://www.w3.org/2000/svg";

function setProps(element: Element, props: Props, children: Child[]): void {
  for (const [key, value] of Object.entries(props)) {
    if (value === null || value === undefined || value === false) continue;
    if (key.startsWith("on") && typeof value === "function") {
      element.addEventListener(key.slice(2), value as EventListener);
    } else if (key === "value" || key === "checked" || key === "disabled" || key === "selected") {
      (element as unknown as Props)[key] = value;
    } else {
      element.setAttribute(key, value === true ? "" : String(value));
    }
  }
  for (const child of children) {
    if (child === null || child === undefined || child === false) continue;
    element.append(child instanceof Node ? child : String(child));
  }
}

export function h<K extends keyof HTMLElementTagNameMap>(
  tag: K, props: Props = {}, ...children: Child[]
): HTMLElementTagNameMap[K] {
  const element = document.createElement(tag);
  setProps(element, props, children);
  return element;
}

export function s<K extends keyof SVGElementTagNameMap>(
  tag: K, props: Props = {}, ...children: Child[]
): SVGElementTagNameMap[K] {
  const element = document.createElementNS(SVG, tag);
  setProps(element, props, children);
  return element;
}

export function clear(element: Element, ...children: Child[]): void {
  element.replaceChildren();
  setProps(element, {}, children);
}

let liveRegion: HTMLElement | null = null;

/** Announce a message to screen readers. */
export function announce(text: string): void {
  if (!liveRegion) {
    liveRegion = h("div", { class: "visually-hidden", role: "status", "aria-live": "polite" });
    document.body.append(liveRegion);
  }
  liveRegion.textContent = text;
}

/** Format a number with a fixed number of digits; a dash without a value. */
export function figure(value: number | null | undefined, digits = 2): string {
  if (value === null || value === undefined || !Number.isFinite(value)) return "–";
  return value.toFixed(digits).replace("-", "−");
}

/** A share in per cent, with a decimal unless it is whole, so that 199 of 200 are not 100 %. */
export function percent(share: number): string {
  return String(Math.round(1000 * share) / 10);
}

export function count(value: number, noun: string, plural = `${noun}s`): string {
  return `${value.toLocaleString("en")} ${value === 1 ? noun : plural}`;
}

export function duration(seconds: number | null | undefined): string {
  if (seconds === null || seconds === undefined || !Number.isFinite(seconds)) return "–";
  if (seconds < 90) return `${Math.max(0, Math.round(seconds))} s`;
  if (seconds < 5400) return `${Math.round(seconds / 60)} min`;
  return `${(seconds / 3600).toFixed(1)} h`;
}

export function ago(seconds: number): string {
  const passed = Date.now() / 1000 - seconds;
  if (passed < 60) return "just now";
  if (passed < 3600) return `${Math.round(passed / 60)} min ago`;
  if (passed < 86400) return `${Math.round(passed / 3600)} h ago`;
  return new Date(seconds * 1000).toLocaleDateString("en", { day: "numeric", month: "short", year: "numeric" });
}

/** A choice of few options: radio buttons displayed as one control. */
export function choice<T extends string>(
  label: string, options: [T, string][], value: T, pick: (value: T) => void, name = label,
): HTMLElement {
  const group = h("div", { class: "choice", role: "radiogroup", "aria-label": label });
  const id = `c${Math.random().toString(36).slice(2, 8)}`;
  for (const [key, text] of options) {
    const input = h("input", {
      type: "radio", name: `${name}-${id}`, id: `${id}-${key}`, value: key, checked: key === value,
      onchange: () => pick(key),
    });
    group.append(input, h("label", { for: `${id}-${key}` }, text));
  }
  return group;
}

/** A labelled field. */
export function field(label: string, control: HTMLElement, unit = "", help = ""): HTMLElement {
  const id = control.id || `f${Math.random().toString(36).slice(2, 8)}`;
  control.id = id;
  return h("div", { class: "field" },
    h("label", { for: id }, label),
    h("span", { class: "control" }, control, unit && h("span", { class: "unit" }, unit)),
    help && h("small", {}, help));
}

export function number(
  value: number, options: { min?: number; max?: number; step?: number | "any" }, change: (value: number) => void,
): HTMLInputElement {
  const input = h("input", { type: "number", value: String(value), inputmode: "decimal", ...options });
  input.addEventListener("change", () => {
    const given = input.valueAsNumber;
    if (Number.isFinite(given)) change(given);
    else input.value = String(value);
  });
  return input;
}

export function select<T extends string>(
  options: [T, string][], value: T, pick: (value: T) => void,
): HTMLSelectElement {
  const element = h("select", { onchange: () => pick(element.value as T) });
  for (const [key, text] of options) element.append(h("option", { value: key, selected: key === value }, text));
  return element;
}

export function button(text: string, press: () => void, kind = "", more: Props = {}): HTMLButtonElement {
  return h("button", { type: "button", class: kind, onclick: press, ...more }, text);
}

export function download(content: Blob, name: string): void {
  const address = URL.createObjectURL(content);
  const link = h("a", { href: address, download: name });
  document.body.append(link);
  link.click();
  link.remove();
  setTimeout(() => URL.revokeObjectURL(address), 10_000);
}

const paths: Record<string, string> = {
  undo: "M7 5 3 9l4 4M3 9h8a5 5 0 0 1 0 10H8",
  redo: "m13 5 4 4-4 4M17 9H9a5 5 0 0 0 0 10h3",
  play: "M6 4v12l10-6z",
  pause: "M6 4h3v12H6zM11 4h3v12h-3z",
};

export function icon(name: keyof typeof paths): SVGElement {
  const filled = name === "play" || name === "pause";
  return s("svg", { viewBox: "0 0 20 22", width: 18, height: 18, "aria-hidden": "true",
    fill: filled ? "currentColor" : "none", stroke: filled ? "none" : "currentColor",
    "stroke-width": 1.8, "stroke-linecap": "round", "stroke-linejoin": "round" },
  s("path", { d: paths[name] }));
}

/** A button with an icon; its title is announced by screen readers. */
export function iconButton(name: keyof typeof paths, title: string, press: () => void): HTMLButtonElement {
  return h("button", { type: "button", class: "quiet icon", title, "aria-label": title.replace(/ \(.*/, ""), onclick: press }, icon(name));
}
