// The panel of labels, and the selection.

import { $, counted, el, icon, number, toast } from "./dom.js";

const EYE_PATHS = ["M1.5 8S4 3.5 8 3.5 14.5 8 14.5 8 12 12.5 8 12.5 1.5 8 1.5 8Z", "M8 6a2 2 0 1 0 0 4 2 2 0 0 0 0-4Z"];
const CLOSED_EYE_PATHS = ["M1.5 8S4 12.5 8 12.5 14.5 8 14.5 8", "M4 11.2 3 13", "M8 12.5v2", "M12 11.2l1 1.8"];
const SOLO_PATHS = ["M8 2.5a5.5 5.5 0 1 0 0 11 5.5 5.5 0 0 0 0-11Z", "M8 6.5a1.5 1.5 0 1 0 0 3 1.5 1.5 0 0 0 0-3Z"];

export class Labels {
  constructor(link, changed) {
    Object.assign(this, { link, changed, rows: [], all: 0, selected: new Set(), hidden: [], solo: [], thumbs: {}, isFixed: false });
    this.anchor = null;
    this.focused = null;
    this.list = $("label-list");
    $("label-search").addEventListener("input", () => this.render());
    $("label-sort").addEventListener("change", () => this.render());
    for (const id of ["label-all", "solo-end"]) $(id).addEventListener("click", () => this.showAll());
    this.list.addEventListener("mouseover", (event) => this.onHover?.(this.idOf(event.target)));
    this.list.addEventListener("mouseleave", () => this.onHover?.(null));
    this.list.addEventListener("click", (event) => this.clicked(event));
    this.list.addEventListener("dblclick", (event) => {
      const id = this.idOf(event.target);
      if (id !== null && !event.target.closest("button, input")) this.onFrame?.([id]);
    });
    this.list.addEventListener("keydown", (event) => this.key(event));
    this.list.addEventListener("focusin", (event) => { this.focused = this.idOf(event.target) ?? this.focused; });
  }

  setRows({ rows, all }) {
    this.rows = rows;
    this.all = all;
    const there = new Set(rows.map((row) => row.id));
    const kept = [...this.selected].filter((id) => there.has(id));
    if (kept.length !== this.selected.size) this.select(kept);
    this.render();
    this.changed();
  }

  setShown({ hidden, solo }) {
    const isOther = hidden.join() !== this.hidden.join() || solo.join() !== this.solo.join();
    if (isOther && !this.hasAsked && this.hasShown) toast("Another page changed which objects are visible.");
    this.hasAsked = false;
    this.hasShown = true;
    this.hidden = hidden;
    this.solo = solo;
    $("solo-chip").hidden = solo.length === 0;
    $("solo-text").textContent = solo.length === 1 ? `Showing only ${this.title(solo[0])}` : `Showing only ${solo.length} objects`;
    this.render();
  }

  /** Takes the versions of the images of labels. */
  setThumbs({ versions }) {
    this.thumbs = versions;
    this.render();
  }

  row(id) { return this.rows.find((row) => row.id === id); }

  title(id) {
    const name = this.row(id)?.name;
    return id === 0 ? "background" : name ? `${name} (${id})` : `label ${id}`;
  }

  idOf(target) {
    const item = target.closest?.("li.label");
    return item ? Number(item.dataset.id) : null;
  }

  /** The rows that the search finds, in order. */
  listed() {
    const words = $("label-search").value.trim().toLowerCase();
    const found = this.rows.filter((row) => !words || String(row.id) === words || (row.name ?? "").toLowerCase().includes(words));
    const name = (row) => row.name ?? "\uffff";
    const orders = {
      id: (a, b) => a.id - b.id,
      name: (a, b) => name(a).localeCompare(name(b), "en", { numeric: true }) || a.id - b.id,
      count: (a, b) => b.count - a.count || a.id - b.id,
      confidence: (a, b) => (a.confidence ?? 2) - (b.confidence ?? 2) || a.id - b.id,
    };
    return found.sort(orders[$("label-sort").value]);
  }

  isVisible(id) { return this.solo.length > 0 ? this.solo.includes(id) : !this.hidden.includes(id); }

  render() {
    const editing = this.list.querySelector("input");
    if (editing) return;
    const rows = this.listed();
    const hadFocus = this.list.contains(document.activeElement);
    const top = this.list.scrollTop;
    this.list.replaceChildren(...rows.map((row) => this.item(row)));
    this.list.scrollTop = top;
    const first = rows.some((row) => row.id === this.focused) ? this.focused : rows[0]?.id;
    const item = this.item_(first);
    if (item) item.tabIndex = 0;
    if (hadFocus) item?.focus({ preventScroll: true });
    const objects = this.rows.filter((row) => row.id !== 0).length;
    $("label-count").textContent = this.rows.length === 0 ? "" : rows.length === this.rows.length ? counted(this.all > this.rows.length ? this.all : objects, "object") : `${rows.length} found`;
    const empty = this.rows.length === 0 && this.isFixed ? "No labels yet. With masks, training assigns labels after densification."
      : this.rows.length === 0 ? "This model has no labels. Train it with masks, run labelgs label, or select Gaussians with the tools on the left of the image."
      : rows.length === 0 ? "No object has this name or id." : "";
    $("label-empty").textContent = empty;
    $("label-empty").hidden = !empty;
    this.list.hidden = Boolean(empty);
    $("label-all").disabled = this.isFixed || (this.hidden.length === 0 && this.solo.length === 0);
    this.mark();
  }

  /** Marks the rows of the selection. */
  mark() {
    const hasFocused = Boolean(this.item_(this.focused ?? undefined));
    for (const item of this.list.children) {
      const id = Number(item.dataset.id);
      item.setAttribute("aria-selected", String(this.selected.has(id)));
      if (hasFocused) item.tabIndex = id === this.focused ? 0 : -1;
    }
    $("selection").hidden = this.selected.size === 0;
    $("selection-count").textContent = this.selected.size === 1 ? this.title([...this.selected][0]) : `${this.selected.size} objects`;
  }

  item_(id) { return id === undefined ? null : this.list.querySelector(`li[data-id="${Number(id)}"]`); }

  item(row) {
    const isVisible = this.isVisible(row.id);
    const name = el("span", { className: row.name ? "name" : "name none", textContent: row.name ?? (row.id === 0 ? "background" : "unnamed") });
    name.title = row.name ?? "";
    const facts = el("span", { className: "facts" }, el("span", { className: "size", textContent: `${number(row.count)} Gaussians` }));
    if (typeof row.confidence === "number" && row.confidence < 0.6) {
      facts.append(el("span", { className: "unsure", textContent: `confidence ${(100 * row.confidence).toFixed(0)} %`, title: "Its Gaussians were often of other labels in the masks" }));
    }
    const version = this.thumbs[row.id];
    const swatch = el("span", { className: "swatch" }, ...(version === undefined ? [] : [el("img", { src: `/label/${row.id}?v=${version}`, alt: "", width: 34, height: 34, loading: "lazy" })]));
    swatch.style.setProperty("--swatch", `rgb(${row.colour.join(" ")})`);
    const what = this.title(row.id);
    const button = (kind, shape, label, pressed) => el("button", {
      type: "button", className: kind, tabIndex: -1, disabled: this.isFixed, title: label, "aria-label": `${label}: ${what}`, "aria-pressed": String(pressed),
    }, icon(...shape));
    const item = el("li", { className: isVisible ? "label" : "label off", tabIndex: -1, role: "option" },
      swatch, name, el("span", { className: "id", textContent: row.id === 0 ? "" : row.id }),
      button("eye", isVisible ? EYE_PATHS : CLOSED_EYE_PATHS, isVisible ? "Hide" : "Show", false),
      button("solo", SOLO_PATHS, "Show only this", this.solo.includes(row.id)), facts);
    item.dataset.id = row.id;
    return item;
  }

  clicked(event) {
    const id = this.idOf(event.target);
    if (id === null || event.target.closest("input")) return;
    const button = event.target.closest("button");
    if (button) return button.classList.contains("eye") ? this.toggle([id]) : this.alone([id]);
    if (event.shiftKey && this.anchor !== null) {
      const ids = this.listed().map((row) => row.id);
      const [a, b] = [ids.indexOf(this.anchor), ids.indexOf(id)].sort((x, y) => x - y);
      return this.select([...this.selected, ...ids.slice(Math.max(a, 0), b + 1)]);
    }
    this.anchor = id;
    if (event.ctrlKey || event.metaKey) {
      const rest = new Set(this.selected);
      if (!rest.delete(id)) rest.add(id);
      return this.select(rest);
    }
    this.select([id]);
  }

  /** A click in the image: it replaces, extends or reduces the selection. */
  picked(id, { add, take }) {
    const chosen = new Set(add || take ? this.selected : []);
    if (take) chosen.delete(id);
    else if (id !== 0 || add) chosen.add(id);
    this.anchor = id;
    this.focused = id;
    this.select(chosen);
    this.item_(id)?.scrollIntoView({ block: "nearest" });
  }

  select(ids) {
    this.selected = new Set(ids);
    this.mark();
    this.changed();
  }

  key(event) {
    const item = event.target.closest?.("li.label");
    if (!item || event.target.matches("input")) return;
    const move = { ArrowDown: "nextElementSibling", ArrowUp: "previousElementSibling" }[event.key];
    const id = Number(item.dataset.id);
    if (move) {
      const next = item[move];
      if (next) {
        item.tabIndex = -1;
        next.tabIndex = 0;
        next.focus();
        if (event.shiftKey) this.select([...this.selected, id, Number(next.dataset.id)]);
      }
    } else if (event.key === "ArrowRight" || event.key === "ArrowLeft") {
      const stops = [item, ...item.querySelectorAll("button")];
      const at = stops.indexOf(document.activeElement);
      stops[Math.max(0, Math.min(stops.length - 1, at + (event.key === "ArrowRight" ? 1 : -1)))].focus();
    } else if (event.target === item && (event.key === " " || event.key === "Enter")) {
      if (event.ctrlKey) this.picked(id, { take: this.selected.has(id), add: true });
      else this.picked(id, { add: event.shiftKey });
    } else {
      return;
    }
    event.preventDefault();
    event.stopPropagation();
  }

  /** Edits a name in its row. */
  rename(id) {
    const item = this.item_(id);
    if (!item || this.isFixed || id === 0) return;
    item.scrollIntoView({ block: "nearest" });
    const old = this.row(id).name ?? "";
    const field = el("input", { type: "text", value: old, maxLength: 200, spellcheck: false, "aria-label": `Name of label ${id}` });
    let isDone = false;
    const end = (isSaved) => {
      if (isDone) return;
      isDone = true;
      const name = field.value.trim();
      field.remove();
      this.focused = id;
      this.render();
      this.item_(id)?.focus({ preventScroll: true });
      if (isSaved && name && name !== old) this.link.send({ kind: "edit", what: { edit: "rename", label: id, name } });
    };
    field.addEventListener("keydown", (event) => {
      event.stopPropagation();
      if (event.key === "Enter") end(true);
      if (event.key === "Escape") end(false);
    });
    field.addEventListener("blur", () => end(true));
    item.querySelectorAll(".name, .id, .facts").forEach((part) => part.remove());
    item.insertBefore(field, item.children[1]);
    field.focus();
    field.select();
  }

  send(hidden, solo) {
    if (this.isFixed) return toast("You can hide objects after training.", true);
    this.hasAsked = true;
    this.link.send({ kind: "show", hidden, solo });
  }

  /** Hides visible labels, shows hidden ones. */
  toggle(ids) {
    const hidden = new Set(this.solo.length > 0 ? this.rows.map((row) => row.id).filter((id) => !this.solo.includes(id)) : this.hidden);
    for (const id of ids) if (!hidden.delete(id)) hidden.add(id);
    this.send([...hidden], []);
  }

  /** Shows some labels alone, or all again. */
  alone(ids) {
    const isSame = ids.length === this.solo.length && ids.every((id) => this.solo.includes(id));
    this.send(this.hidden, isSame ? [] : ids);
  }

  showAll() { this.send([], []); }

  /** The box around labels. */
  box(ids) {
    const rows = ids.map((id) => this.row(id)).filter((row) => row?.min);
    if (rows.length === 0) return null;
    const over = (field, pick) => [0, 1, 2].map((axis) => pick(...rows.map((row) => row[field][axis])));
    return [over("min", Math.min), over("max", Math.max)];
  }
}
