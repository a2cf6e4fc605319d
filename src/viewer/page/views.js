// The list of views with thumbnails and scores.

import { $, choose, el } from "./dom.js";

export class Views {
  constructor(rig, snapped) {
    Object.assign(this, { rig, snapped, which: "all", scores: [], items: [] });
    const buttons = { all: $("views-all"), test: $("views-test"), train: $("views-train") };
    for (const [which, button] of Object.entries(buttons)) {
      button.addEventListener("click", () => {
        this.which = which;
        choose(buttons, which);
        this.render();
      });
    }
    choose(buttons, "all");
    $("view-sort").addEventListener("change", () => this.render());
    $("view-list").addEventListener("keydown", (event) => {
      const step = { ArrowDown: 1, ArrowUp: -1 }[event.key];
      const list = [...$("view-list").querySelectorAll("button")];
      const at = list.indexOf(document.activeElement);
      if (!step || at < 0) return;
      event.preventDefault();
      event.stopPropagation();
      list[Math.max(0, Math.min(list.length - 1, at + step))].focus();
    });
  }

  setScene(views) {
    $("views").hidden = views.length === 0;
    const hasPhotos = views.some((view) => view.photo);
    const button = (view, index) => {
      const facts = el("span", { className: "facts" });
      const image = view.photo
        ? el("img", { src: `/thumb/${index}`, alt: "", loading: "lazy", decoding: "async", width: 78, height: 52 })
        : el("span", { className: "blank" });
      const made = el("button", { type: "button", className: hasPhotos ? "view" : "view bare", title: view.name }, image, el("span", { className: "name", textContent: view.name }), facts);
      made.addEventListener("click", () => this.snapped(index));
      return { made, facts, view, index };
    };
    this.items = views.map(button);
    this.render();
  }

  setScores({ rows }) {
    this.scores = rows;
    this.items.forEach((item) => this.describe(item));
    if ($("view-sort").value === "psnr") this.render();
  }

  describe({ facts, view, index }) {
    const [psnr, iou] = this.scores[index] ?? [null, null];
    const numbers = [psnr === null ? null : `${psnr.toFixed(2)} dB`, iou === null ? null : `IoU ${iou.toFixed(3)}`].filter(Boolean);
    const kind = view.test ? [el("span", { className: "kind", textContent: "test" })] : [];
    facts.replaceChildren(...kind, numbers.join(" · ") || `${view.camera.W} × ${view.camera.H}`);
  }

  render() {
    const wanted = ({ view }) => this.which === "all" || view.test === (this.which === "test");
    const found = this.items.filter(wanted);
    const psnr = ({ index }) => this.scores[index]?.[0] ?? Infinity;
    if ($("view-sort").value === "psnr") found.sort((a, b) => psnr(a) - psnr(b) || a.index - b.index);
    found.forEach((item) => this.describe(item));
    $("view-list").replaceChildren(...found.map(({ made }) => el("li", {}, made)));
    $("view-count").textContent = found.length;
    this.mark();
  }

  /** Marks the view that the camera is in. */
  mark() {
    for (const { made, index } of this.items) made.setAttribute("aria-pressed", String(index === this.rig.view));
    $("compare").hidden = this.rig.view === null || !this.rig.views[this.rig.view].photo;
  }

  /** The view before or after the present one, in the order of the list. */
  next(step) {
    const order = [...$("view-list").querySelectorAll("button")].map((button) => this.items.find((item) => item.made === button));
    if (order.length === 0) return;
    const at = order.findIndex((item) => item.index === this.rig.view);
    const item = order[at < 0 ? (step > 0 ? 0 : order.length - 1) : (at + step + order.length) % order.length];
    this.snapped(item.index);
    item.made.scrollIntoView({ block: "nearest" });
  }
}
