// Efficiency against step for every chain, with the temperature shaded.

import type { Run, TracePoint } from "./api";
import { figure, s } from "./dom";

const H = 230;
const DEFAULT_WIDTH = 820;
const PAD = { left: 44, right: 14, top: 14, bottom: 30 };

export class Chart {
  readonly svg = s("svg", { class: "chart", viewBox: `0 0 ${DEFAULT_WIDTH} ${H}`, role: "img", "aria-label": "Efficiency against step, one curve for each chain" });
  readonly curves = new Map<number, TracePoint[]>();
  constructor() {
    new ResizeObserver(() => this.draw()).observe(this.svg);
  }

  /** Size of a unit of the curves in the unit of the axis, such as mm. */
  unit = 1;
  private level: { title: string; value: number } | null = null;
  private refined: number | null = null;
  private steps = 1;
  private shaded = true;
  private cold = 0;
  private hot = 0;

  /** Set the range of steps and of temperatures; replicas at several temperatures are not shaded. */
  configure(settings: Run["settings"]): void {
    this.steps = settings.steps;
    this.hot = settings.hot ?? 0;
    this.cold = settings.cold ?? 0;
    this.shaded = settings.replicas === undefined;
  }

  compare(title: string, value: number | null): void {
    this.level = value === null ? null : { title, value };
    this.draw();
  }

  /** Set the largest objective of the refinement, in the unit of the curves. */
  setRefined(objective: number): void {
    if (objective === this.refined) return;
    this.refined = objective;
    this.draw();
  }

  /** The best efficiency of all chains so far. */
  get best(): number | null {
    const tops = [...this.curves.values()].map((curve) => curve.at(-1)?.[2] ?? null).filter((top) => top !== null);
    return tops.length ? Math.max(...tops) : null;
  }

  add(points: Record<string, TracePoint[]>, reset: boolean): void {
    if (reset) this.curves.clear();
    for (const [chain, more] of Object.entries(points)) {
      const curve = this.curves.get(Number(chain)) ?? [];
      curve.push(...more);
      this.curves.set(Number(chain), curve);
    }
    this.draw();
  }

  private draw(): void {
    // The width in pixels, so that the text has its normal size.
    const W = Math.max(280, Math.round(this.svg.clientWidth) || DEFAULT_WIDTH);
    this.svg.setAttribute("viewBox", `0 0 ${W} ${H}`);
    let [low, high] = [0, 0.1];
    let bestChain = -1;
    let best = -Infinity;
    for (const [chain, curve] of this.curves) {
      for (const [, now, top] of curve) {
        for (const value of [now, top]) {
          if (value === null || value < -50) continue;
          low = Math.min(low, value * this.unit);
          high = Math.max(high, value * this.unit);
        }
        if (top !== null && top > best) { best = top; bestChain = chain; }
      }
    }
    const levels = [...(this.level ? [this.level] : []), ...(this.refined === null ? [] : [{ title: "refined", value: this.refined * this.unit }])];
    for (const { value } of levels) { high = Math.max(high, value); low = Math.min(low, value); }
    const ticks = ladder(low, high);
    const step = ticks[1]! - ticks[0]!;
    const digits = step >= 1 ? 0 : step >= 0.1 ? 1 : 2;
    if (ticks[0]! < low - 0.3 * step) ticks.shift();
    [low, high] = [Math.min(low, ticks[0]!), Math.max(high, ticks.at(-1)!)];
    const x = (step: number): number => PAD.left + ((W - PAD.left - PAD.right) * step) / this.steps;
    const y = (value: number): number => H - PAD.bottom - ((H - PAD.top - PAD.bottom) * (value - low)) / (high - low || 1);
    const parts: SVGElement[] = [];
    if (this.shaded) parts.push(...this.shading(x));
    for (const tick of ticks) {
      parts.push(s("path", { class: "grid", d: `M${PAD.left} ${y(tick)}H${W - PAD.right}` }),
        s("text", { class: "tick", x: PAD.left - 8, y: y(tick) + 4, "text-anchor": "end" }, figure(tick, digits)));
    }
    for (const part of W > 480 ? [0, 0.25, 0.5, 0.75, 1] : [0, 0.5, 1]) {
      const at = Math.round(part * this.steps);
      parts.push(s("text", { class: "tick", x: x(at), y: H - 8, "text-anchor": part === 1 ? "end" : part ? "middle" : "start" },
        part === 1 ? `${at.toLocaleString("en")} steps of each chain` : at.toLocaleString("en")));
    }
    for (const { title, value } of levels) {
      const at = y(value);
      parts.push(s("path", { class: "level", d: `M${PAD.left} ${at}H${W - PAD.right}` }),
        s("text", { class: "level-name", x: W - PAD.right, y: at - 5, "text-anchor": "end" }, `${title} ${figure(value)}`));
    }
    const order = [...this.curves.keys()].sort((a, b) => Number(a === bestChain) - Number(b === bestChain));
    for (const chain of order) {
      let d = "";
      let pen = "M";
      for (const [step, now] of this.curves.get(chain)!) {
        if (now === null || now < -50) { pen = "M"; continue; }
        d += `${pen}${x(step).toFixed(1)} ${y(now * this.unit).toFixed(1)}`;
        pen = "L";
      }
      parts.push(s("path", { class: chain === bestChain ? "curve best" : "curve", d }));
      const last = this.curves.get(chain)!.at(-1);
      if (chain === bestChain && last && last[1] !== null) parts.push(s("circle", { class: "head", cx: x(last[0]), cy: y(last[1] * this.unit), r: 3.5 }));
    }
    this.svg.replaceChildren(...parts);
  }

  /** Bands behind the curves, darker at higher temperature: the mean over the chains. */
  private shading(x: (step: number) => number): SVGElement[] {
    const bins = 64;
    const sum = new Float64Array(bins);
    const counts = new Float64Array(bins);
    let hottest = this.hot - this.cold;
    for (const curve of this.curves.values()) {
      for (const [step, , , temperature] of curve) {
        const bin = Math.min(bins - 1, Math.floor((step / this.steps) * bins));
        sum[bin]! += Math.max(0, temperature - this.cold);
        counts[bin]! += 1;
        hottest = Math.max(hottest, temperature - this.cold);
      }
    }
    if (hottest <= 0) return [];
    const bands: SVGElement[] = [];
    for (let bin = 0; bin < bins; bin++) {
      const share = counts[bin]! ? sum[bin]! / counts[bin]! / hottest : 0;
      if (share < 0.05) continue;
      const from = x((bin * this.steps) / bins);
      bands.push(s("rect", { class: "warm", x: from.toFixed(1), y: PAD.top, width: (x(((bin + 1) * this.steps) / bins) - from + 0.3).toFixed(1), height: H - PAD.top - PAD.bottom, "fill-opacity": (0.55 * share).toFixed(2) }));
    }
    return bands;
  }
}

/** Round values for an axis, from one below a range to one above it. */
export function ladder(low: number, high: number): number[] {
  const raw = (high - low) / 4 || 1;
  const power = 10 ** Math.floor(Math.log10(raw));
  const step = [1, 2, 5, 10].map((k) => k * power).find((k) => k >= raw) ?? power;
  const ticks: number[] = [];
  for (let k = Math.floor(low / step); k * step <= high + 0.001 * step || ticks.length < 2; k++) ticks.push(Number((k * step).toFixed(10)));
  if (ticks.at(-1)! < high) ticks.push(Number((ticks.at(-1)! + step).toFixed(10)));
  return ticks;
}
