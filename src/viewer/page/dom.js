// Elements. Text from files and models becomes text nodes only.

export const $ = (id) => document.getElementById(id);

/** Makes an element with properties and children; strings become text. */
export function el(tag, properties = {}, ...children) {
  const made = document.createElement(tag);
  for (const [key, value] of Object.entries(properties)) {
    if (key.startsWith("aria-") || key === "role") made.setAttribute(key, value);
    else made[key] = value;
  }
  made.append(...children);
  return made;
}

const SVG_NAMESPACE = "http://www.w3.org/2000/svg";

/** Makes an SVG element. */
export function svg(tag, attributes = {}, ...children) {
  const made = document.createElementNS(SVG_NAMESPACE, tag);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  made.append(...children);
  return made;
}

/** An icon from paths in a box of 16 by 16. */
export function icon(...paths) {
  const parts = paths.map((d) => svg("path", { d, fill: "none", stroke: "currentColor", "stroke-width": 1.4, "stroke-linecap": "round", "stroke-linejoin": "round" }));
  return svg("svg", { viewBox: "0 0 16 16", "aria-hidden": "true" }, ...parts);
}

/** Marks the selected button of a group. */
export function choose(buttons, chosen) {
  for (const [name, button] of Object.entries(buttons)) button.setAttribute("aria-pressed", String(name === chosen));
}

/** Shows a text for some seconds. */
export function toast(text, isProblem = false) {
  const box = $("toasts");
  const made = el("div", { className: isProblem ? "toast problem" : "toast", textContent: text });
  box.append(made);
  while (box.children.length > 4) box.firstChild.remove();
  setTimeout(() => made.remove(), isProblem ? 9000 : 4500);
}

/** Asks for a text, or for a confirmation if `value` is null. Returns null if cancelled. */
export function ask(head, text, yes, value = null) {
  const dialog = $("ask");
  if (dialog.open) return Promise.resolve(null);
  $("ask-head").textContent = head;
  $("ask-text").textContent = text;
  $("ask-text").hidden = !text;
  $("ask-yes").textContent = yes;
  const input = $("ask-input");
  input.hidden = value === null;
  input.value = value ?? "";
  dialog.returnValue = "no";
  dialog.showModal();
  (value === null ? $("ask-yes") : input).focus();
  input.select();
  return new Promise((resolve) => {
    dialog.addEventListener("close", () => {
      const said = dialog.returnValue === "yes";
      resolve(said ? (value === null ? "" : input.value) : null);
    }, { once: true });
  });
}

/** Copies text to the clipboard, and shows a note. */
export async function copy(text, what) {
  try {
    await navigator.clipboard.writeText(text);
    toast(`${what} copied.`);
  } catch {
    // Pages that are not on loopback have no clipboard.
    const box = el("textarea", { value: text });
    document.body.append(box);
    box.select();
    const done = document.execCommand("copy");
    box.remove();
    toast(done ? `${what} copied.` : `Copying failed: ${text}`, !done);
  }
}

const plain = new Intl.NumberFormat("en", { maximumFractionDigits: 0 });

/** A whole number with separators. */
export const number = (value) => plain.format(value);

/** A number with its noun, such as "1 object" or "8 objects". */
export const counted = (count, noun) => `${number(count)} ${noun}${count === 1 ? "" : "s"}`;

/** Bytes in a fitting unit. */
export function bytes(value) {
  const units = ["B", "KiB", "MiB", "GiB"];
  let unit = 0;
  while (value >= 1024 && unit < 3) { value /= 1024; unit += 1; }
  return `${value >= 100 || unit === 0 ? value.toFixed(0) : value.toFixed(1)} ${units[unit]}`;
}

/** Seconds as 1 h 02 min or 3 min 20 s. */
export function duration(seconds) {
  const all = Math.max(0, Math.round(seconds));
  const [h, m, s] = [Math.floor(all / 3600), Math.floor(all / 60) % 60, all % 60];
  if (h > 0) return `${h} h ${String(m).padStart(2, "0")} min`;
  return m > 0 ? `${m} min ${String(s).padStart(2, "0")} s` : `${s} s`;
}
