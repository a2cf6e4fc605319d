// The label of each pixel of the image, and outlines of labels.

/** Colours of the outline of the selection, and of the label below the pointer, little-endian RGBA. */
const OUTLINE_RGBA = 0xff3dc4ff;
const HOVER_RGBA = 0x38ffffff;

export class LabelMap {
  /** Takes the labels of an image whose channels are their bytes. */
  constructor(image) {
    const { width, height } = image;
    const context = new OffscreenCanvas(width, height).getContext("2d", { willReadFrequently: true });
    context.drawImage(image, 0, 0);
    const words = new Uint32Array(context.getImageData(0, 0, width, height).data.buffer);
    Object.assign(this, { width, height, ids: words.map((word) => word & 0xffffff) });
  }

  /** The label at a share of width and height. */
  at(x, y) {
    const column = Math.min(Math.floor(x * this.width), this.width - 1);
    const row = Math.min(Math.floor(y * this.height), this.height - 1);
    return this.ids[row * this.width + column];
  }

  /** A clear image with a line just inside of the contour of some labels, and a glow over one; null if it is empty. */
  drawn(marked, hovered) {
    const { width, height, ids } = this;
    const isMarked = new Set(marked);
    if (isMarked.size === 0 && hovered === null) return null;
    const pixels = new Uint32Array(width * height);
    const thick = Math.max(1, Math.round(width / 500));
    let known = -1;
    let isInside = false;
    const inside = (at) => {
      if (ids[at] !== known) {
        known = ids[at];
        isInside = isMarked.has(known);
      }
      return isInside;
    };
    for (let y = 0, at = 0; y < height; y += 1) {
      for (let x = 0; x < width; x += 1, at += 1) {
        if (ids[at] === hovered) pixels[at] = HOVER_RGBA;
        if (isMarked.size === 0 || !inside(at)) continue;
        const id = ids[at];
        const isEdge = x < thick || y < thick || x >= width - thick || y >= height - thick
          || (ids[at - thick] !== id && !isMarked.has(ids[at - thick])) || (ids[at + thick] !== id && !isMarked.has(ids[at + thick]))
          || (ids[at - thick * width] !== id && !isMarked.has(ids[at - thick * width]))
          || (ids[at + thick * width] !== id && !isMarked.has(ids[at + thick * width]));
        if (isEdge) pixels[at] = OUTLINE_RGBA;
      }
    }
    const canvas = new OffscreenCanvas(width, height);
    canvas.getContext("2d").putImageData(new ImageData(new Uint8ClampedArray(pixels.buffer), width, height), 0, 0);
    return canvas;
  }
}
