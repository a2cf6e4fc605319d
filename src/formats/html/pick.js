// Which object is seen at a point of the image.

// Light that gets past the Gaussians where nothing was hit, and where the rest no longer counts.
const MISSED_LIGHT_MIN = 0.5;
const LIGHT_MIN = 0.01;
// Square of the reach of an opaque Gaussian, in standard deviations.
const REACH_SQUARED = 2 * Math.log(255);

// Inverse covariance of a Gaussian in the image, as the shader has it: [xx, xy, yy]. Its numbers begin at `base`, its
// centre is at `p` of the camera.
function flattened(numbers, base, { turn, lens, size }, p) {
  const [xx, xy, xz, yy, yz, zz] = numbers.subarray(base, base + 6);
  const spread = [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]];
  const across = [0, 1].map((axis) => {
    const most = (0.65 * size[axis]) / lens[axis];
    const centre = (lens[2 + axis] - 0.5 * size[axis]) / lens[axis];
    const slope = Math.min(Math.max(p[axis] / p[2], -most - centre), most - centre);
    return scale(sub(turn[axis], scale(turn[2], slope)), lens[axis] / p[2]);
  });
  const [over, down] = across.map((v) => spread.map((line) => dot(line, v)));
  const [a, b, d] = [dot(across[0], over) + 0.3, dot(across[1], over), dot(across[1], down) + 0.3];
  const inverse = 1 / Math.max(a * d - b * b, 1e-12);
  return [d * inverse, -b * inverse, a * inverse];
}

// Returns the row of the label with the largest weight at a pixel of the last image; null where little is.
function picked({ model, camera, sorted, shown }, [x, y]) {
  const { positions, stride, rows } = model;
  const { turn, shift, lens } = camera;
  const numbers = new Float32Array(model.words.buffer);
  const octets = new Uint8Array(model.words.buffer);
  const along = (axis, at) => turn[axis][0] * positions[at] + turn[axis][1] * positions[at + 1] + turn[axis][2] * positions[at + 2] + shift[axis];
  const weights = new Map();
  let light = 1;
  for (let place = shown - 1; place >= 0 && light > LIGHT_MIN; place--) {
    const row = sorted[place];
    const [right, down, ahead] = [along(0, 3 * row), along(1, 3 * row), along(2, 3 * row)];
    const dx = (lens[0] * right) / ahead + lens[2] - x;
    const dy = (lens[1] * down) / ahead + lens[3] - y;
    // A bound first: no axis is longer than the sum of all, and oblique rays stretch it.
    const base = row * stride * 4;
    const sizes = numbers[base + 4] + numbers[base + 7] + numbers[base + 9];
    const zoom = (Math.max(lens[0], lens[1]) / ahead) ** 2 * (1 + (right * right + down * down) / (ahead * ahead));
    if (dx * dx + dy * dy > REACH_SQUARED * (0.3 + zoom * sizes)) continue;
    const [xx, xy, yy] = flattened(numbers, base + 4, camera, [right, down, ahead]);
    const fall = Math.exp(-0.5 * (xx * dx * dx + 2 * xy * dx * dy + yy * dy * dy));
    const alpha = Math.min(0.99, (octets[4 * base + 43] / 255) * fall);
    if (!(alpha >= 1 / 255)) continue;
    weights.set(rows[row], (weights.get(rows[row]) ?? 0) + light * alpha);
    light *= 1 - alpha;
  }
  if (light > MISSED_LIGHT_MIN) return null;
  return [...weights].reduce((best, one) => (one[1] > best[1] ? one : best))[0];
}
