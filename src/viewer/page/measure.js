// Distances between surface points, and sizes of objects.

import { $, ask, el } from "./dom.js";
import { add, length, scale, sub, toWorld } from "/algebra.js";

export class Measuring {
  /** `pick` asks what is at a point of the stage. */
  constructor(stage, rig, pick) {
    Object.assign(this, { stage, rig, pick, points: [], boxes: [], unit: 1, isScaled: false });
  }

  choose(isOn) {
    this.isOn = isOn;
    if (!isOn) this.points = [];
    this.render();
  }

  click(at) {
    this.pick(at, ({ depth, gaussian }) => {
      if (gaussian === null || !(depth > 0)) return;
      if (this.points.length === 2) this.points = [];
      const camera = this.rig.file();
      const [x, y] = this.stage.place(...at);
      const rows = camera.w2c.slice(0, 3).map((row) => row.slice(0, 3));
      const move = camera.w2c.slice(0, 3).map((row) => row[3]);
      const inCamera = scale([(x - camera.cx) / camera.fx, (y - camera.cy) / camera.fy, 1], depth);
      this.points.push(toWorld(rows, sub(inCamera, move)));
      this.render();
    });
  }

  drag() {}

  box(from, to) { if (to) this.click(to); }

  get distance() { return this.points.length === 2 ? length(sub(...this.points)) : null; }

  async setLength() {
    const { distance } = this;
    const said = await ask("Set the scale", "Enter the length of this line in metres. The page then shows all lengths in metres; the model does not change.", "Set", "");
    const metres = Number(said);
    if (said === null || !(metres > 0) || !(distance > 0)) return;
    this.unit = metres / distance;
    this.isScaled = true;
    this.render();
    this.setBoxes(this.boxes);
  }

  /** A length in world units as text. */
  told(value) { return `${(value * this.unit).toPrecision(4)} ${this.isScaled ? "m" : "units"}`; }

  /** The size of an object as text. */
  size({ sizes, volume }) {
    const number = (value) => Number(value.toPrecision(3));
    const name = this.isScaled ? "m" : "units";
    return `${sizes.map((side) => number(side * this.unit)).join(" × ")} ${name}, volume ${number(volume * this.unit ** 3)}`;
  }

  /** Takes the boxes of the selected objects, which are drawn with the tool. */
  setBoxes(boxes) {
    this.boxes = boxes;
    $("selection-size").textContent = boxes.length === 1 ? this.size(boxes[0]) : "";
    this.draw();
  }

  render() {
    $("measure").hidden = !this.isOn;
    const { distance } = this;
    const button = el("button", { type: "button", textContent: "Set length …", title: "Set the scale from a known length" });
    button.addEventListener("click", () => this.setLength());
    const text = distance === null ? ["Click the first point", "Click the second point"][this.points.length] : this.told(distance);
    const cure = this.isScaled ? [el("code", { textContent: `labelgs transform MODEL --scale ${this.unit.toPrecision(5)} -o metres.ply` })] : [];
    $("measure").replaceChildren(el("span", { textContent: text }), ...(distance === null ? [] : [button, ...cure]));
    this.draw();
  }

  /** Draws the line and the boxes over the image. */
  draw() {
    const lines = this.isOn ? [this.points, ...this.boxes.flatMap(edges)] : [];
    if (lines.length === 0 && this.stage.lines.length === 0) return;
    this.stage.lines = lines.map((line) => line.map((point) => this.stage.seen(point)).filter(Boolean));
    this.stage.paint();
  }
}

/** The twelve edges of a box along the axes of an object. */
function edges({ centre, axes, sizes }) {
  const corner = (index) => axes.reduce((at, axis, side) => add(at, scale(axis, (index >> side & 1 ? 0.5 : -0.5) * sizes[side])), centre);
  const pairs = [0, 1, 2].flatMap((side) => [0, 1, 2, 3, 4, 5, 6, 7].filter((index) => !(index >> side & 1)).map((index) => [index, index | 1 << side]));
  return pairs.map(([a, b]) => [corner(a), corner(b)]);
}
