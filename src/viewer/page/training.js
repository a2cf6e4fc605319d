// A running training: progress, curves and controls.

import { $, ask, bytes, duration, el, number, svg, toast } from "./dom.js";

const CHARTS = [["loss", "Loss", ""], ["label", "Label loss", "second"], ["gaussians", "Gaussians", "third"]];

export class Training {
  constructor(link) {
    Object.assign(this, { link, state: null });
    this.box = $("training");
    const value = () => el("div", { className: "value", textContent: "–" });
    this.values = { step: value(), left: value(), gaussians: value(), memory: value(), speed: value(), score: value() };
    const fact = (what, key) => el("div", {}, el("div", { className: "what", textContent: what }), this.values[key]);
    this.progress = el("div", { className: "progress", role: "progressbar", "aria-label": "Steps", "aria-valuemin": "0" }, el("i"));
    this.head = el("span", { className: "count" });
    const button = (text, what, title, isMain = false) => {
      const made = el("button", { type: "button", textContent: text, title, className: isMain ? "main" : "" });
      made.addEventListener("click", () => this.ask(what));
      return made;
    };
    this.pause = button("Pause", "pause", "Pause after this step (K)", true);
    this.save = button("Save now", "save", "Write a checkpoint now");
    this.stop = button("Stop and save", "stop", "Write the model and a checkpoint, then end the run");
    this.charts = Object.fromEntries(CHARTS.map(([key, name, kind]) => [key, chart(name, kind)]));
    this.share = el("input", { type: "range", min: 0, max: 90, step: 5, id: "view-share" });
    this.shown = el("output");
    this.share.addEventListener("input", () => {
      this.shown.textContent = `${this.share.value} %`;
      link.send({ kind: "share", share: Number(this.share.value) / 100 });
    });
    this.box.append(
      el("h2", {}, "Training ", this.head), this.progress,
      el("div", { className: "facts-grid" }, fact("Step", "step"), fact("Time left", "left"), fact("Gaussians", "gaussians"), fact("Device memory", "memory"), fact("Per step", "speed"), fact("Test PSNR", "score")),
      ...Object.values(this.charts).map((made) => made.box),
      el("div", { className: "row wrap" }, this.pause, this.save, this.stop),
      el("div", { className: "share" }, el("label", { htmlFor: "view-share", textContent: "Time for viewing", title: "Maximum share of time that viewing may take from training" }), this.share, this.shown),
    );
  }

  async ask(what) {
    if (!this.state) return;
    if (what === "stop") {
      const said = await ask("Stop training?", "labelgs writes the model and a checkpoint. Run the command again with --resume to continue.", "Stop and save");
      if (said === null) return;
    }
    const isPaused = this.state.paused;
    this.link.send({ kind: "train", what: what === "pause" && isPaused ? "resume" : what });
    if (what === "stop") toast("Training stops after this step.");
  }

  setState(state) {
    this.state = state;
    this.box.hidden = false;
    const share = state.steps > 0 ? state.step / state.steps : 0;
    this.progress.firstChild.style.setProperty("--share", share.toFixed(4));
    this.progress.setAttribute("aria-valuenow", String(Math.round(100 * share)));
    this.head.textContent = state.paused ? "paused" : `${Math.floor(100 * share)} %`;
    const { step, left, gaussians, memory, speed } = this.values;
    step.textContent = `${number(state.step)} of ${number(state.steps)}`;
    left.textContent = state.paused ? "paused" : duration(state.left);
    gaussians.textContent = number(state.gaussians);
    memory.textContent = bytes(state.memory);
    speed.textContent = `${state.stepMs.toFixed(state.stepMs < 20 ? 1 : 0)} ms`;
    this.pause.textContent = state.paused ? "Resume" : "Pause";
    this.pause.title = state.paused ? "Resume training (K)" : "Pause after this step (K)";
    if (document.activeElement !== this.share) {
      this.share.value = Math.round(100 * state.share);
      this.shown.textContent = `${this.share.value} %`;
    }
  }

  setScores({ rows }, views) {
    const tests = rows.filter((row, index) => views[index]?.test && row[0] !== null).map((row) => row[0]);
    this.values.score.textContent = tests.length > 0 ? `${(tests.reduce((a, b) => a + b, 0) / tests.length).toFixed(2)} dB` : "–";
  }

  setCurve(curve) {
    for (const [key] of CHARTS) {
      const values = curve[key];
      const isEmpty = values.length < 2 || values.every((value) => value === 0);
      this.charts[key].box.hidden = isEmpty;
      if (!isEmpty) this.charts[key].draw(curve.steps, values, key === "gaussians");
    }
  }

  end() {
    for (const button of [this.pause, this.save, this.stop, this.share]) button.disabled = true;
    this.head.textContent = "done";
    this.values.left.textContent = "–";
  }
}

/** A curve with its newest value and its range. */
function chart(name, kind) {
  const line = svg("polyline");
  const now = el("span");
  const drawing = svg("svg", { viewBox: "0 0 100 46", preserveAspectRatio: "none", role: "img", "aria-label": name }, line);
  const box = el("div", { className: `chart ${kind}`, hidden: true }, el("div", { className: "head" }, el("span", { textContent: name }), now), drawing);
  const draw = (steps, values, isCount) => {
    // The first steps of a loss would flatten the rest.
    const kept = values.slice(Math.floor(values.length / 20));
    const [low, high] = [Math.min(...kept), Math.max(...kept)];
    const [first, last] = [steps[0], steps[steps.length - 1]];
    const x = (step) => (100 * (step - first) / Math.max(last - first, 1)).toFixed(2);
    const y = (value) => (43 - 40 * Math.max(0, Math.min(1, (value - low) / Math.max(high - low, 1e-12)))).toFixed(2);
    line.setAttribute("points", steps.map((step, index) => `${x(step)},${y(values[index])}`).join(" "));
    const newest = values[values.length - 1];
    now.textContent = isCount ? number(newest) : newest.toFixed(4);
  };
  return { box, draw };
}
