// The camera: a view of the scene exactly, or free around a pivot.

import { add, cross, dot, length, looking, orthonormal, scale, sub, toWorld, turned, unit } from "./algebra.js";

/** Minimum angle between the view direction and the up axis, radians. */
const POLE_ANGLE_MIN = 0.03;
/** Field of view where no view gives one: focal length in heights of the image. */
const FOCAL_IN_HEIGHTS = 1.0;

export class Rig {
  constructor() {
    this.views = [];
    this.view = null;
    this.up = [0, -1, 0];
    this.target = [0, 0, 0];
    this.distance = 1;
    this.rows = [[1, 0, 0], [0, 1, 0], [0, 0, 1]];
    this.centre = [0, 0, -3];
    this.pivot = [0, 0, 0];
    // Focal lengths and offset of the principal point, in heights of the image.
    this.focal = [FOCAL_IN_HEIGHTS, FOCAL_IN_HEIGHTS];
    this.offset = [0, 0];
    this.size = [640, 480];
    this.speed = 1;
  }

  /** Takes the scene over, and its first camera unless there is one already. */
  reset(scene, keep) {
    this.views = scene.views;
    this.target = scene.target;
    this.distance = scene.distance;
    this.from = scene.from;
    if (keep) return;
    this.up = unit(scene.up, [0, -1, 0]);
    this.home();
  }

  /** The first camera: the first test view, or one that sees the whole model, from where the scene says or from above. */
  home() {
    const first = this.views.findIndex((view) => view.test);
    if (this.views.length > 0) return this.snap(Math.max(first, 0));
    const side = unit(cross(this.up, Math.abs(this.up[0]) < 0.9 ? [1, 0, 0] : [0, 0, 1]));
    const away = unit(this.from ?? add(add(side, scale(cross(side, this.up), 0.4)), scale(this.up, 0.35)));
    const focal = FOCAL_IN_HEIGHTS * Math.min(1, this.size[0] / this.size[1]);
    this.view = null;
    this.focal = [focal, focal];
    this.offset = [0, 0];
    this.pivot = this.target;
    this.centre = add(this.target, scale(away, this.distance));
    this.rows = looking(sub(this.target, this.centre), this.up);
  }

  /** Takes the camera of a view exactly. */
  snap(index) {
    const { camera } = this.views[index];
    this.view = index;
    const rows = camera.w2c.slice(0, 3).map((row) => row.slice(0, 3));
    const move = camera.w2c.slice(0, 3).map((row) => row[3]);
    this.rows = rows;
    this.centre = scale(toWorld(rows, move), -1);
    const ahead = dot(sub(this.target, this.centre), rows[2]);
    this.pivot = add(this.centre, scale(rows[2], ahead > 0.05 * this.distance ? ahead : this.distance));
  }

  /** Size and place of the image of a view in the stage, px. */
  placed(camera, [width, height] = this.size) {
    const fit = Math.min(width / camera.W, height / camera.H);
    return { x: (width - camera.W * fit) / 2, y: (height - camera.H * fit) / 2, fit };
  }

  /** Makes the camera free; the image stays where it is. */
  free() {
    if (this.view === null) return;
    const { camera } = this.views[this.view];
    const { x, y, fit } = this.placed(camera);
    const [width, height] = this.size;
    this.focal = [camera.fx * fit / height, camera.fy * fit / height];
    this.offset = [(x + camera.cx * fit - width / 2) / height, (y + camera.cy * fit - height / 2) / height];
    this.rows = orthonormal(this.rows);
    this.view = null;
  }

  /** Turns around the pivot, or in flight around the camera, by angles. */
  orbit(right, down, isFlight) {
    this.free();
    const about = isFlight ? this.centre : this.pivot;
    const arm = sub(this.centre, about);
    // Up and down end before the poles, where left and right would swap.
    const tilt = Math.acos(Math.max(-1, Math.min(1, dot(this.rows[2], this.up))));
    const pitch = Math.max(tilt - Math.PI + POLE_ANGLE_MIN, Math.min(tilt - POLE_ANGLE_MIN, -down));
    const side = this.rows[0];
    const turn = (v) => turned(turned(v, side, pitch), this.up, -right);
    this.rows = orthonormal(this.rows.map(turn));
    this.centre = add(about, turn(arm));
  }

  /** Pans by px of the stage, so that the pivot follows the pointer. */
  pan(dx, dy) {
    this.free();
    const depth = Math.max(dot(sub(this.pivot, this.centre), this.rows[2]), 0.02 * this.distance);
    const step = depth / (this.focal[0] * this.size[1]);
    const move = add(scale(this.rows[0], -dx * step), scale(this.rows[1], -dy * step));
    this.centre = add(this.centre, move);
    this.pivot = add(this.pivot, move);
  }

  /** Zooms: factors below 1 move the camera closer to the pivot. */
  dolly(factor) {
    this.free();
    const arm = sub(this.centre, this.pivot);
    const far = Math.min(Math.max(length(arm) * factor, 1e-4 * this.distance), 1e3 * this.distance);
    this.centre = add(this.pivot, scale(unit(arm, scale(this.rows[2], -1)), far));
  }

  /** Moves right, down and forward in seconds of flight. */
  fly([right, down, forward], seconds) {
    this.free();
    const step = 0.6 * this.distance * this.speed * seconds;
    const move = toWorld(this.rows, [right * step, down * step, forward * step]);
    this.centre = add(this.centre, move);
    this.pivot = add(this.pivot, move);
  }

  /** Sets the pivot to what is at a pixel of the stage, at this depth. */
  pivotAt([x, y], depth) {
    if (!(depth > 0)) return;
    this.free();
    const [width, height] = this.size;
    const ray = [
      (x - width / 2 - this.offset[0] * height) / (this.focal[0] * height),
      (y - height / 2 - this.offset[1] * height) / (this.focal[1] * height),
      1,
    ];
    this.pivot = add(this.centre, toWorld(this.rows, scale(ray, depth)));
  }

  /** Moves so that a box fills the image. */
  frame(min, max) {
    this.free();
    const middle = scale(add(min, max), 0.5);
    const radius = Math.max(length(sub(max, min)) / 2, 1e-3 * this.distance);
    const [width, height] = this.size;
    const half = Math.min(1, width / height) / (2 * this.focal[1]);
    this.pivot = middle;
    this.offset = [0, 0];
    this.centre = sub(middle, scale(this.rows[2], 1.15 * radius / Math.sin(Math.atan(half))));
  }

  /** Uses the top of the image as the up direction. */
  level() {
    this.up = scale(this.rows[1], -1);
  }

  /** The free camera for an image of this size, as `render --camera` reads it. */
  file(width = this.size[0], height = this.size[1]) {
    if (this.view !== null) return this.views[this.view].camera;
    const move = this.rows.map((row) => -dot(row, this.centre));
    return {
      w2c: [...this.rows.map((row, axis) => [...row, move[axis]]), [0, 0, 0, 1]],
      fx: this.focal[0] * height,
      fy: this.focal[1] * height,
      cx: width / 2 + this.offset[0] * height,
      cy: height / 2 + this.offset[1] * height,
      W: width,
      H: height,
    };
  }
}
