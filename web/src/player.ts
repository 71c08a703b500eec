// Animation of a design along its computed path, with amplification and colours.

import { modelOf, post, type Motion, type Problem, type ToleranceFound } from "./api";
import { bitsOf } from "./api";
import { binned, BINS, Drawing, where } from "./drawing";
import { choice, clear, field, figure, h, icon, s } from "./dom";
import { sentence } from "./text";

export type Colour = "plain" | "energy" | "stress" | "sensitivity" | "loss";

export interface Picture { points: number[]; cells: number[]; corners: number; stress: number[] }
export interface Sensitivity { efficiency: number; beams: number[]; change: (number | null)[] }

const PERIOD = 3200;

export class Player {
  readonly drawing = new Drawing("The design");
  readonly element = h("div", { class: "player" });
  readonly readout = h("div", { class: "readout" });
  private readonly controls = h("div", { class: "transport" });
  private readonly legend = h("p", { class: "legend" });
  private readonly slider = h("input", { type: "range", min: 0, max: 1000, value: "1000", "aria-label": "Fraction of the stroke" });
  private readonly playButton = h("button", { type: "button", class: "round", onclick: () => this.toggle() });
  private readonly stress = s("g", { class: "stress" });
  private readonly path = s("path", { class: "output-path", "aria-hidden": "true" });
  private readonly cases = h("div", { class: "cases" });
  private loadCase = "";
  private motion: Motion | null = null;
  private beams: number[] = [];
  private part = 1;
  private times = 1;
  private colour: Colour = "energy";
  private frame = 0;
  private began = 0;
  private updated = 0;
  private sensitivity: Sensitivity | null = null;
  private losses: ToleranceFound["losses"] | null = null;
  private picture: Picture | null = null;
  private shares = new Float64Array(0);
  /** Called when the stress is selected before it is computed. */
  onStressRequested: () => void = () => {};
  onError: (message: string) => void = () => {};
  /** Called with the motion when it has been computed. */
  onMotion: (motion: Motion) => void = () => {};

  constructor(private readonly problem: Problem, private readonly mask: string, private readonly scale: number) {
    this.drawing.setLattice(problem.positions, problem.beams);
    this.drawing.overlay.append(this.stress, this.path);
    const bits = bitsOf(mask, problem.beams.length);
    this.beams = where(bits);
    this.drawing.ghost("rest", this.beams);
    this.slider.addEventListener("input", () => { this.stop(); this.part = Number(this.slider.value) / 1000; this.show(); });
    const times = h("input", { type: "range", min: 1, max: 8, step: 0.5, value: "1", "aria-label": "Amplification of the motion" });
    const size = h("output", {}, "× 1");
    times.addEventListener("input", () => { this.times = Number(times.value); size.textContent = `× ${this.times}`; this.show(); });
    this.controls.append(this.playButton, this.slider,
      h("span", { class: "amplify" }, field("Amplify", times), size));
    this.element.append(this.cases, h("div", { class: "paper" }, this.readout, this.drawing.svg), this.controls,
      h("div", { class: "row between colour" }, this.colours(), this.legend));
    this.setPlaying(false);
    this.drawing.svg.addEventListener("pointermove", (event) => this.point(event));
    this.show();
    void this.load();
  }

  get playing(): boolean { return this.frame !== 0; }

  close(): void { this.stop(); }

  private colours(): HTMLElement {
    return choice("Colour", [["plain", "Plain"], ["energy", "Strain energy"], ["sensitivity", "Sensitivity"], ["stress", "Stress"], ...(this.losses ? [["loss", "Loss of struts"]] : [])] as [Colour, string][],
      this.colour, (picked) => this.paint(picked));
  }

  paint(colour: Colour): void {
    this.colour = colour;
    if (colour === "stress" && !this.picture) this.onStressRequested();
    if (colour === "sensitivity" && !this.sensitivity) void this.loadSensitivity();
    if (colour === "stress") { this.stop(); this.part = 1; }
    const input = this.element.querySelector<HTMLInputElement>(`.colour input[value="${colour}"]`);
    if (input) input.checked = true;
    this.show();
  }

  /** Colour the struts by what the loss of each costs. */
  showLosses({ beams, cost }: ToleranceFound["losses"]): void {
    this.losses = { beams, cost };
    const bar = this.element.querySelector(".colour");
    if (bar && !bar.querySelector('input[value="loss"]')) bar.firstElementChild!.replaceWith(this.colours());
    this.paint("loss");
  }

  /** Struts by the part of the efficiency that their loss costs. */
  private lossGroups({ beams, cost }: ToleranceFound["losses"]): { name: string; beams: number[] }[] {
    const groups: Record<string, number[]> = { "effect-none": [], "effect-1": [], "effect-2": [], "effect-3": [], "effect-broken": [], "effect-given": [] };
    const known = new Map(beams.map((beam, k) => [beam, cost[k] ?? null]));
    for (const beam of this.beams) {
      if (!known.has(beam)) { groups["effect-given"]!.push(beam); continue; }
      const loss = known.get(beam)!;
      groups[loss === null ? "effect-broken" : loss > 0.5 ? "effect-3" : loss > 0.3 ? "effect-2" : loss > 0.1 ? "effect-1" : "effect-none"]!.push(beam);
    }
    return Object.entries(groups).map(([name, list]) => ({ name, beams: list }));
  }

  showStress(picture: Picture | null): void {
    this.picture = picture;
    this.paint("stress");
  }

  private async load(): Promise<void> {
    try {
      this.motion = await post<Motion>("/motion", { problem: this.problem, mask: this.mask, case: this.loadCase });
      this.drawing.makeRoom(this.beams, this.motion.displacement.at(-1)!);
      this.showCases(this.motion);
      this.drawPaths(this.motion);
      this.show();
      this.element.dataset.ready = "yes";
      this.onMotion(this.motion);
      if (!matchMedia("(prefers-reduced-motion: reduce)").matches) this.play();
    } catch (error) {
      this.onError(sentence((error as Error).message));
    }
  }

  /** Offer the load cases of a task that has several. */
  private showCases({ cases }: Motion): void {
    if (cases.length < 2) return;
    clear(this.cases, choice("Load case", cases.map((name): [string, string] => [name, name]), this.loadCase || cases[0]!, (picked) => {
      this.loadCase = picked;
      this.stop();
      void this.load();
    }));
  }

  /** Draw the path of each output, from rest to the full stroke. */
  private drawPaths({ displacement, outputs }: Motion): void {
    const { rest } = this.drawing;
    const mean = (nodes: number[], at: (index: number) => number, axis: number): number =>
      nodes.reduce((sum, node) => sum + at(2 * node + axis), 0) / nodes.length;
    const d = Object.values(outputs).flatMap((nodes) => displacement.map((moved, k) => {
      const [x, y] = [0, 1].map((axis) => mean(nodes, (index) => rest[index]! + moved[index]!, axis)) as [number, number];
      return `${k ? "L" : "M"}${x.toFixed(3)} ${(-y).toFixed(3)}`;
    })).join("");
    this.path.setAttribute("d", d);
  }

  private async loadSensitivity(): Promise<void> {
    try {
      this.sensitivity = await post<Sensitivity>("/sensitivity", { problem: this.problem, mask: this.mask });
      this.show();
    } catch (error) {
      this.onError(sentence((error as Error).message));
    }
  }

  toggle(): void { if (this.playing) this.stop(); else this.play(); }

  play(): void {
    if (!this.motion || this.playing) return;
    if (this.colour === "stress") this.paint("energy");
    this.began = performance.now() - (Math.acos(1 - 2 * this.part) / (2 * Math.PI)) * PERIOD;
    const step = (now: number): void => {
      this.part = 0.5 - 0.5 * Math.cos((2 * Math.PI * (now - this.began)) / PERIOD);
      this.show();
      this.frame = requestAnimationFrame(step);
    };
    this.frame = requestAnimationFrame(step);
    this.setPlaying(true);
  }

  stop(): void {
    cancelAnimationFrame(this.frame);
    this.frame = 0;
    this.setPlaying(false);
  }

  private setPlaying(yes: boolean): void {
    this.playButton.replaceChildren(icon(yes ? "pause" : "play"));
    this.playButton.setAttribute("aria-label", yes ? "Pause the motion" : "Play the motion");
  }

  private show(): void {
    const { drawing, motion } = this;
    // Text that changes sixty times a second is not readable, and each change costs a layout.
    const now = performance.now();
    const calm = this.playing && now - this.updated < 100;
    if (!calm) this.updated = now;
    let energy: ArrayLike<number> | null = null;
    if (motion) {
      const place = this.part * (motion.part.length - 1);
      const k = Math.min(motion.part.length - 2, Math.floor(place));
      const t = place - k;
      const [before, after] = [motion.displacement[k]!, motion.displacement[k + 1]!];
      if (drawing.at === drawing.rest) drawing.at = drawing.rest.slice();
      for (let n = 0; n < drawing.at.length; n++) {
        drawing.at[n] = drawing.rest[n]! + this.times * (before[n]! + t * (after[n]! - before[n]!));
      }
      const [e0, e1] = [motion.energy[k]!, motion.energy[k + 1]!];
      if (this.shares.length !== e0.length) this.shares = new Float64Array(e0.length);
      for (let b = 0; b < e0.length; b++) this.shares[b] = e0[b]! + t * (e1[b]! - e0[b]!);
      energy = this.shares;
      const value = Math.round(1000 * this.part);
      if (!calm && this.slider.valueAsNumber !== value) this.slider.value = String(value);
      if (!calm) this.showReadout(motion, k, t);
    }
    const stressed = this.colour === "stress" && this.picture !== null;
    if (stressed) this.drawStress(this.picture!);
    else if (this.stress.childNodes.length) this.stress.replaceChildren();
    if (stressed) drawing.draw([]);
    else if (this.colour === "sensitivity" && this.sensitivity) drawing.draw(this.effects(this.sensitivity));
    else if (this.colour === "loss" && this.losses) drawing.draw(this.lossGroups(this.losses));
    else if (this.colour === "energy" && energy) drawing.draw(binned(this.beams, energy));
    else drawing.draw([{ name: "plain", beams: this.beams }]);
    if (stressed) for (const name of ["support", "input", "output"]) drawing.mark(name, []);
    else if (motion) {
      drawing.mark("support", motion.supports);
      drawing.mark("input", motion.input);
      drawing.mark("output", Object.values(motion.outputs).flat());
    } else drawing.markRegions(this.problem);
    if (!calm) this.showLegend();
  }

  private showReadout(motion: Motion, k: number, t: number): void {
    const near = t > 0.5 ? k + 1 : k;
    const stroke = motion.stroke === null ? `${figure(100 * this.part, 0)} % of the force` : `${figure(this.part * motion.stroke * this.scale, 2)} mm in`;
    const efficiency = motion.efficiency[near] ?? null;
    const out = efficiency === null || motion.stroke === null ? "" : `${figure(this.part * motion.stroke * this.scale * efficiency, 2)} mm out`;
    const lines = [figure(efficiency, 3), modelOf(this.problem), stroke, out, motion.snapped[near] ? "after a snap-through" : ""];
    if (this.readout.childElementCount !== 5) {
      clear(this.readout, h("strong"), h("span"), h("span"), h("span"), h("span", { class: "alarm" }));
    }
    lines.forEach((text, n) => {
      const line = this.readout.children[n]!;
      if (line.textContent !== text) line.textContent = text;
    });
  }

  private effects(found: Sensitivity): { name: string; beams: number[] }[] {
    const change = new Map(found.beams.map((beam, k) => [beam, found.change[k] ?? null]));
    const present = new Set(this.beams);
    const scale = Math.abs(found.efficiency) || 1;
    const groups: Record<string, number[]> = { "effect-none": [], "effect-1": [], "effect-2": [], "effect-3": [], "effect-broken": [], "effect-harm": [], "effect-add": [], "effect-given": [] };
    for (const beam of this.beams) {
      if (!change.has(beam)) { groups["effect-given"]!.push(beam); continue; }
      const value = change.get(beam)!;
      const loss = value === null ? null : -value / scale;
      const name = loss === null ? "effect-broken" : loss > 0.5 ? "effect-3" : loss > 0.1 ? "effect-2" : loss > 0.005 ? "effect-1" : loss < -0.005 ? "effect-harm" : "effect-none";
      groups[name]!.push(beam);
    }
    for (const [beam, value] of change) if (!present.has(beam) && value !== null && value / scale > 0.005) groups["effect-add"]!.push(beam);
    return Object.entries(groups).map(([name, beams]) => ({ name, beams }));
  }

  private point(event: PointerEvent): void {
    if (this.colour !== "sensitivity" || !this.sensitivity) return;
    const beam = this.drawing.nearestBeam(this.drawing.locate(event), 0.4);
    const k = this.sensitivity.beams.indexOf(beam);
    if (beam < 0 || k < 0) { this.legend.dataset.beam = ""; this.showLegend(); return; }
    const change = this.sensitivity.change[k] ?? null;
    const there = this.beams.includes(beam);
    const after = change === null ? "no admissible design" : figure(this.sensitivity.efficiency + change, 3);
    this.legend.dataset.beam = `${there ? "Without" : "With"} beam ${beam}: ${figure(this.sensitivity.efficiency, 3)} → ${after}`;
    this.showLegend();
  }

  private showLegend(): void {
    const texts: Record<Colour, string> = {
      plain: "Grey: at rest. Orange: input. Blue: output.",
      energy: "Strain energy of each beam, increasing from pale to red.",
      sensitivity: this.sensitivity ? (this.legend.dataset.beam || "Dark: removal lowers the efficiency most. Dashed: addition raises it. Point at a beam for its values.") : "Evaluating the removal of each beam …",
      loss: "The loss of a strut costs: pale up to 10 % of the efficiency, then up to 30 %, up to 50 %, darkest more. Violet: the full stroke is not reached without it.",
      stress: this.picture ? `Von Mises stress, up to ${figure(Math.max(...sample(this.picture.stress)), 2)} MPa.` : "Check with finite elements to compute the stress.",
    };
    if (this.legend.textContent !== texts[this.colour]) this.legend.textContent = texts[this.colour];
  }

  private drawStress({ points, cells, corners, stress }: Picture): void {
    if (this.stress.childNodes.length) return;
    const peak = Math.max(...sample(stress)) || 1;
    const paths: string[] = Array.from({ length: BINS }, () => "");
    const perCell = stress.length * corners === cells.length;
    for (let c = 0; c < cells.length; c += corners) {
      let value = 0;
      let d = "";
      for (let k = 0; k < corners; k++) {
        const v = cells[c + k]!;
        d += `${k ? "L" : "M"}${(points[2 * v]! / this.scale).toFixed(3)} ${(-points[2 * v + 1]! / this.scale).toFixed(3)}`;
        if (!perCell) value += stress[v]! / corners;
      }
      if (perCell) value = stress[c / corners]!;
      paths[Math.min(BINS - 1, Math.floor((value / peak) * BINS))] += corners > 2 ? `${d}Z` : d;
    }
    this.stress.replaceChildren(...paths.map((d, bin) =>
      s("path", { d, class: `${corners > 2 ? "facet" : "strut"} heat-${bin}` })));
  }
}

/** Reduce many values to block maxima, since a call has a limited number of arguments. */
function sample(values: number[]): number[] {
  if (values.length < 5000) return values;
  return Array.from({ length: Math.ceil(values.length / 5000) }, (_, k) =>
    values.slice(5000 * k, 5000 * (k + 1)).reduce((a, b) => Math.max(a, b), 0));
}
