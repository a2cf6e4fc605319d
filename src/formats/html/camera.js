// The camera: it turns around a pivot, upright. World axes are those of the SPZ: x right, y up, z back.

const FIELD = 50 * Math.PI / 180;
const FLIP = [1, -1, -1]; // from the axes of scenes: x right, y down, z forward

const cross = ([a, b, c], [d, e, f]) => [b * f - c * e, c * d - a * f, a * e - b * d];
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const unit = (a) => a.map((value) => value / Math.hypot(...a));
const middle = (values) => values.sort()[values.length >> 1];

class Camera {
  constructor(positions, { origin, view }) {
    this.origin = origin;
    this.up = unit(view?.up ?? [0, 1, 0]);
    // Two axes across up; with y up they are x and z.
    this.across = unit(Math.abs(this.up[2]) < 0.9 ? cross(this.up, [0, 0, 1]) : cross([0, 1, 0], this.up));
    this.back = cross(this.across, this.up);
    const count = positions.length / 3;
    const step = Math.max(1, Math.floor(count / 20000));
    const rows = Array.from({ length: Math.ceil(count / step) }, (_, at) => at * step);
    const column = (axis) => Float32Array.from(rows, (row) => positions[3 * row + axis]);
    const pivot = [0, 1, 2].map((axis) => middle(column(axis)));
    const far = Float32Array.from(rows, (row) => Math.hypot(...[0, 1, 2].map((axis) => positions[3 * row + axis] - pivot[axis])));
    far.sort();
    const distance = 2.2 * Math.max(far[Math.floor(0.6 * far.length)], 1e-3);
    this.first = { pivot, distance, yaw: 0.5, pitch: 0.35 };
    this.reset();
    if (view) {
      // As the first photo sees it, but no farther than a small model needs.
      const gap = pivot.map((value, axis) => value - view.eye[axis]);
      this.face(unit(gap));
      this.first = { pivot, distance: Math.min(distance, Math.hypot(...gap)), yaw: this.yaw, pitch: this.pitch };
      this.reset();
    }
  }

  // Looks along a direction, upright.
  face(forward) {
    this.yaw = Math.atan2(-dot(forward, this.across), -dot(forward, this.back));
    this.pitch = Math.asin(Math.max(-1, Math.min(1, -dot(forward, this.up))));
  }

  reset() {
    Object.assign(this, structuredClone(this.first));
    this.exact = null;
  }

  // Takes a camera of `labelgs render --camera` as it is.
  take({ w2c, fx, fy, cx, cy, W, H }) {
    const turn = w2c.slice(0, 3).map((row) => [0, 1, 2].map((axis) => row[axis] * FLIP[axis]));
    const shift = w2c.slice(0, 3).map((row) => row[3] + dot(row.slice(0, 3), this.origin));
    if (![...turn.flat(), ...shift, fx, fy, cx, cy, W, H].every(Number.isFinite)) throw new Error('The camera in the address is none.');
    this.exact = { turn, shift, lens: [fx, fy, cx, cy], size: [W, H] };
    const eye = [0, 1, 2].map((axis) => -turn.reduce((sum, row, at) => sum + row[axis] * shift[at], 0));
    const forward = turn[2];
    this.distance = Math.max(0.1 * this.distance, dot(this.pivot.map((value, axis) => value - eye[axis]), forward));
    this.pivot = eye.map((value, axis) => value + this.distance * forward[axis]);
    this.face(forward);
  }

  axes() {
    const [sine, cosine] = [Math.sin(this.pitch), Math.cos(this.pitch)];
    const parts = [-Math.sin(this.yaw) * cosine, -sine, -Math.cos(this.yaw) * cosine];
    const forward = [0, 1, 2].map((axis) => parts[0] * this.across[axis] + parts[1] * this.up[axis] + parts[2] * this.back[axis]);
    const right = unit(cross(forward, this.up));
    return [right, cross(forward, right), forward];
  }

  // The camera for a picture of a size.
  at(width, height) {
    if (this.exact) return this.exact;
    const turn = this.axes();
    const eye = this.pivot.map((value, axis) => value - this.distance * turn[2][axis]);
    const focal = 0.5 * Math.min(width, height) / Math.tan(0.5 * FIELD);
    return { turn, shift: turn.map((row) => -dot(row, eye)), lens: [focal, focal, 0.5 * width, 0.5 * height], size: [width, height] };
  }

  orbit(x, y) {
    this.exact = null;
    this.yaw -= x;
    this.pitch = Math.max(-1.55, Math.min(1.55, this.pitch + y));
  }

  // Moves the pivot across by parts of the distance.
  pan(x, y) {
    this.exact = null;
    const [right, down] = this.axes();
    this.pivot = this.pivot.map((value, axis) => value - this.distance * (x * right[axis] + y * down[axis]));
  }

  zoom(factor) {
    this.exact = null;
    this.distance = Math.max(1e-4, this.distance * factor);
  }
}
