// The tool that finds an object: clicks and a box in the image, results, keep and discard.

import { $, counted, duration } from "./dom.js";

export class Finding {
  /** `changed` is called when another object is to be marked, or the tool is chosen or left. */
  constructor(link, stage, rig, changed) {
    Object.assign(this, { link, stage, rig, changed, isOn: false, state: null });
    $("object").addEventListener("submit", (event) => { event.preventDefault(); this.keep(); });
    $("object").addEventListener("keydown", (event) => { if (event.key === "Escape") this.drop(); });
    $("object-drop").addEventListener("click", () => this.drop());
    this.render();
  }

  /** Activates or deactivates the tool. A pending object stays until it is kept or discarded. */
  choose(isOn) {
    this.isOn = isOn;
    this.render();
  }

  /** An object is looked for or shown. */
  get isThere() { return Boolean(this.state && (this.state.asked || this.state.count !== null)); }

  /** The label that the object is drawn with. */
  get mark() { return this.state?.label ?? null; }

  send(what) { this.link.send({ kind: "object", what }); }

  get from() { return this.rig.view === null ? { camera: this.rig.file() } : { view: this.rig.view }; }

  click(at, on) {
    const pixel = this.stage.pixel(...at);
    if (pixel) this.send({ object: "click", from: this.from, pixel, on });
  }

  /** Shows the box of a drag. */
  drag(from, to) {
    const least = [0, 1].map((axis) => Math.min(from[axis], to[axis]));
    const size = [0, 1].map((axis) => Math.abs(from[axis] - to[axis]));
    const { style } = $("object-box");
    $("object-box").hidden = false;
    [style.left, style.top, style.width, style.height] = [...least, ...size].map((side) => `${side}px`);
  }

  /** Ends a drag, or cancels it without `to`. */
  box(from, to) {
    $("object-box").hidden = true;
    const [a, b] = [from, to].map((at) => at && this.stage.pixel(...at, true));
    if (!a || !b) return;
    const corners = [...a.map((x, axis) => Math.min(x, b[axis])), ...a.map((x, axis) => Math.max(x, b[axis]))];
    if (corners[0] < corners[2] && corners[1] < corners[3]) this.send({ object: "box", from: this.from, corners });
  }

  keep() {
    if (this.state && this.state.count !== null) this.send({ object: "keep", name: $("object-name").value });
  }

  drop() {
    if (this.isThere) this.send({ object: "drop" });
  }

  setState(state) {
    const wasThere = this.isThere;
    this.state = state;
    if (wasThere && !this.isThere) {
      $("object-name").value = "";
      if ($("object").contains(document.activeElement)) this.stage.box.focus({ preventScroll: true });
    }
    this.render();
    this.changed();
  }

  render() {
    const { asked, count, first } = this.state ?? { asked: null, count: null };
    const has = count !== null;
    $("object").hidden = !this.isOn && !this.isThere;
    $("object-progress").hidden = !asked;
    for (const id of ["object-name", "object-keep"]) $(id).hidden = !has;
    $("object-drop").hidden = !this.isThere;
    const parts = [];
    if (has) parts.push(`${counted(count, "Gaussian")}${asked && first ? " so far" : ""}`);
    if (asked) {
      $("object-progress").style.setProperty("--share", asked.all ? asked.done / asked.all : 0);
      parts.push(asked.all ? `checked ${asked.done} of ${counted(asked.all, "photo")}` : "searching");
      if (asked.left) parts.push(`about ${duration(asked.left)} left for photos that the network has not processed yet`);
    }
    if (parts.length === 0) parts.push("Click an object, or drag a box around it");
    else if (has && !asked) parts.push("click adds · right click excludes");
    $("object-text").textContent = parts.join(" · ");
  }
}
