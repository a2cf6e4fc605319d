// A camera path through keyframes: recorded, played, and saved for render --path.

import { $, el, toast } from "./dom.js";
import { add, length, orthonormal, scale, sub } from "/algebra.js";

/** Seconds from a keyframe to the next one. */
const SECONDS_PER_KEYFRAME = 2;
const FRAMES_PER_SECOND = 30;

export class CameraPath {
  /** `moved` is called when the camera has moved. */
  constructor(rig, moved) {
    Object.assign(this, { rig, moved, frames: [], playing: null, title: "MODEL" });
    $("path-add").addEventListener("click", () => this.add());
    $("path-play").addEventListener("click", () => this.play());
    $("path-save").addEventListener("click", () => this.save());
    this.render();
  }

  /** Takes the present camera, which is free from then on. */
  add() {
    const { rig } = this;
    rig.free();
    const [width, height] = this.size ?? rig.size.map((side) => side - (side % 2));
    this.size = [width, height];
    this.frames.push({ file: rig.file(width, height), centre: rig.centre, rows: rig.rows, focal: rig.focal, pivot: rig.pivot });
    this.moved();
    this.render();
  }

  take(index) {
    this.frames.splice(index, 1);
    if (this.frames.length === 0) this.size = null;
    this.render();
  }

  show({ centre, rows, focal, pivot }) {
    this.rig.free();
    Object.assign(this.rig, { centre, rows, focal, pivot, offset: [0, 0] });
    this.moved();
  }

  play() {
    if (this.playing !== null || this.frames.length < 2) return this.stop();
    const start = performance.now();
    const turn = (now) => {
      const at = (now - start) / 1000 / SECONDS_PER_KEYFRAME;
      this.show(this.at(Math.min(at, this.frames.length - 1)));
      this.playing = at < this.frames.length - 1 ? requestAnimationFrame(turn) : null;
      this.render();
    };
    this.playing = requestAnimationFrame(turn);
    return undefined;
  }

  stop() {
    if (this.playing !== null) cancelAnimationFrame(this.playing);
    this.playing = null;
    this.render();
  }

  /** The camera at a number of a keyframe or between two. */
  at(place) {
    const first = Math.min(Math.floor(place), this.frames.length - 2);
    const share = place - first;
    const around = [-1, 0, 1, 2].map((step) => this.frames[Math.max(0, Math.min(this.frames.length - 1, first + step))]);
    const rows = orthonormal([0, 1, 2].map((row) => [0, 1, 2].map((axis) => smooth(around.map((frame) => frame.rows[row][axis]), share))));
    return {
      centre: along(around.map((frame) => frame.centre), share),
      rows,
      focal: around[1].focal.map((value, axis) => value + share * (around[2].focal[axis] - value)),
      pivot: add(scale(around[1].pivot, 1 - share), scale(around[2].pivot, share)),
    };
  }

  save() {
    if (this.frames.length === 0) return;
    const keyframes = this.frames.map(({ file }, index) => ({ time: index * SECONDS_PER_KEYFRAME, camera: file }));
    const text = JSON.stringify({ schema_version: 1, fps: FRAMES_PER_SECOND, keyframes });
    const href = URL.createObjectURL(new Blob([text], { type: "application/json" }));
    const link = el("a", { href, download: "camera-path.json" });
    document.body.append(link);
    link.click();
    link.remove();
    setTimeout(() => URL.revokeObjectURL(href), 10000);
    toast(`labelgs render ${this.title} --path camera-path.json -o clip.mp4`);
  }

  render() {
    const { frames } = this;
    const chip = (_, index) => {
      const made = el("button", { type: "button", textContent: `${index + 1} ×`, title: `Remove keyframe ${index + 1}` });
      made.addEventListener("click", () => this.take(index));
      return made;
    };
    $("path-frames").replaceChildren(...frames.map(chip));
    $("path-play").textContent = this.playing === null ? "Play" : "Stop";
    $("path-play").disabled = frames.length < 2;
    $("path-save").disabled = frames.length === 0;
  }
}

/** A uniform Catmull-Rom spline from the second of four numbers to the third. */
function smooth([a, b, c, d], t) {
  return b + 0.5 * t * (c - a + t * (2 * a - 5 * b + 4 * c - d + t * (3 * (b - c) + d - a)));
}

/** A Catmull-Rom spline (centripetal) from the second of four points to the third. */
function along(points, share) {
  const knots = [0];
  for (let index = 1; index < 4; index += 1) {
    knots.push(knots[index - 1] + Math.max(Math.sqrt(length(sub(points[index], points[index - 1]))), 1e-6));
  }
  const t = knots[1] + share * (knots[2] - knots[1]);
  const mix = (a, b, from, to) => add(scale(a, (to - t) / (to - from)), scale(b, (t - from) / (to - from)));
  const [a1, a2, a3] = [0, 1, 2].map((i) => mix(points[i], points[i + 1], knots[i], knots[i + 1]));
  const b1 = mix(a1, a2, knots[0], knots[2]);
  const b2 = mix(a2, a3, knots[1], knots[3]);
  return mix(b1, b2, knots[1], knots[2]);
}
