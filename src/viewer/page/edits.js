// Edits of the selection, export, undo and redo.

import { $, copy, el } from "./dom.js";

export class Edits {
  /** `isChosen` returns whether Gaussians are selected by hand. */
  constructor(link, labels, isChosen) {
    Object.assign(this, { link, labels, isChosen, state: null, isFixed: false, fills: false, title: "model" });
    const on = (id, act) => $(id).addEventListener("click", act);
    on("act-rename", () => this.rename());
    on("act-merge", () => this.merge());
    on("act-split", () => this.split());
    on("act-export", () => this.export());
    on("act-remove", () => this.remove(false));
    on("act-fill", () => this.remove(true));
    on("act-clear", () => labels.select([]));
    on("act-recolour", () => this.recolour());
    on("edit-undo", () => this.undo());
    on("edit-redo", () => this.redo());
    on("edit-save", () => this.save());
    on("edit-copy", () => copy(this.state.command, "Command"));
    $("export").addEventListener("close", () => this.exported($("export").returnValue === "yes"));
    $("export-what").addEventListener("change", () => this.suggest());
    this.refresh();
  }

  setScene({ formats, fills, title }) {
    Object.assign(this, { fills: fills === true, title });
    $("export-format").replaceChildren(...(formats ?? []).map(([textContent, value]) => el("option", { value, textContent: `${textContent} (${value})` })));
  }

  get chosen() { return [...this.labels.selected].sort((a, b) => a - b); }

  send(what) {
    this.link.send({ kind: "edit", what });
  }

  rename() {
    if (this.chosen.length === 1) this.labels.rename(this.chosen[0]);
  }

  merge() {
    if (!this.isFixed && this.chosen.filter((id) => id !== 0).length > 1) this.send({ edit: "merge", labels: this.chosen });
  }

  split() {
    if (!this.isFixed && this.chosen.length === 1) this.send({ edit: "split", label: this.chosen[0] });
  }

  /** Opens the dialog for the content, name and format of an export. */
  export() {
    if (this.isFixed || $("export").open) return;
    const option = (value, textContent) => el("option", { value, textContent });
    const { chosen } = this;
    const what = chosen.length === 1 ? this.labels.title(chosen[0]) : `${chosen.length} objects`;
    $("export-what").replaceChildren(
      ...(this.isChosen() ? [option("chosen", "Selected Gaussians")] : []),
      ...(chosen.length > 0 ? [option("labels", what)] : []), option("all", "Whole model"),
    );
    this.suggest();
    $("export").returnValue = "no";
    $("export").showModal();
    $("export-name").select();
  }

  /** Proposes a name. */
  suggest() {
    const kind = $("export-what").value;
    const name = kind === "labels" && this.chosen.length === 1 ? this.labels.row(this.chosen[0])?.name ?? `label ${this.chosen[0]}`
      : kind === "labels" ? "objects" : kind === "chosen" ? "part" : this.title.split("/").pop().replace(/\.[a-z]+$/, "");
    $("export-name").value = name.replace(/[^\p{L}\p{N} _.-]/gu, "").replace(/^[ .]+/, "").slice(0, 60) || "object";
  }

  exported(isSaid) {
    if (!isSaid) return;
    const kind = $("export-what").value;
    const what = { labels: kind === "labels" ? this.chosen : [], chosen: kind === "chosen", name: $("export-name").value, format: $("export-format").value };
    this.link.send({ kind: "export", what });
  }

  /** Fetches a file that was written. */
  fetch({ file, name }) {
    const link = el("a", { href: `/export/${file}`, download: name });
    document.body.append(link);
    link.click();
    link.remove();
  }

  remove(fill) {
    if (this.isFixed || this.chosen.length === 0 || (fill && !this.fills)) return;
    if (fill) this.setFilling(true);
    this.send({ edit: "remove", labels: this.chosen, fill });
  }

  /** Shows that a hole is being filled, which takes a while. */
  setFilling(isFilling) {
    this.isFilling = isFilling;
    $("act-fill").textContent = isFilling ? "Filling …" : "Remove and fill";
    document.body.classList.toggle("busy", isFilling);
    this.refresh();
  }

  recolour() {
    if (this.isFixed || this.chosen.length === 0) return;
    const value = Number.parseInt($("paint-colour").value.slice(1), 16);
    // Two digits keep the list of changes readable.
    const colour = [value >> 16, (value >> 8) & 255, value & 255].map((byte) => Math.round(byte / 2.55) / 100);
    this.send({ edit: "recolour", labels: this.chosen, colour, mix: Number($("paint-mix").value) / 100 });
  }

  undo() {
    if (!this.isFixed && this.state?.changes.length > 0) this.link.send({ kind: "undo" });
  }

  redo() {
    if (!this.isFixed && this.state?.redo > 0) this.link.send({ kind: "redo" });
  }

  save() {
    if (!this.isFixed && this.state && !this.state.saved) this.link.send({ kind: "write" });
  }

  setState(state) {
    this.state = state;
    const { changes, file } = state;
    this.setFilling(false);
    $("edits").hidden = changes.length === 0;
    $("edit-count").textContent = changes.length;
    $("edit-list").replaceChildren(...changes.map((change) => el("li", { textContent: change })));
    $("edit-list").scrollTop = 1e6;
    $("edit-file").textContent = file === null ? "" : state.saved ? `Saved as ${file}` : `Will be saved as ${file}`;
    this.refresh();
  }

  refresh() {
    const count = this.chosen.length;
    const allow = (id, isPossible) => { $(id).disabled = this.isFixed || !isPossible; };
    allow("act-rename", count === 1 && !this.chosen.includes(0));
    allow("act-merge", this.chosen.filter((id) => id !== 0).length > 1);
    allow("act-split", count === 1 && !this.chosen.includes(0));
    for (const id of ["act-remove", "act-recolour", "act-alone", "act-choose"]) allow(id, count > 0);
    allow("act-fill", count > 0 && !this.isFilling);
    $("act-fill").hidden = !this.fills;
    $("act-frame").disabled = this.labels.box(this.chosen) === null;
    $("recolour").hidden = this.isFixed;
    allow("edit-undo", this.state?.changes.length > 0);
    allow("edit-redo", this.state?.redo > 0);
    allow("edit-save", this.state && !this.state.saved);
    allow("act-export", true);
    for (const id of ["edit-undo", "edit-redo", "edit-save", "act-export"]) $(id).hidden = this.isFixed;
  }
}
