// The image: draws frames, and asks for the next one when the camera or a control has changed.

import { $, choose } from "./dom.js";
import { LabelMap } from "./map.js";

export const PANES = [
  ["colour", "Colour"], ["labels", "Labels"], ["tinted", "Labels over colour"], ["depth", "Depth"],
  ["opacity", "Opacity"], ["confidence", "Confidence"], ["error", "Error against photo"],
];
const PANE_NAMES = Object.fromEntries(PANES);

/** Milliseconds after the last motion until the exact image is asked for. */
const STILL_AFTER_MS = 160;
/** Milliseconds between two images of a training that the camera rests on. */
const REFRESH_INTERVAL_MS = 900;
/** Most pixels of an image. */
const PIXELS_MAX = 8e6;

export class Stage {
  constructor(rig) {
    this.rig = rig;
    this.link = null;
    this.box = $("stage");
    this.canvas = $("canvas");
    this.context = this.canvas.getContext("2d");
    this.panes = ["colour", "labels"];
    this.layout = "one";
    this.photo = "off";
    this.isPhotoHeld = false;
    this.wipeAt = 0.5;
    this.images = [];
    // Labels with a line around them, the one below the pointer, and where each is in the image.
    this.mark = [];
    this.hovered = null;
    this.map = null;
    this.overlay = null;
    // Lines over the image, each as points, px of the canvas.
    this.lines = [];
    this.isExact = false;
    this.frame = null;
    this.photos = new Map();
    this.isTraining = false;
    this.asked = null;
    this.isDirty = true;
    this.moved = 0;
    this.isStill = false;
    this.onFrame = () => {};
    new ResizeObserver(() => this.resize()).observe(this.box);
    this.resize();
    this.wire();
    const turn = (now) => { this.tick(now); requestAnimationFrame(turn); };
    requestAnimationFrame(turn);
  }

  wire() {
    const wipe = $("wipe");
    const to = (x) => {
      const { left, width } = this.box.getBoundingClientRect();
      this.setWipe((x - left) / width);
    };
    wipe.addEventListener("pointerdown", (event) => { event.stopPropagation(); wipe.setPointerCapture(event.pointerId); });
    wipe.addEventListener("pointermove", (event) => { if (wipe.hasPointerCapture(event.pointerId)) to(event.clientX); });
    for (const kind of ["click", "dblclick", "wheel"]) wipe.addEventListener(kind, (event) => event.stopPropagation());
    wipe.addEventListener("keydown", (event) => {
      const step = { ArrowLeft: -0.02, ArrowRight: 0.02 }[event.key];
      if (!step) return;
      event.preventDefault();
      event.stopPropagation();
      this.setWipe(this.wipeAt + step);
    });
    this.setWipe(0.5);
  }

  setWipe(at) {
    this.wipeAt = Math.max(0, Math.min(1, at));
    $("wipe").style.left = `${100 * this.wipeAt}%`;
    $("wipe").setAttribute("aria-valuenow", String(Math.round(100 * this.wipeAt)));
    this.paint();
  }

  /** Pixels of the image: half of the stage for two side by side. */
  resize() {
    const ratio = Math.min(window.devicePixelRatio || 1, 2);
    const { clientWidth, clientHeight } = this.box;
    if (clientWidth === 0 || clientHeight === 0) return;
    this.canvas.width = Math.max(1, Math.round(clientWidth * ratio));
    this.canvas.height = Math.max(1, Math.round(clientHeight * ratio));
    const columns = this.isPair ? 2 : 1;
    const size = [Math.max(2, Math.floor(this.canvas.width / columns)), Math.max(2, this.canvas.height)];
    const shrink = Math.min(1, Math.sqrt(PIXELS_MAX / (size[0] * size[1])));
    this.rig.size = size.map((side) => Math.max(1, Math.floor(side * shrink)));
    this.paint();
    this.change();
  }

  get isPair() { return this.layout === "pair" && this.photo === "off"; }
  get isWiped() { return (this.layout === "wipe" && this.photo === "off") || this.photo === "wipe"; }

  /** The panes that the server draws. */
  wanted() {
    if (this.photo === "error") return ["error"];
    if (this.photo !== "off" || this.layout === "one") return [this.panes[0]];
    return [...this.panes];
  }

  /** Something else is to be drawn; `isMotion` for the camera. */
  change(isMotion = false) {
    this.isDirty = true;
    this.isStill = false;
    this.moved = isMotion ? performance.now() : 0;
    if (this.rig.view === null && this.photo !== "off") this.setPhoto("off");
    this.captions();
  }

  setLayout(layout) {
    if (this.photo !== "off") this.photo = "off";
    this.layout = layout;
    this.resize();
  }

  setPhoto(photo) {
    this.photo = this.rig.view !== null && this.rig.views[this.rig.view].photo ? photo : "off";
    this.resize();
    if (this.photo !== "off" && this.photo !== "error") this.fetchPhoto(this.rig.view).then(() => this.paint());
  }

  async fetchPhoto(index) {
    if (!this.photos.has(index)) {
      const blob = await (await fetch(`/photo/${index}`)).blob();
      this.photos.clear();
      this.photos.set(index, await createImageBitmap(blob, { colorSpaceConversion: "none" }));
    }
    return this.photos.get(index);
  }

  tick(now) {
    if (!this.link?.isOpen || this.canvas.width < 2) return;
    const isMoving = now - this.moved < STILL_AFTER_MS;
    if (this.isDirty) {
      this.isDirty = false;
      this.ask(isMoving);
      this.isStill = !isMoving;
    } else if (!this.isStill && !isMoving) {
      this.isStill = true;
      this.ask(false);
    } else if (this.isTraining && this.isStill && !document.hidden && this.asked === null && now - this.drawn > REFRESH_INTERVAL_MS) {
      this.ask(false);
    }
  }

  ask(moving) {
    const from = this.rig.view === null ? { camera: this.rig.file() } : { view: this.rig.view };
    const { width, height } = this.area();
    const size = this.rig.view === null || this.isExact ? null : [width, height].map((side) => Math.max(1, Math.round(side)));
    this.asked = this.link.look({ from, size, panes: this.wanted(), moving });
  }

  /** Draws a frame that came. */
  async show(frame) {
    const decode = (blob) => createImageBitmap(blob, { colorSpaceConversion: "none", premultiplyAlpha: "none" });
    const images = await Promise.all(frame.blobs.map(decode));
    this.images.forEach((image) => image.close());
    const labels = frame.mapped ? images.pop() : null;
    this.map = labels && new LabelMap(labels);
    labels?.close();
    this.images = images;
    this.lay();
    this.frame = frame;
    this.drawn = performance.now();
    if (frame.seq === this.asked) this.asked = null;
    this.paint();
    this.onFrame(frame);
  }

  /** Lays a line around some labels. */
  setMark(labels) {
    this.mark = labels;
    this.lay();
    this.paint();
  }

  /** Shows which label is below the pointer. */
  setHover(label) {
    if (label === this.hovered) return;
    this.hovered = label;
    this.lay();
    this.paint();
  }

  lay() { this.overlay = this.map?.drawn(this.mark, this.hovered) ?? null; }

  /** The label at a point of the stage; null outside of an image or before the present one is there. */
  labelAt(x, y) {
    if (!this.map || !this.isStill || this.isDirty || this.asked !== null) return null;
    const [column, row] = this.place(x, y);
    const { W, H } = this.rig.file();
    const isInside = column >= 0 && row >= 0 && column < W && row < H;
    return isInside ? this.map.at(column / W, row / H) : null;
  }

  lost(seq) {
    if (seq === this.asked) this.asked = null;
  }

  /** Where the image is on the canvas, px: the whole, or the place of a view in it. */
  area(column = 0) {
    const columns = this.isPair ? 2 : 1;
    const [width, height] = [this.canvas.width / columns, this.canvas.height];
    const left = column * width;
    if (this.rig.view === null) return { x: left, y: 0, width, height };
    const { camera } = this.rig.views[this.rig.view];
    const { x, y, fit } = this.rig.placed(camera, [width, height]);
    return { x: left + x, y, width: camera.W * fit, height: camera.H * fit };
  }

  paint() {
    const { context, canvas } = this;
    context.clearRect(0, 0, canvas.width, canvas.height);
    context.imageSmoothingQuality = "high";
    $("wipe").hidden = !this.isWiped;
    if (this.images.length === 0) return;
    const put = (image, area) => context.drawImage(image, area.x, area.y, area.width, area.height);
    const photo = this.rig.view === null ? undefined : this.photos.get(this.rig.view);
    const isPhoto = photo && (this.photo === "switch" || this.isPhotoHeld);
    put(isPhoto ? photo : this.images[0], this.area(0));
    const second = this.photo === "wipe" ? photo : this.images[1];
    if (this.isWiped && second) {
      context.save();
      context.beginPath();
      context.rect(this.wipeAt * canvas.width, 0, canvas.width, canvas.height);
      context.clip();
      put(second, this.area(0));
      context.restore();
    } else if (this.isPair && second) {
      put(second, this.area(1));
    }
    if (this.overlay && !isPhoto) {
      put(this.overlay, this.area(0));
      if (this.isPair) put(this.overlay, this.area(1));
    }
    this.paintLines();
  }

  paintLines() {
    const { context, lines } = this;
    for (const [width, style] of lines.length > 0 ? [[4, "#000a"], [2, "#fff"]] : []) {
      Object.assign(context, { lineWidth: width, strokeStyle: style });
      context.beginPath();
      for (const line of lines) line.forEach(([x, y], index) => (index === 0 ? context.moveTo(x, y) : context.lineTo(x, y)));
      lines[0].forEach(([x, y]) => { context.moveTo(x + 5, y); context.arc(x, y, 5, 0, 7); });
      context.stroke();
    }
  }

  captions() {
    const [first, second] = this.panes.map((pane) => PANE_NAMES[pane]);
    const isTwo = (this.layout !== "one" && this.photo === "off") || this.photo === "wipe";
    const shown = this.photo === "error" ? "error" : this.panes[0];
    $("tag-b").hidden = !isTwo;
    $("tag-b").textContent = this.photo === "wipe" ? "Photo" : second;
    $("tag-a").textContent = this.photo === "switch" || this.isPhotoHeld ? "Photo" : this.photo === "error" ? PANE_NAMES.error : isTwo ? first : "";
    choose({ one: $("layout-one"), wipe: $("layout-wipe"), pair: $("layout-pair") }, this.layout);
    choose({ off: $("photo-off"), wipe: $("photo-wipe"), switch: $("photo-switch"), error: $("photo-error") }, this.photo);
    choose(Object.fromEntries([...$("pane-a").children].map((button) => [button.value, button])), shown);
    $("pane-more").value = [...$("pane-more").options].some(({ value }) => value === shown) ? shown : "";
    $("pane-b").value = this.panes[1];
    $("pane-b").closest("label").hidden = this.layout === "one";
    this.legend(shown);
  }

  /** What the colours of an image mean. */
  legend(pane) {
    const { depths } = this.frame ?? { depths: [0, 0] };
    const scales = {
      depth: [depths[0].toPrecision(3), `${depths[1].toPrecision(3)} away`], opacity: ["transparent", "opaque"],
      confidence: ["uncertain label", "certain"], error: ["no error", "0.25 or more"],
    };
    const scale = pane === "depth" && !(depths[1] > 0) ? undefined : scales[pane];
    $("legend").hidden = !scale;
    $("legend-bar").className = pane;
    [$("legend-low").textContent, $("legend-high").textContent] = scale ?? ["", ""];
  }

  /** The place in the full image under a point of the stage, CSS px. */
  place(x, y) {
    const ratio = this.canvas.width / this.box.clientWidth;
    const at = [x * ratio, y * ratio];
    const area = this.area(this.isPair && at[0] >= this.canvas.width / 2 ? 1 : 0);
    const { W, H } = this.rig.file();
    return [(at[0] - area.x) / area.width * W, (at[1] - area.y) / area.height * H];
  }

  /** Pixels of the full image in a CSS px of the stage. */
  scale() {
    return this.rig.file().W * this.canvas.width / (this.area().width * this.box.clientWidth);
  }

  /** Where a point of the world is on the canvas, px; null behind the camera. */
  seen(point) {
    const { w2c, fx, fy, cx, cy, W, H } = this.rig.file();
    const [x, y, z] = w2c.slice(0, 3).map((row) => row[0] * point[0] + row[1] * point[1] + row[2] * point[2] + row[3]);
    if (z <= 0) return null;
    const area = this.area();
    return [area.x + (fx * x / z + cx) / W * area.width, area.y + (fy * y / z + cy) / H * area.height];
  }

  /** The pixel of the full image under a point of the stage; outside the nearest one if `isNear`, else null. */
  pixel(x, y, isNear = false) {
    const pixel = this.place(x, y);
    const { W, H } = this.rig.file();
    if (isNear) return pixel.map((at, axis) => Math.floor(Math.max(0, Math.min(at, (axis === 0 ? W : H) - 1))));
    const isInside = pixel[0] >= 0 && pixel[1] >= 0 && pixel[0] < W && pixel[1] < H;
    return isInside ? pixel.map(Math.floor) : null;
  }

  /** The point of the stage in px of the free camera. */
  point(x, y) {
    const ratio = this.rig.size[1] / this.box.clientHeight;
    const at = [x * ratio, y * ratio];
    return this.isPair && at[0] >= this.rig.size[0] ? [at[0] - this.rig.size[0], at[1]] : at;
  }
}
