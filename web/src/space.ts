// A lattice in space, or an extruded one, drawn by WebGL. A bundle of its own, loaded when it is needed.

import {
  AmbientLight, BoxGeometry, BufferGeometry, Color, ConeGeometry, CylinderGeometry, DirectionalLight, EdgesGeometry, Float32BufferAttribute, Fog,
  Group as Branch, IcosahedronGeometry, InstancedMesh, Line, LineBasicMaterial, LineSegments, Matrix4, Mesh, MeshLambertMaterial,
  OrthographicCamera, Scene, SphereGeometry, Vector3, WebGLRenderer, type BufferGeometry as Geometry, type Object3D,
} from "three";
import { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";
import type { Point } from "./api";
import type { Group, LatticeDrawing, Section } from "./drawing";
import type { Shape } from "./task";

/** Direction from which a part is first seen: turned from the front, and from above, degrees. */
const [AZIMUTH, ELEVATION] = [24, 22];
const VIEWS: [string, string, number, number][] = [["corner", "Corner", AZIMUTH, ELEVATION], ["front", "Front", 0, 0], ["side", "Side", 90, 0], ["top", "Top", 0, 90]];
/** Half the height of the visible region over that of the part. */
const MARGIN = 1.1;
/** Distances from the camera, over half the size of a part, between which colours fade to that of the paper: what is far is paler. */
const FADED = [3.2, 6.2] as const;
const TURN = 15;
/** Pixels from a node or a strut within which it is picked. */
const REACH = { node: 16, beam: 9 };

/** An arrow of an input, output or load. */
export interface SpaceArrow { from: number[]; direction: number[]; length: number; kind: string }

export class SpaceDrawing implements LatticeDrawing {
  readonly element = document.createElement("div");
  readonly canvas = document.createElement("canvas");
  rest: Float64Array = new Float64Array(0);
  at: Float64Array = new Float64Array(0);
  beams: [number, number][] = [];
  dimension: 2 | 3 = 3;
  private readonly renderer: WebGLRenderer;
  private readonly scene = new Scene();
  private readonly fog = new Fog(0);
  private readonly camera = new OrthographicCamera();
  private readonly controls: OrbitControls;
  private readonly light = new DirectionalLight(0xffffff, 2.1);
  private readonly probe = document.createElementNS("http://www.w3.org/2000/svg", "svg");
  private readonly colours = new Map<string, Color>();
  private readonly marks = new Map<string, InstancedMesh>();
  private readonly ghosts = new Map<string, LineSegments>();
  private readonly extras = new Branch();
  private readonly zones = new Branch();
  private readonly traces = new Branch();
  private readonly axes = document.createElementNS("http://www.w3.org/2000/svg", "svg");
  private struts: InstancedMesh | null = null;
  private joints: InstancedMesh | null = null;
  private width = new Float64Array(0);
  private thickness = 0;
  private radius = 1;
  private centre = new Vector3();
  /** Points that are visible at first. */
  private framed: Vector3[] = [];
  private frame = 0;
  private readonly resize: ResizeObserver;
  private readonly dark = matchMedia("(prefers-color-scheme: dark)");
  private readonly onScheme = (): void => { this.colours.clear(); this.repaint(); };
  private last: Group[] = [];
  private lastMarks = new Map<string, ArrayLike<number>>();

  constructor(label: string, private readonly section: Section) {
    this.element.className = "drawing space";
    this.canvas.setAttribute("role", "img");
    this.canvas.setAttribute("aria-label", label);
    this.canvas.tabIndex = 0;
    this.probe.setAttribute("class", "probe");
    this.axes.setAttribute("class", "axes");
    this.axes.setAttribute("viewBox", "-32 -32 64 64");
    this.axes.setAttribute("aria-hidden", "true");
    this.element.append(this.canvas, this.axes, this.probe, this.viewButtons());
    // Without a graphics processor smooth edges would cost half of the frames.
    const isSlow = rendersInSoftware();
    this.renderer = new WebGLRenderer({ canvas: this.canvas, antialias: !isSlow, alpha: true });
    this.renderer.setPixelRatio(isSlow ? 1 : Math.min(2, devicePixelRatio));
    this.camera.up.set(0, 0, 1);
    this.scene.fog = this.fog;
    this.scene.add(new AmbientLight(0xffffff, 1.5), this.light, this.extras, this.zones, this.traces);
    this.controls = new OrbitControls(this.camera, this.canvas);
    this.controls.enablePan = false;
    this.controls.enableZoom = false; // a page that is scrolled over the drawing must not zoom it
    this.controls.rotateSpeed = 0.8;
    this.controls.addEventListener("change", () => this.request());
    this.canvas.addEventListener("focus", () => { this.controls.enableZoom = true; });
    this.canvas.addEventListener("blur", () => { this.controls.enableZoom = false; });
    this.canvas.addEventListener("keydown", (event) => this.turnByKey(event));
    this.resize = new ResizeObserver(() => { this.fit(); this.request(); });
    this.resize.observe(this.element);
    this.dark.addEventListener("change", this.onScheme);
  }

  close(): void {
    cancelAnimationFrame(this.frame);
    this.resize.disconnect();
    this.dark.removeEventListener("change", this.onScheme);
    this.controls.dispose();
    this.renderer.dispose();
    this.renderer.forceContextLoss();
  }

  private viewButtons(): HTMLElement {
    const bar = document.createElement("div");
    bar.className = "views";
    bar.setAttribute("role", "group");
    bar.setAttribute("aria-label", "View");
    for (const [key, title, azimuth, elevation] of VIEWS) {
      const press = document.createElement("button");
      press.type = "button";
      press.className = "quiet small";
      press.textContent = title;
      press.dataset.view = key;
      press.addEventListener("click", () => this.look(azimuth, elevation));
      bar.append(press);
    }
    return bar;
  }

  /** Look at the part from a direction, degrees. */
  look(azimuth: number, elevation: number): void {
    const [turn, tilt] = [(azimuth * Math.PI) / 180, (Math.min(89.9, elevation) * Math.PI) / 180];
    const far = 4 * this.radius;
    this.camera.position.copy(this.centre).add(new Vector3(Math.sin(turn) * Math.cos(tilt), -Math.cos(turn) * Math.cos(tilt), Math.sin(tilt)).multiplyScalar(far));
    this.controls.target.copy(this.centre);
    this.controls.update();
    this.fit();
    this.request();
  }

  private turnByKey(event: KeyboardEvent): void {
    const step: Record<string, [number, number]> = { ArrowLeft: [-TURN, 0], ArrowRight: [TURN, 0], ArrowUp: [0, TURN], ArrowDown: [0, -TURN] };
    const turned = step[event.key];
    // Where arrow keys move a cursor from node to node, Shift turns the view.
    if (!turned || (this.canvas.getAttribute("role") === "application" && !event.shiftKey)) return;
    event.preventDefault();
    const offset = this.camera.position.clone().sub(this.controls.target);
    const elevation = (Math.asin(offset.z / offset.length()) * 180) / Math.PI;
    const azimuth = (Math.atan2(offset.x, -offset.y) * 180) / Math.PI;
    this.look(azimuth + turned[0], Math.max(-89, Math.min(89.9, elevation + turned[1])));
  }

  setLattice(positions: Point[], beams: [number, number][]): void {
    this.dimension = positions[0]?.length === 3 ? 3 : 2;
    this.rest = Float64Array.from(positions.flat() as number[]);
    this.at = this.rest;
    this.beams = beams;
    const { thickness, width } = this.section;
    this.setWidths(this.section);
    this.thickness = this.dimension === 2 ? thickness ?? width : 0;
    for (const mesh of [this.struts, this.joints]) if (mesh) { this.scene.remove(mesh); mesh.dispose(); }
    const material = (): MeshLambertMaterial => new MeshLambertMaterial();
    const strut = this.thickness ? new BoxGeometry(1, 1, 1) : new CylinderGeometry(1, 1, 1, 10, 1, true);
    const joint = this.thickness ? new CylinderGeometry(1, 1, 1, 12) : new IcosahedronGeometry(1, 1);
    this.struts = new InstancedMesh(strut, material(), beams.length);
    this.joints = new InstancedMesh(joint, material(), positions.length);
    for (const mesh of [this.struts, this.joints]) { mesh.frustumCulled = false; mesh.count = 0; this.scene.add(mesh); }
    this.frameOn([this.rest], this.rest.length / this.dimension);
    this.look(this.dimension === 2 ? 18 : AZIMUTH, this.dimension === 2 ? 14 : ELEVATION);
  }

  setGeometry(positions: Point[], section: Section): void {
    this.rest = Float64Array.from(positions.flat() as number[]);
    this.at = this.rest;
    this.setWidths(section);
  }

  private setWidths({ width, widths }: Section): void { this.width = Float64Array.from(this.beams, (_, k) => widths?.[k] ?? width); }

  /** Show the region of positions of nodes. */
  private frameOn(all: ArrayLike<number>[], count: number, nodes: ArrayLike<number> = Array.from({ length: count }, (_, k) => k)): void {
    const [low, high] = [new Vector3(Infinity, Infinity, Infinity), new Vector3(-Infinity, -Infinity, -Infinity)];
    this.framed = all.flatMap((at) => Array.from(nodes, (node) => this.place(node, at, new Vector3())));
    for (const point of this.framed) { low.min(point); high.max(point); }
    this.centre.copy(low).add(high).multiplyScalar(0.5);
    this.radius = Math.max(0.5 * high.distanceTo(low), 0.5);
  }

  /** Fill the drawing with the part, as it is seen now. */
  private fit(): void {
    const { clientWidth: w, clientHeight: h } = this.element;
    if (!w || !h) return;
    this.renderer.setSize(w, h, false);
    this.camera.updateMatrixWorld();
    let half = 0.5;
    for (const point of this.framed) {
      const seen = point.clone().applyMatrix4(this.camera.matrixWorldInverse);
      half = Math.max(half, Math.abs(seen.y), (Math.abs(seen.x) * h) / w);
    }
    // Arrows of a task extend beyond its nodes.
    half = MARGIN * half + (this.canvas.getAttribute("role") === "application" ? 1.8 : 0.8);
    Object.assign(this.camera, { left: (-half * w) / h, right: (half * w) / h, top: half, bottom: -half, near: 0.01, far: 9 * this.radius });
    this.camera.updateProjectionMatrix();
  }

  makeRoom(beams: ArrayLike<number>, displacement: ArrayLike<number>): void {
    if (!beams.length) return;
    const moved = Float64Array.from(this.rest, (value, k) => value + displacement[k]!);
    const used = [...new Set(Array.from(beams).flatMap((beam) => this.beams[beam]!))];
    this.frameOn([this.rest, moved], used.length, used);
    const offset = this.camera.position.clone().sub(this.controls.target).setLength(4 * this.radius);
    this.camera.position.copy(this.centre).add(offset);
    this.controls.target.copy(this.centre);
    this.controls.update();
    this.fit();
    this.request();
  }

  /** A node at given positions; a part in the plane stands upright. */
  private place(k: number, at: ArrayLike<number>, to: Vector3): Vector3 {
    return this.dimension === 3 ? to.set(at[3 * k]!, at[3 * k + 1]!, at[3 * k + 2]!) : to.set(at[2 * k]!, 0, at[2 * k + 1]!);
  }

  draw(groups: Group[]): void {
    const { struts, joints } = this;
    if (!struts || !joints) return;
    this.last = groups;
    const [a, b, axis, one, two, middle] = [new Vector3(), new Vector3(), new Vector3(), new Vector3(), new Vector3(), new Vector3()];
    const matrix = new Matrix4();
    const size = new Float64Array(this.rest.length / this.dimension);
    const tint: (Color | null)[] = Array.from(size, () => null);
    let n = 0;
    for (const { name, beams } of groups) {
      const colour = this.colour(`beam ${name === "plain" ? "solid" : name}`); // ink would hide the shape
      for (let k = 0; k < beams.length; k++) {
        const beam = beams[k]!;
        const [first, second] = this.beams[beam]!;
        this.place(first, this.at, a);
        this.place(second, this.at, b);
        axis.copy(b).sub(a);
        middle.copy(a).add(b).multiplyScalar(0.5);
        const wide = this.width[beam]!;
        if (this.thickness) one.set(0, 1, 0);
        else if (Math.abs(axis.y) < 0.9 * axis.length()) one.set(0, 1, 0).cross(axis).normalize();
        else one.set(1, 0, 0).cross(axis).normalize();
        two.copy(axis).cross(one).normalize();
        one.multiplyScalar(this.thickness || 0.5 * wide);
        two.multiplyScalar(this.thickness ? wide : 0.5 * wide);
        matrix.makeBasis(one, axis, two).setPosition(middle);
        struts.setMatrixAt(n, matrix);
        struts.setColorAt(n++, colour);
        for (const node of [first, second]) if (wide >= size[node]!) { size[node] = wide; tint[node] = colour; }
      }
    }
    struts.count = n;
    let j = 0;
    for (let node = 0; node < size.length; node++) {
      if (!size[node]) continue;
      const r = 0.5 * size[node]!;
      this.place(node, this.at, a);
      if (this.thickness) matrix.makeScale(r, this.thickness, r); else matrix.makeScale(r, r, r);
      joints.setMatrixAt(j, matrix.setPosition(a));
      joints.setColorAt(j++, tint[node]!);
    }
    joints.count = j;
    for (const mesh of [struts, joints]) { mesh.instanceMatrix.needsUpdate = true; if (mesh.instanceColor) mesh.instanceColor.needsUpdate = true; }
    this.request();
  }

  ghost(name: string, beams: ArrayLike<number>): void {
    let lines = this.ghosts.get(name);
    if (!lines) {
      lines = new LineSegments(new BufferGeometry(), new LineBasicMaterial());
      lines.frustumCulled = false;
      this.ghosts.set(name, lines);
      this.scene.add(lines);
    }
    const points: number[] = [];
    const to = new Vector3();
    for (let k = 0; k < beams.length; k++) for (const node of this.beams[beams[k]!]!) points.push(...this.place(node, this.rest, to).toArray());
    lines.geometry.setAttribute("position", new Float32BufferAttribute(points, 3));
    (lines.material as LineBasicMaterial).color.copy(this.colour("beam rule-touch"));
    this.request();
  }

  mark(name: string, nodes: ArrayLike<number>): void {
    this.lastMarks.set(name, nodes);
    let dots = this.marks.get(name);
    const known = dots?.instanceMatrix.count ?? 0;
    if (nodes.length > known || !dots) {
      if (dots) { this.scene.remove(dots); dots.dispose(); }
      dots = new InstancedMesh(new SphereGeometry(1, 12, 8) as Geometry, new MeshLambertMaterial(), Math.max(nodes.length, 8));
      dots.frustumCulled = false;
      this.marks.set(name, dots);
      this.scene.add(dots);
    }
    (dots.material as MeshLambertMaterial).color.copy(this.colour(`dot ${name}`));
    const [matrix, point] = [new Matrix4(), new Vector3()];
    const least = 0.5 * Math.max(...this.width.subarray(0, 1), 0.1);
    const radius = name === "node" ? 0.75 * least : Math.min(0.24, 1.45 * least);
    for (let k = 0; k < nodes.length; k++) {
      const high = this.thickness ? 0.5 * this.thickness + 0.1 * radius : radius;
      dots.setMatrixAt(k, matrix.makeScale(radius, high, radius).setPosition(this.place(nodes[k]!, this.at, point)));
    }
    dots.count = nodes.length;
    dots.instanceMatrix.needsUpdate = true;
    this.request();
  }

  /** Draw the paths of outputs, each from rest to the full stroke. */
  trace(paths: number[][][]): void {
    empty(this.traces);
    for (const path of paths) {
      const points = path.flatMap((point) => (this.dimension === 3 ? point : [point[0]!, -0.5 * this.thickness - 0.05, point[1]!]));
      const geometry = new BufferGeometry().setAttribute("position", new Float32BufferAttribute(points, 3));
      this.traces.add(new Line(geometry, new LineBasicMaterial({ color: this.colour("dot output") })));
    }
    this.request();
  }

  /** Draw arrows. */
  arrows(list: SpaceArrow[]): void {
    empty(this.extras);
    for (const { from, direction, length, kind } of list) {
      const material = new MeshLambertMaterial({ color: this.colour(`dot ${kind}`) });
      const shaft = new Mesh(new CylinderGeometry(0.045, 0.045, length, 8).translate(0, 0.5 * length, 0), material);
      const head = new Mesh(new ConeGeometry(0.14, 0.36, 12).translate(0, length, 0), material);
      const arrow = new Branch().add(shaft, head);
      arrow.position.set(from[0]!, from[1]!, from[2]!);
      arrow.quaternion.setFromUnitVectors(new Vector3(0, 1, 0), new Vector3(direction[0], direction[1], direction[2] ?? 0).normalize());
      this.extras.add(arrow);
    }
    this.request();
  }

  /** Draw shapes of a task as wires; `scale` is the length of a unit of the drawing in units of the shapes. */
  shapes(list: { kind: string; shape: Shape & { sphere?: Point; cylinder?: Point } }[], scale: number): void {
    empty(this.zones);
    for (const { kind, shape } of list) {
      const radius = parseFloat(String(shape.radius ?? 0)) / scale;
      let geometry: Geometry | null = null;
      if (shape.sphere) geometry = new SphereGeometry(radius, 16, 10).translate(...at3(shape.sphere, scale));
      else if (shape.cylinder) geometry = new CylinderGeometry(radius, radius, 2 * this.radius, 24).rotateX(Math.PI / 2).translate(shape.cylinder[0] / scale, shape.cylinder[1] / scale, this.centre.z);
      else if (shape.box?.length === 6) {
        const [x0, y0, z0, x1, y1, z1] = shape.box.map((value) => value / scale) as [number, number, number, number, number, number];
        geometry = new BoxGeometry(x1 - x0, y1 - y0, z1 - z0).translate((x0 + x1) / 2, (y0 + y1) / 2, (z0 + z1) / 2);
      }
      if (geometry) this.zones.add(new LineSegments(new EdgesGeometry(geometry), new LineBasicMaterial({ color: this.colour(kind === "outline" ? "beam possible" : "beam rule-auto") })));
    }
    this.request();
  }

  /** The node and the beam next to the pointer, in front of others; -1 for none. */
  pick(event: { clientX: number; clientY: number }, nodes: ArrayLike<number>, beams: ArrayLike<number> = []): { node: number; beam: number } {
    const box = this.canvas.getBoundingClientRect();
    const [px, py] = [event.clientX - box.left, event.clientY - box.top];
    const found = { node: -1, beam: -1 };
    let best = Infinity;
    for (let k = 0; k < nodes.length; k++) {
      const [x, y, depth] = this.screen(nodes[k]!);
      const away = Math.hypot(x - px, y - py);
      // Of nodes behind each other the front one is picked.
      const cost = away + 30 * depth;
      if (away < REACH.node && cost < best) { best = cost; found.node = nodes[k]!; }
    }
    best = Infinity;
    for (let k = 0; k < beams.length; k++) {
      const [a, b] = this.beams[beams[k]!]!;
      const [ax, ay, az] = this.screen(a);
      const [bx, by, bz] = this.screen(b);
      const [dx, dy] = [bx - ax, by - ay];
      const t = Math.min(0.85, Math.max(0.15, ((px - ax) * dx + (py - ay) * dy) / (dx * dx + dy * dy || 1)));
      const away = Math.hypot(ax + t * dx - px, ay + t * dy - py);
      const cost = away + 30 * (az + t * (bz - az));
      if (away < REACH.beam && cost < best) { best = cost; found.beam = beams[k]!; }
    }
    return found;
  }

  beamAt(event: { clientX: number; clientY: number }): number {
    return this.pick(event, [], Array.from(this.beams.keys())).beam;
  }

  /** Pixels of a node from the upper left corner, and its depth from 0 to 1. */
  screen(node: number): [number, number, number] {
    const point = this.place(node, this.at, new Vector3()).project(this.camera);
    return [(0.5 + 0.5 * point.x) * this.canvas.clientWidth, (0.5 - 0.5 * point.y) * this.canvas.clientHeight, 0.5 + 0.5 * point.z];
  }

  /** The colour that the style sheet has for a class. */
  private colour(name: string): Color {
    let colour = this.colours.get(name);
    if (!colour) {
      const path = document.createElementNS("http://www.w3.org/2000/svg", "path");
      path.setAttribute("class", name);
      this.probe.append(path);
      colour = new Color(getComputedStyle(path).stroke);
      path.remove();
      this.colours.set(name, colour);
    }
    return colour;
  }

  private repaint(): void {
    this.draw(this.last);
    for (const [name, nodes] of this.lastMarks) this.mark(name, nodes);
    for (const [, lines] of this.ghosts) (lines.material as LineBasicMaterial).color.copy(this.colour("beam rule-touch"));
  }

  private request(): void {
    if (!this.frame) this.frame = requestAnimationFrame(() => this.render());
  }

  private render(): void {
    this.frame = 0;
    this.light.position.copy(this.camera.position).sub(this.controls.target).add(this.camera.up.clone().multiplyScalar(2 * this.radius));
    Object.assign(this.fog, { color: this.colour("beam background"), near: FADED[0] * this.radius, far: FADED[1] * this.radius });
    this.renderer.render(this.scene, this.camera);
    this.drawAxes();
  }

  private drawAxes(): void {
    const names = this.dimension === 3 ? "xyz" : "x y";
    const marks = [[1, 0, 0], [0, 1, 0], [0, 0, 1]].map((axis, k) => {
      const [x, y] = new Vector3(...(axis as [number, number, number])).transformDirection(this.camera.matrixWorldInverse).multiplyScalar(20).toArray();
      return names[k] === " " ? "" : `<path d="M0 0L${x!.toFixed(1)} ${(-y!).toFixed(1)}"/><text x="${(1.3 * x!).toFixed(1)}" y="${(-1.3 * y! + 4).toFixed(1)}">${names[k]}</text>`;
    });
    this.axes.innerHTML = marks.join("");
  }
}

/** Whether the browser draws without a graphics processor. */
function rendersInSoftware(): boolean {
  const context = document.createElement("canvas").getContext("webgl");
  if (!context) throw new Error("no WebGL");
  const about = context.getExtension("WEBGL_debug_renderer_info");
  const name = String(context.getParameter(about ? about.UNMASKED_RENDERER_WEBGL : context.RENDERER));
  context.getExtension("WEBGL_lose_context")?.loseContext();
  return /swiftshader|llvmpipe|software/i.test(name);
}

function empty(branch: Branch): void {
  for (const child of [...branch.children]) {
    branch.remove(child);
    child.traverse((each: Object3D) => { (each as Mesh).geometry?.dispose(); });
  }
}

function at3(point: Point, scale: number): [number, number, number] {
  return [point[0] / scale, point[1] / scale, (point[2] ?? 0) / scale];
}
