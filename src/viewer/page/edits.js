// What can be done to the selection, and the commands that do the same.

import { $, ask, copy, el, number } from "./dom.js";

export class Edits {
  constructor(link, labels) {
    Object.assign(this, { link, labels, state: null, isFixed: false });
    const on = (id, act) => $(id).addEventListener("click", act);
    on("act-rename", () => this.rename());
    on("act-merge", () => this.merge());
    on("act-export", () => this.export());
    on("act-remove", () => this.remove());
    on("act-clear", () => labels.select([]));
    on("act-recolour", () => this.recolour());
    on("edit-undo", () => this.undo());
    on("edit-save", () => this.save());
    on("edit-copy", () => copy(this.state.commands.join("\n"), "Commands"));
    this.refresh();
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

  export() {
    if (!this.isFixed && this.chosen.length > 0) this.send({ edit: "export", labels: this.chosen });
  }

  async remove() {
    if (this.isFixed || this.chosen.length === 0) return;
    const count = this.chosen.reduce((sum, id) => sum + (this.labels.row(id)?.count ?? 0), 0);
    const what = this.chosen.length === 1 ? this.labels.title(this.chosen[0]) : `${this.chosen.length} labels`;
    const labels = this.chosen;
    const said = await ask(`Remove ${what}?`, `${number(count)} Gaussians go. The file on the disk stays as it is, and the change can be taken back.`, "Remove");
    if (said !== null) this.send({ edit: "remove", labels });
  }

  recolour() {
    if (this.isFixed || this.chosen.length === 0) return;
    const value = Number.parseInt($("paint-colour").value.slice(1), 16);
    // Two digits keep the command readable.
    const colour = [value >> 16, (value >> 8) & 255, value & 255].map((byte) => Math.round(byte / 2.55) / 100);
    this.send({ edit: "recolour", labels: this.chosen, colour, mix: Number($("paint-mix").value) / 100 });
  }

  undo() {
    if (!this.isFixed && this.state?.undo) this.link.send({ kind: "undo" });
  }

  save() {
    if (!this.isFixed && this.state && !this.state.saved) this.link.send({ kind: "write" });
  }

  setState(state) {
    this.state = state;
    const { commands } = state;
    $("edits").hidden = commands.length === 0;
    $("edit-count").textContent = commands.length;
    $("edit-list").replaceChildren(...commands.map((command) => el("li", { textContent: command })));
    $("edit-list").scrollTop = 1e6;
    $("edit-file").textContent = state.saved ? `Saved as ${state.file}` : `Not saved yet; it will be ${state.file}`;
    this.refresh();
  }

  refresh() {
    const count = this.chosen.length;
    const allow = (id, isPossible) => { $(id).disabled = this.isFixed || !isPossible; };
    allow("act-rename", count === 1 && !this.chosen.includes(0));
    allow("act-merge", this.chosen.filter((id) => id !== 0).length > 1);
    for (const id of ["act-export", "act-remove", "act-recolour"]) allow(id, count > 0);
    $("act-frame").disabled = this.labels.box(this.chosen) === null;
    $("recolour").hidden = this.isFixed;
    allow("edit-undo", this.state?.undo);
    allow("edit-save", this.state && !this.state.saved);
  }
}
