// Motion of an output, or its rotation, and the input force along the stroke.

import type { PartFigures } from "./api";
import { ladder } from "./chart";
import { figure, h, s } from "./dom";

const H = 132;
const DEFAULT_WIDTH = 380;
const PAD = { left: 46, right: 10, top: 10, bottom: 22 };
/** Parts of the stroke whose values the text alternative has. */
const QUARTERS = [0.25, 0.5, 0.75, 1];
/** Number of outputs whose curves are shown at once. */
const FEW_OUTPUTS = 2;

/** One chart for each output, and one of the input force in each load case. */
export function strokeCharts(figures: PartFigures[], turns: (loadCase: string) => boolean): HTMLElement | null {
  const known = figures.filter(({ curve }) => curve);
  if (!known.length) return null;
  const severalCases = new Set(known.map((row) => row.case)).size > 1;
  const forced = new Set<string>();
  const charts = known.flatMap((row) => {
    const { curve } = row;
    const start = severalCases ? `${row.case}: ` : "";
    const own = known.filter((each) => each.case === row.case).length > 1 ? ` ${row.output}` : "";
    const isFirst = !forced.has(row.case);
    forced.add(row.case);
    return [
      turns(row.case) ? chart(`${start}rotation of the output${own}`, "°", curve!.input_mm, curve!.rotation_deg) : chart(`${start}motion of the output${own}`, "mm", curve!.input_mm, curve!.output_mm),
      isFirst && chart(`${start}input force`, "N", curve!.input_mm, curve!.input_force_N),
    ];
  });
  return h("details", { class: "stroke-charts", open: known.length <= FEW_OUTPUTS },
    h("summary", {}, "Curves along the stroke, by frames"), ...charts);
}

/** A chart of one quantity over the motion of the input. */
function chart(title: string, unit: string, input: (number | null)[], values: (number | null)[]): HTMLElement | false {
  const points = values.flatMap((value, k): [number, number][] => (value === null || input[k] == null ? [] : [[input[k], value]]));
  if (points.length < 2) return false;
  const svg = s("svg", { class: "chart", role: "img", "aria-label": alternative(title, unit, points) });
  const show = (): void => draw(svg, unit, points);
  show();
  new ResizeObserver(show).observe(svg);
  return h("figure", {}, h("figcaption", {}, `${title}, ${unit}`), svg);
}

function alternative(title: string, unit: string, points: [number, number][]): string {
  const last = points.length - 1;
  const texts = QUARTERS.map((part) => points[Math.round(part * last)]!).map(([x, y]) => `${figure(y, digitsOf(points))} ${unit} at ${figure(x, 2)} mm`);
  return `${title} over the motion of the input: ${texts.join(", ")}`;
}

/** Digits with which the largest value has three figures. */
function digitsOf(points: [number, number][]): number {
  const size = Math.max(...points.map(([, y]) => Math.abs(y)), 1e-6);
  return Math.min(6, Math.max(0, 2 - Math.floor(Math.log10(size))));
}

function draw(svg: SVGElement, unit: string, points: [number, number][]): void {
  // The width in pixels, so that the text has its normal size.
  const W = Math.max(220, Math.round(svg.clientWidth) || DEFAULT_WIDTH);
  svg.setAttribute("viewBox", `0 0 ${W} ${H}`);
  const [xs, ys] = [points.map(([x]) => x), points.map(([, y]) => y)];
  const [left, right] = [Math.min(...xs), Math.max(...xs)];
  const ticks = ladder(Math.min(0, ...ys), Math.max(0, ...ys)).filter((_, k, all) => all.length < 5 || k % 2 === 0 || all.length - 1 === k);
  const [low, high] = [Math.min(ticks[0]!, ...ys), Math.max(ticks.at(-1)!, ...ys)];
  const x = (value: number): number => PAD.left + ((W - PAD.left - PAD.right) * (value - left)) / (right - left || 1);
  const y = (value: number): number => H - PAD.bottom - ((H - PAD.top - PAD.bottom) * (value - low)) / (high - low || 1);
  const step = Math.min(...ticks.slice(1).map((tick, k) => tick - ticks[k]!));
  const digits = Math.min(6, Math.max(0, -Math.floor(Math.log10(step) + 1e-9)));
  const last = points.at(-1)!;
  svg.replaceChildren(
    ...ticks.flatMap((tick) => [
      s("path", { class: "grid", d: `M${PAD.left} ${y(tick).toFixed(1)}H${W - PAD.right}` }),
      s("text", { class: "tick", x: PAD.left - 7, y: (y(tick) + 4).toFixed(1), "text-anchor": "end" }, figure(tick, digits))]),
    ...[0, 0.5, 1].map((part) => s("text", { class: "tick", x: x(left + part * (right - left)).toFixed(1), y: H - 5, "text-anchor": part === 1 ? "end" : part ? "middle" : "start" },
      `${figure(left + part * (right - left), 2)}${part === 1 ? " mm input" : ""}`)),
    s("path", { class: unit === "N" ? "curve force" : "curve best", d: `M${points.map(([px, py]) => `${x(px).toFixed(1)} ${y(py).toFixed(1)}`).join("L")}` }),
    s("circle", { class: unit === "N" ? "head force" : "head", cx: x(last[0]).toFixed(1), cy: y(last[1]).toFixed(1), r: 3 }));
}
