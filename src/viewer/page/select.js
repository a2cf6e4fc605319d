// Tools that select Gaussians, and edits of the selected Gaussians. The selection is stored on the server.

import { $, choose, counted, el, icon, svg } from "./dom.js";

/** Tools by name: title, key, shapes of the icon, what the slider means, the value it starts with. */
const TOOLS = {
  pointer: ["Select objects", "Escape", ["M4 2.5 12.5 8l-4 .8-2 4Z"]],
  find: ["Find an object: click it, or drag a box around it", "O", ["M7 2.5a4.5 4.5 0 1 0 0 9 4.5 4.5 0 0 0 0-9Z", "M10.5 10.5 14 14"]],
  strokes: ["Select an object by drawing strokes on it; Ctrl+drag or right click marks background", "Z", ["M2.5 11c2-5 4-6 5-4s1 4 3 1 2-3 3-3", "M4 13.5h8"], "Width", 8],
  box: ["Select Gaussians in a rectangle", "R", ["M2.5 3.5h11v9h-11Z"]],
  lasso: ["Select Gaussians with a lasso", "T", ["M8 3c3.5 0 6 1.6 6 3.700S11.5 10.5 8 10.5 2 9 2 6.7 4.5 3 8 3Z", "M5.5 10.300c-1 1.2-.5 2.7 1 3.2"]],
  brush: ["Select Gaussians with a brush", "B", ["M13.5 2.5 7 9", "M6.5 8.500c-2.5 0-2 3-4 4 3 1 5.5 0 5-3Z"], "Brush", 24],
  ball: ["Select Gaussians in a sphere around a point", "N", ["M8 2.500a5.5 5.5 0 1 0 0 11 5.5 5.5 0 0 0 0-11Z", "M2.5 8c3 2 8 2 11 0"], "Radius", 60],
  flood: ["Select connected Gaussians of similar colour", "U", ["M3 8l5-5 5 5-5 5Z", "M13.5 10.500c.8 1.2.8 2.5 0 2.500s-.8-1.3 0-2.500Z"], "Tolerance", 24],
  depth: ["Select Gaussians in front of a point; right click: behind it", "Y", ["M8 2v12", "M4.5 5 2 8l2.5 3", "M11.5 5 14 8l-2.5 3"]],
  measure: ["Measure the distance between two points", "J", ["M2 10.5 10.5 2 14 5.5 5.5 14Z", "M5 7.500l1.5 1.5", "M7.5 5 9 6.5"]],
};

export class Selecting {
  /** `other` has the tools `find` and `measure`. */
  constructor(link, stage, rig, labels, other) {
    Object.assign(this, { link, stage, rig, labels, other, tool: "pointer", state: { count: 0, locked: 0 }, path: [], sizes: {}, isFixed: false });
    this.buttons = {};
    for (const [name, [title, key, shapes]] of Object.entries(TOOLS)) {
      const button = el("button", { type: "button", title: `${title} (${key})`, "aria-label": title }, icon(...shapes));
      button.addEventListener("click", () => this.take(name));
      this.buttons[name] = button;
    }
    $("palette").append(...Object.values(this.buttons));
    const on = (id, act) => $(id).addEventListener("click", act);
    for (const what of ["grow", "shrink", "invert", "lock", "unlock"]) on(`chosen-${what}`, () => this.send({ select: what }));
    on("chosen-none", () => this.clear());
    on("chosen-delete", () => this.edit({ edit: "delete" }));
    on("chosen-keep", () => this.edit({ edit: "keep" }));
    on("chosen-double", () => this.edit({ edit: "duplicate", shift: this.beside(), name: null }));
    $("chosen").addEventListener("submit", (event) => { event.preventDefault(); this.give(); });
    $("chosen-to").addEventListener("change", () => this.render());
    $("chosen-size").addEventListener("input", () => { this.sizes[this.tool] = Number($("chosen-size").value); });
    this.take("pointer");
  }

  get isOn() { return this.tool !== "pointer"; }

  /** The tool that receives clicks and drags, or null for selecting labels. */
  get hand() {
    if (this.tool === "find" || this.tool === "measure") return this.other[this.tool];
    return this.isOn ? this : null;
  }

  setScene({ training, finds }) {
    this.isFixed = training;
    $("palette").hidden = training;
    this.buttons.find.hidden = !finds;
    this.take("pointer");
  }

  take(name) {
    this.tool = (name === "find" && this.buttons.find.hidden) || this.isFixed ? "pointer" : name;
    choose(this.buttons, this.tool);
    this.stage.box.classList.toggle("pointing", this.isOn);
    for (const other of ["find", "measure"]) this.other[other].choose(this.tool === other);
    const [, , , meaning, start] = TOOLS[this.tool];
    $("chosen-size-field").hidden = !meaning;
    $("chosen-size-name").textContent = meaning ?? "";
    if (meaning) $("chosen-size").value = this.sizes[this.tool] ?? start;
    $("chosen-through-field").hidden = !["box", "lasso", "brush"].includes(this.tool);
    this.render();
  }

  setState(state) {
    this.state = state;
    this.render();
    this.stage.change();
  }

  render() {
    const { count, locked } = this.state;
    const isTool = this.isOn && this.hand === this;
    $("chosen").hidden = !isTool && count === 0;
    const hint = { strokes: "Draw on the object; Ctrl marks background", box: "Drag a rectangle", lasso: "Draw around the Gaussians", brush: "Paint over the Gaussians", ball: "Click the centre", flood: "Click a surface", depth: "Click: in front of the point; right click: behind it" }[this.tool];
    const more = this.tool === "strokes" ? " · Ctrl marks background" : "";
    $("chosen-text").textContent = count > 0 ? `${counted(count, "Gaussian")} selected${more}` : `${hint ?? ""}${this.tool === "strokes" ? "" : " · Shift adds, Ctrl removes"}`;
    $("chosen-tools").hidden = count === 0;
    $("chosen-unlock").hidden = locked === 0;
    $("chosen-unlock").textContent = `Unlock ${locked}`;
    const to = $("chosen-to");
    const kept = to.value;
    const option = (value, textContent) => el("option", { value, textContent });
    to.replaceChildren(option("new", "New label"), ...this.labels.rows.map((row) => option(row.id, row.id === 0 ? "no label" : this.labels.title(row.id))));
    to.value = [...to.options].some(({ value }) => value === kept) ? kept : "new";
    $("chosen-name").hidden = to.value !== "new";
  }

  send(what) { this.link.send({ kind: "choose", what }); }

  edit(what) { if (this.state.count > 0) this.link.send({ kind: "edit", what }); }

  give() {
    const to = $("chosen-to").value;
    const name = $("chosen-name").value.trim();
    this.edit({ edit: "assign", label: to === "new" ? null : Number(to), name: to === "new" && name ? name : null });
    $("chosen-name").value = "";
  }

  clear() {
    if (this.state.count > 0) this.send({ select: "nothing" });
  }

  /** One and a quarter of the image's tenth to the right of the camera, world units. */
  beside() {
    const [width] = this.rig.size;
    const depth = Math.hypot(...this.rig.pivot.map((at, axis) => at - this.rig.centre[axis]));
    return this.rig.rows[0].map((at) => at * 0.125 * depth * width / (this.rig.focal[0] * this.rig.size[1]));
  }

  how(event, isOn = true) {
    const add = event?.shiftKey;
    const take = event?.ctrlKey || event?.metaKey || !isOn;
    return add && take ? "within" : take ? "take" : add ? "add" : "replace";
  }

  click(at, isOn, event) {
    const pixel = this.stage.pixel(...at);
    if (!pixel) return;
    const { from } = this;
    const size = Number($("chosen-size").value);
    const scale = this.stage.scale();
    if (this.tool === "ball") this.send({ select: "ball", from, pixel, radius: size * scale, how: this.how(event, isOn) });
    else if (this.tool === "flood") this.send({ select: "flood", from, pixel, tolerance: size / 200, how: this.how(event, isOn) });
    else if (this.tool === "depth") this.send({ select: "depth", from, pixel, side: isOn ? "front" : "behind", how: this.how(event) });
    else if (this.tool === "brush") this.draw([at], "along", this.how(event, isOn));
    else if (this.tool === "strokes") this.stroke([at], isOn && !event.ctrlKey && !event.metaKey);
  }

  /** Sends a stroke on the object or on the background. */
  stroke(path, on) {
    const points = thinned(path).map((at) => this.stage.place(...at));
    this.send({ select: "stroke", from: this.from, points, radius: Number($("chosen-size").value) * this.stage.scale(), on });
  }

  get from() { return this.rig.view === null ? { camera: this.rig.file() } : { view: this.rig.view }; }

  drag(from, to) {
    if (this.path.length === 0) this.path.push(from);
    const last = this.path[this.path.length - 1];
    if (Math.hypot(to[0] - last[0], to[1] - last[1]) >= 2) this.path.push(to);
    const { path } = this;
    const points = (this.tool === "box" ? corners(from, to) : path).map((at) => at.join()).join(" ");
    const isBrush = this.tool === "brush" || this.tool === "strokes";
    const shape = isBrush
      ? svg("polyline", { points, class: "brush", "stroke-width": 2 * $("chosen-size").value })
      : svg(this.tool === "box" || this.tool === "lasso" ? "polygon" : "polyline", { points });
    $("drawn").replaceChildren(shape);
  }

  box(from, to, event) {
    const { path } = this;
    this.path = [];
    $("drawn").replaceChildren();
    if (!to) return;
    const how = this.how(event);
    if (this.tool === "box") this.draw(corners(from, to), "inside", how);
    else if (this.tool === "lasso" && path.length > 2) this.draw(path, "inside", how);
    else if (this.tool === "brush") this.draw(path, "along", how);
    else if (this.tool === "strokes") this.stroke(path, !event.ctrlKey && !event.metaKey);
    else this.click(to, true, event);
  }

  /** Selects what is drawn over the image, px of the stage. */
  draw(path, shape, how) {
    const places = thinned(path).map((at) => this.stage.place(...at));
    const region = { shape, points: places, radius: Number($("chosen-size").value) * this.stage.scale() };
    this.send({ select: "draw", from: this.from, region, through: $("chosen-through").checked, how });
  }
}

const corners = ([x0, y0], [x1, y1]) => [[x0, y0], [x1, y0], [x1, y1], [x0, y1]];

/** At most 400 points of a line, so that a message stays small. */
function thinned(path) {
  const step = Math.ceil(path.length / 400);
  return path.filter((_, index) => index % step === 0 || index === path.length - 1);
}
