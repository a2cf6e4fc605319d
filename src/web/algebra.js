// Vectors are arrays of 3; rotations are arrays of 3 rows, camera-from-world with OpenCV axes (x right, y down, z forward).

export const add = (a, b) => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
export const sub = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
export const scale = (a, s) => [a[0] * s, a[1] * s, a[2] * s];
export const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
export const length = (a) => Math.hypot(a[0], a[1], a[2]);
export const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];

/** A vector of length 1; `otherwise` for one without a direction. */
export function unit(a, otherwise = [0, 0, 1]) {
  const size = length(a);
  return size > 1e-12 && Number.isFinite(size) ? scale(a, 1 / size) : otherwise;
}

/** Turns a vector about an axis of length 1. */
export function turned(v, axis, angle) {
  const [c, s] = [Math.cos(angle), Math.sin(angle)];
  return add(add(scale(v, c), scale(cross(axis, v), s)), scale(axis, dot(axis, v) * (1 - c)));
}

/** The rotation nearest to rows that are almost one: z is kept. */
export function orthonormal(rows) {
  const z = unit(rows[2]);
  const x = unit(sub(rows[0], scale(z, dot(rows[0], z))), unit(cross([0, 1, 0], z), [1, 0, 0]));
  return [x, cross(z, x), z];
}

/** The rotation that looks along `forward` with `up` upwards. */
export function looking(forward, up) {
  const z = unit(forward);
  const right = cross(z, up);
  const x = length(right) > 1e-6 ? unit(right) : unit(cross(z, Math.abs(z[0]) < 0.9 ? [1, 0, 0] : [0, 1, 0]));
  return [x, cross(z, x), z];
}

/** A vector of the camera in the world. */
export const toWorld = (rows, v) => add(add(scale(rows[0], v[0]), scale(rows[1], v[1])), scale(rows[2], v[2]));
