// The model in the page: an SPZ of version 3, as a texture of whole numbers.

const MAGIC = 0x5053474e;
const LABELS_EXTENSION = 0x4c470001;
// Texels of a Gaussian: place and label; covariance, colour and opacity; harmonics.
const TEXELS_PER_GAUSSIAN = 3;
const TEXELS_OF_HARMONICS = 3;

async function unpacked(bytes, kind) {
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream(kind));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

function bytesOf(text) {
  const plain = atob(text);
  return Uint8Array.from({ length: plain.length }, (_, at) => plain.charCodeAt(at));
}

// Sets what the records say about labels: the id of each Gaussian.
async function labelsOf(file, at, count) {
  const view = new DataView(file.buffer, file.byteOffset);
  while (at + 8 <= file.length) {
    const [kind, length] = [view.getUint32(at, true), view.getUint32(at + 4, true)];
    if (kind === LABELS_EXTENSION) {
      const [width, size] = [file[at + 16], view.getUint32(at + 20, true)];
      const packed = file.subarray(at + 24, at + 24 + size);
      const ids = await unpacked(packed, 'deflate');
      return Uint32Array.from({ length: count }, (_, row) => {
        let id = 0;
        for (let byte = width - 1; byte >= 0; byte--) id = id * 256 + ids[row * width + byte];
        return id;
      });
    }
    at += 8 + length;
  }
  return new Uint32Array(count);
}

// The covariance of a Gaussian from the logarithms of its sizes and its rotation in four bytes.
function covariance(scales, packed) {
  const largest = packed >>> 30;
  const spin = [0, 0, 0, 0];
  let squares = 0;
  for (let at = 3; at >= 0; at--) {
    if (at === largest) continue;
    const size = ((packed & 511) / 511) * Math.SQRT1_2;
    spin[at] = (packed >>> 9) & 1 ? -size : size;
    squares += size * size;
    packed >>>= 10;
  }
  spin[largest] = Math.sqrt(Math.max(0, 1 - squares));
  const [x, y, z, w] = spin;
  const axes = [
    [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
    [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
    [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
  ];
  const squared = scales.map((scale) => Math.exp(2 * scale));
  const entry = (i, j) => squared.reduce((sum, square, k) => sum + axes[i][k] * square * axes[j][k], 0);
  return [entry(0, 0), entry(0, 1), entry(0, 2), entry(1, 1), entry(1, 2), entry(2, 2)];
}

// Reads the model. `rowOf` is the row in the list of labels for each id.
async function decode(text, rowOf, texelsMax) {
  const file = await unpacked(bytesOf(text), 'gzip');
  const view = new DataView(file.buffer);
  if (view.getUint32(0, true) !== MAGIC || view.getUint32(4, true) !== 3) throw new Error('The model in this page is damaged.');
  const [count, degree, unit, antialiased] = [view.getUint32(8, true), file[12], 2 ** -file[13], file[14] & 1];
  const bands = (degree + 1) ** 2 - 1;
  let end = 16;
  const [places, alphas, colours, scales, spins, harmonics] = [9, 1, 3, 3, 4, 3 * bands].map((width) => {
    const start = end;
    end += width * count;
    return { start, width };
  });
  const ids = await labelsOf(file, end, count);

  const stride = TEXELS_PER_GAUSSIAN + (bands > 0 ? TEXELS_OF_HARMONICS : 0);
  const width = Math.floor(texelsMax / stride) * stride;
  const height = Math.ceil((count * stride) / width);
  const words = new Uint32Array(width * height * 4);
  const numbers = new Float32Array(words.buffer);
  const octets = new Uint8Array(words.buffer);
  const positions = new Float32Array(3 * count);
  const rows = new Uint32Array(count);
  for (let row = 0; row < count; row++) {
    const base = row * stride * 4;
    for (let axis = 0; axis < 3; axis++) {
      const at = places.start + row * 9 + axis * 3;
      const steps = ((file[at] << 8) | (file[at + 1] << 16) | (file[at + 2] << 24)) >> 8;
      positions[3 * row + axis] = steps * unit;
      numbers[base + axis] = steps * unit;
    }
    rows[row] = rowOf.get(ids[row]) ?? 0;
    words[base + 3] = rows[row];
    const sizes = [0, 1, 2].map((axis) => file[scales.start + row * 3 + axis] / 16 - 10);
    numbers.set(covariance(sizes, view.getUint32(spins.start + row * 4, true)), base + 4);
    octets.set(file.subarray(colours.start + row * 3, colours.start + row * 3 + 3), 4 * base + 40);
    octets[4 * base + 43] = file[alphas.start + row];
    octets.set(file.subarray(harmonics.start + row * harmonics.width, harmonics.start + (row + 1) * harmonics.width), 4 * base + 48);
  }
  return { count, degree, antialiased, stride, width, height, words, positions, rows };
}
