// Distances between two points of the surface.

import { $, ask, el } from "./dom.js";
import { length, scale, sub, toWorld } from "/algebra.js";

export class Measuring {
  /** `pick` asks what is at a point of the stage. */
  constructor(stage, rig, pick) {
    Object.assign(this, { stage, rig, pick, points: [], unit: 1, isScaled: false });
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
    const said = await ask("How long is that?", "A length in metres. All lengths are then shown in metres; the model stays as it is.", "Set", "");
    const metres = Number(said);
    if (said === null || !(metres > 0) || !(distance > 0)) return;
    this.unit = metres / distance;
    this.isScaled = true;
    this.render();
  }

  /** A length in world units as text. */
  told(value) {
    const shown = value * this.unit;
    return this.isScaled ? `${shown.toPrecision(4)} m` : `${shown.toPrecision(4)} units`;
  }

  render() {
    $("measure").hidden = !this.isOn;
    const { distance } = this;
    const button = el("button", { type: "button", textContent: "That is …", title: "Set the scale by a known length" });
    button.addEventListener("click", () => this.setLength());
    const text = distance === null ? ["Click on the first point", "Click on the second point"][this.points.length] : this.told(distance);
    const cure = this.isScaled ? [el("code", { textContent: `labelgs transform MODEL --scale ${this.unit.toPrecision(5)} -o metres.ply` })] : [];
    $("measure").replaceChildren(el("span", { textContent: text }), ...(distance === null ? [] : [button, ...cure]));
    this.draw();
  }

  /** Draws the line over the picture. */
  draw() {
    if (!this.isOn) return;
    const seen = this.points.map((point) => this.stage.seen(point)).filter(Boolean);
    this.stage.line = seen;
    this.stage.paint();
  }
}
