// Puts the parts of the page together.

import { Edits } from "./edits.js";
import { $, choose, copy, el, toast } from "./dom.js";
import { Input } from "./input.js";
import { Labels } from "./labels.js";
import { Link } from "./link.js";
import { Measuring } from "./measure.js";
import { CameraPath } from "./path.js";
import { Finding } from "./object.js";
import { Selecting } from "./select.js";
import { PANES, Stage } from "./stage.js";
import { Rig } from "./camera.js";
import { Training } from "./training.js";
import { Views } from "./views.js";

const rig = new Rig();
const stage = new Stage(rig);
let scene = null;
const picks = new Map();

const link = new Link(hear, (frame) => stage.show(frame), connection);
stage.link = link;
const labels = new Labels(link, () => {
  edits.refresh();
  mark();
});
const finding = new Finding(link, stage, rig, () => mark());
const measuring = new Measuring(stage, rig, (at, then) => pick(at, then));
const selecting = new Selecting(link, stage, rig, labels, { find: finding, measure: measuring });
const edits = new Edits(link, labels, () => selecting.state.count > 0);
const views = new Views(rig, snap);
const path = new CameraPath(rig, () => moved());
const training = new Training(link);

function hear(message) {
  switch (message.kind) {
    case "scene": return begin(message);
    case "labels": labels.setRows(message); return selecting.render();
    case "shown": return shown(message);
    case "chosen": return selecting.setState(message);
    case "thumbs": return labels.setThumbs(message);
    case "exported": return edits.fetch(message);
    case "object": return finding.setState(message);
    case "kept": return labels.select([message.label]);
    case "edits": edits.setState(message); return stage.change();
    case "scores": views.setScores(message); return training.setScores(message, scene?.views ?? []);
    case "training": return training.setState(message);
    case "curve": return training.setCurve(message);
    case "picked": return picked(message);
    case "over": return over(message);
    case "lost": stage.lost(message.seq); return toast(message.text, true);
    case "problem": edits.setFilling(false); return toast(message.text, true);
    case "said": return toast(message.text);
    case "notice": return toast(message.text);
    default: return undefined;
  }
}

/** Draws a line around the selection and the object that was found. */
function mark() {
  const found = finding.mark === null ? [] : [finding.mark];
  measuring.setBoxes(edits.chosen.filter((id) => id !== 0).map((id) => labels.row(id)?.box).filter(Boolean));
  stage.setMark([...edits.chosen.filter((id) => id !== 0), ...found]);
  // The object keeps its label while it grows.
  const what = JSON.stringify([finding.mark, finding.state?.count, finding.state?.flags, finding.state?.first]);
  if (what === mark.last) return;
  mark.last = what;
  stage.change();
}

function shown(message) {
  labels.setShown(message);
  $("background").value = `#${message.background.map((value) => Math.round(255 * value).toString(16).padStart(2, "0")).join("")}`;
  stage.change();
}

function begin(message) {
  // The same scene again after a break keeps the camera.
  const isSame = scene !== null && JSON.stringify(scene.views) === JSON.stringify(message.views) && scene.title === message.title;
  scene = message;
  document.title = `${message.title} – labelgs`;
  $("title").textContent = message.title;
  $("title").title = message.device ? `${message.title} on ${message.device}` : message.title;
  document.body.classList.toggle("bare", message.views.length === 0 && !message.training);
  stage.isTraining = message.training;
  labels.isFixed = message.training;
  edits.isFixed = message.training;
  for (const option of $("pane-more").options) if (option.value === "confidence") option.disabled = message.training;
  $("first-hint").hidden = message.training || begin.isKnown === true;
  edits.setScene(message);
  path.title = message.title;
  selecting.setScene(message);
  rig.reset(message, isSame);
  views.setScene(message.views);
  labels.render();
  edits.refresh();
  veil(null);
  moved(false);
}

function connection(state) {
  const words = { on: "connected", off: "disconnected", token: "disconnected", over: "ended" };
  $("state-link").textContent = words[state];
  $("state-link").className = state === "on" ? "dot on" : "dot off";
  if (state === "on") return stage.change();
  if (state === "off") return veil("Connection lost", "labelgs has exited or cannot be reached. On Ctrl-C it saves unsaved edits and prints the file. To reconnect this page, start labelgs again with the same --view-port and token (LABELGS_VIEW_TOKEN). Otherwise open the address that it prints.");
  if (state === "token") return veil("The server has restarted", "It has a new token. Open the address that labelgs printed last.");
  return undefined;
}

function veil(head, ...parts) {
  $("veil").hidden = head === null;
  $("veil-head").textContent = head ?? "";
  $("veil-text").replaceChildren(...parts);
}

function over(message) {
  training.end();
  stage.isTraining = false;
  const scores = [message.psnr && `PSNR ${message.psnr.toFixed(2)} dB`, message.iou && `IoU ${message.iou.toFixed(3)}`].filter(Boolean).join(", ");
  const head = message.stopped ? `Stopped after step ${message.steps}` : "Training finished";
  veil(head, scores ? `Test views: ${scores}. ` : "", "View the model with", el("code", { textContent: message.command }));
}

/** Hides the hint for newcomers after the first click or motion. */
function known() {
  begin.isKnown = true;
  $("first-hint").hidden = true;
}

function moved(isMotion = true) {
  stage.change(isMotion);
  views.mark();
  const { view } = rig;
  $("state-view").textContent = view === null ? "free camera" : `view ${rig.views[view].name}`;
}

function snap(index) {
  rig.snap(index);
  // Where panels are sheets, the image is what was asked for.
  if (document.body.dataset.tab === "views") $("tab-stage").click();
  if (stage.photo !== "off") stage.setPhoto(stage.photo);
  moved(false);
}

stage.onFrame = (frame) => {
  $("state-exact").hidden = !(frame.exact && stage.isExact && rig.view !== null);
  if (frame.depths[1] > 0) stage.captions();
  measuring.draw();
  $("state-size").textContent = `${frame.width} × ${frame.height} px`;
  $("state-time").textContent = `${frame.ms.toFixed(0)} ms`;
  if ((rig.view === null) === ($("state-view").textContent.startsWith("view"))) moved(true);
};

/** Selects the label at a point of the image, without asking if the image is known. */
function select(at, how) {
  known();
  const label = stage.labelAt(...at);
  if (label === null) return pick(at, (found) => labels.picked(found.label, how));
  $("state-pick").textContent = labels.title(label);
  return labels.picked(label, how);
}

function hover(at) {
  const label = at && !selecting.isOn ? stage.labelAt(...at) : null;
  stage.setHover(label === 0 ? null : label);
  if (label !== null) $("state-pick").textContent = labels.title(label);
}

/** Asks what is at a point of the stage. */
function pick(at, then) {
  const pixel = stage.pixel(...at);
  if (!pixel) return;
  const from = rig.view === null ? { camera: rig.file() } : { view: rig.view };
  if (picks.size > 32) picks.clear();
  picks.set(link.pick(from, pixel), { at, then });
}

function picked(message) {
  const asked = picks.get(message.seq);
  picks.delete(message.seq);
  if (!asked) return;
  const sure = typeof message.confidence === "number" ? ` · confidence ${(100 * message.confidence).toFixed(0)} %` : "";
  const depth = message.depth > 0 ? ` · depth ${message.depth.toPrecision(4)}` : "";
  const which = message.gaussian === null ? "nothing here" : `Gaussian ${message.gaussian}`;
  $("state-pick").textContent = `${labels.title(message.label)} · ${which}${depth}${sure}`;
  asked.then(message, asked.at);
}

function spot([x, y]) {
  const mark = $("spot");
  mark.hidden = false;
  mark.style.left = `${x}px`;
  mark.style.top = `${y}px`;
  clearTimeout(spot.timer);
  spot.timer = setTimeout(() => { mark.hidden = true; }, 700);
}

function frameLabels(ids) {
  const box = labels.box(ids);
  if (!box) return;
  rig.frame(...box);
  moved();
}

function setPane(index, pane) {
  if (pane === "error") {
    if (rig.view === null) { toast("The error image needs a photo. Select a view first.", true); return stage.captions(); }
  } else if (pane === "confidence" && scene?.training) {
    toast("Confidence is available after training.", true);
    return stage.captions();
  }
  stage.panes[index] = pane;
  return stage.change();
}

function fly(isFlight) {
  input.isFlight = isFlight;
  stage.box.classList.toggle("fly", isFlight);
  choose({ orbit: $("mode-orbit"), fly: $("mode-fly") }, isFlight ? "fly" : "orbit");
}

const act = {
  home: () => { rig.home(); moved(false); },
  level: () => { rig.level(); toast("The top of this image is the up direction now."); },
  copyCamera: () => copy(JSON.stringify(rig.file()), "Camera"),
  help: () => $("help").showModal(),
  choose: () => {
    if (edits.chosen.length > 0) selecting.send({ select: "labels", labels: edits.chosen, how: "replace" });
  },
  /** Selects what is in the middle of the image. */
  middle: () => select([stage.box.clientWidth / 2, stage.box.clientHeight / 2], {}),
  /** Leaves one thing after the other. */
  escape: () => {
    if (finding.isThere) finding.drop();
    else if (selecting.state.count > 0) selecting.clear();
    else if (selecting.isOn) selecting.take("pointer");
    else if (labels.selected.size > 0) labels.select([]);
    else if (labels.solo.length > 0) labels.showAll();
  },
  holdPhoto: () => {
    if (rig.view === null || !rig.views[rig.view].photo) return;
    stage.isPhotoHeld = true;
    stage.fetchPhoto(rig.view).then(() => stage.paint());
    stage.captions();
  },
};

const toggle = (tool) => selecting.take(selecting.tool === tool ? "pointer" : tool);

const input = new Input(stage, rig, {
  click: select,
  hover,
  pivot: (at) => pick(at, (found) => {
    rig.pivotAt(stage.point(...at), found.depth);
    spot(at);
    moved();
  }),
  moved: known,
  tool: (event) => (event.altKey || event.button === 1 ? null : selecting.hand),
  released: { Space: () => { stage.isPhotoHeld = false; stage.paint(); stage.captions(); } },
  keys: {
    KeyV: () => fly(!input.isFlight),
    KeyF: () => frameLabels(edits.chosen),
    "Shift+KeyF": act.home,
    KeyC: act.copyCamera,
    KeyX: () => stage.setLayout(stage.layout === "wipe" ? "one" : "wipe"),
    "Shift+KeyX": () => stage.setLayout(stage.layout === "pair" ? "one" : "pair"),
    KeyP: () => stage.setPhoto(stage.photo === "wipe" ? "off" : "wipe"),
    Space: act.holdPhoto,
    BracketLeft: () => views.next(-1),
    BracketRight: () => views.next(1),
    KeyH: () => { if (edits.chosen.length > 0) labels.toggle(edits.chosen); },
    "Shift+KeyH": () => labels.showAll(),
    KeyI: () => { if (edits.chosen.length > 0) labels.alone(edits.chosen); },
    KeyM: () => edits.merge(),
    "Ctrl+KeyE": () => edits.export(),
    "Ctrl+KeyA": () => labels.select(labels.rows.filter((row) => row.id !== 0).map((row) => row.id)),
    "Ctrl+Shift+KeyA": () => labels.select([]),
    "Ctrl+KeyI": () => labels.select(labels.rows.filter((row) => row.id !== 0 && !labels.selected.has(row.id)).map((row) => row.id)),
    "Ctrl+KeyZ": () => edits.undo(),
    "Ctrl+Shift+KeyZ": () => edits.redo(),
    "Ctrl+KeyY": () => edits.redo(),
    "Ctrl+Shift+KeyI": () => selecting.send({ select: "invert" }),
    "Ctrl+KeyS": () => edits.save(),
    F2: () => edits.rename(),
    Delete: () => (selecting.state.count > 0 ? selecting.edit({ edit: "delete" }) : edits.remove(false)),
    "Shift+Delete": () => edits.remove(true),
    KeyO: () => toggle("find"),
    KeyZ: () => toggle("strokes"),
    KeyR: () => toggle("box"),
    KeyT: () => toggle("lasso"),
    KeyB: () => toggle("brush"),
    KeyN: () => toggle("ball"),
    KeyU: () => toggle("flood"),
    KeyY: () => toggle("depth"),
    KeyJ: () => toggle("measure"),
    KeyG: act.choose,
    Period: act.middle,
    KeyL: () => selecting.send({ select: "lock" }),
    Equal: () => selecting.send({ select: "grow" }),
    "Shift+Equal": () => selecting.send({ select: "grow" }),
    Minus: () => selecting.send({ select: "shrink" }),
    Enter: () => (finding.isThere ? finding.keep() : selecting.give()),
    Escape: act.escape,
    KeyK: () => training.ask("pause"),
    "?": act.help,
    ...Object.fromEntries(PANES.map(([pane], index) => [`Digit${index + 1}`, () => setPane(0, pane)])),
  },
});
labels.onFrame = frameLabels;
labels.onHover = (id) => stage.setHover(id === 0 ? null : id);

/** Sends a model that is dropped on the page to the server, which opens it. */
async function open(file) {
  const name = file.name.replace(/[^A-Za-z0-9_.-]/g, "_").replace(/^[.]+/, "");
  toast(`Opening ${file.name} …`);
  const answer = await fetch(`/open?name=${name}`, { method: "POST", body: file });
  if (!answer.ok) toast((await answer.text()).trim(), true);
}
document.addEventListener("dragover", (event) => event.preventDefault());
document.addEventListener("drop", (event) => {
  event.preventDefault();
  const [file] = event.dataTransfer.files;
  if (file && !scene?.training) open(file).catch(() => toast("Could not upload the file.", true));
});

const KEY_HELP = [
  ["Drag", "rotate around the pivot, or look around in fly mode"], ["Right, middle or Shift+drag", "pan"], ["Wheel", "zoom"],
  ["Double click", "set the pivot at this point"], ["Click, .", "select the object under the pointer, or in the centre; Shift adds, Ctrl removes"],
  ["W A S D, Q E", "move; Shift fast, Alt slow"], ["Arrows", "rotate"], ["V", "switch between orbit and fly"], ["F, Shift+F", "zoom to the selection, reset the camera"],
  ["O", "find an object: click it or drag a box, right click excludes; Enter keeps, Esc discards"],
  ["Z", "select an object by strokes; Ctrl+drag or right click marks background"],
  ["R, T, B", "select Gaussians by rectangle, lasso, brush; Alt+drag rotates"], ["N, U, Y", "select by sphere, by similar colour, in front or behind"],
  ["G", "select the Gaussians of the selected objects"], ["+, -, L", "grow, shrink, lock the selected Gaussians"], ["Enter, Delete", "assign a label to them, delete them"], ["J", "measure, and show the box of the selection"],
  ["[ ]", "previous view, next view"], ["1 – 7", PANES.map(([, name]) => name.toLowerCase()).join(", ")], ["X, Shift+X", "two images: wipe, side by side"],
  ["P, hold Space", "wipe to the photo, show the photo"], ["H, Shift+H, I", "hide the selection, show all, show only the selection"], ["F2, M", "rename, merge"], ["Delete, Shift+Delete", "remove, remove and fill"],
  ["Ctrl+A, Ctrl+Shift+A, Ctrl+I", "select all, select none, invert"], ["Ctrl+E, Ctrl+S", "export, save"], ["Ctrl+Z, Ctrl+Shift+Z", "undo, redo"], ["Esc", "cancel, clear, show all"], ["C", "copy the camera"], ["K", "pause or resume training"],
];
$("help-keys").append(...KEY_HELP.flatMap(([key, what]) => [el("b", { textContent: key }), el("span", { textContent: what })]));

/** Images with a button of their own. */
const PANE_BUTTONS = 4;
const option = ([value, textContent]) => el("option", { value, textContent });
$("pane-b").append(...PANES.map(option));
$("pane-more").append(el("option", { value: "", textContent: "More", disabled: true, hidden: true }), ...PANES.slice(PANE_BUTTONS).map(option));
$("pane-more").addEventListener("change", (event) => setPane(0, event.target.value));
for (const [index, [value, name]] of PANES.slice(0, PANE_BUTTONS).entries()) {
  const button = el("button", { type: "button", value, textContent: name, title: `${name} (${index + 1})` });
  button.addEventListener("click", () => setPane(0, value));
  $("pane-a").append(button);
}
$("pane-b").addEventListener("change", (event) => setPane(1, event.target.value));
const on = (id, what) => $(id).addEventListener("click", what);
for (const layout of ["one", "wipe", "pair"]) on(`layout-${layout}`, () => stage.setLayout(layout));
for (const photo of ["off", "wipe", "switch", "error"]) on(`photo-${photo}`, () => stage.setPhoto(photo));
on("mode-orbit", () => fly(false));
on("mode-fly", () => fly(true));
on("level", act.level);
on("home", act.home);
on("copy-camera", act.copyCamera);
on("help-open", act.help);
on("act-frame", () => frameLabels(edits.chosen));
on("act-alone", () => labels.alone(edits.chosen));
on("act-choose", act.choose);
$("photo-pixels").addEventListener("change", (event) => { stage.isExact = event.target.checked; stage.change(); });
$("background").addEventListener("change", (event) => {
  const value = Number.parseInt(event.target.value.slice(1), 16);
  link.send({ kind: "background", colour: [value >> 16, (value >> 8) & 255, value & 255].map((byte) => byte / 255) });
});

const tabs = { stage: $("tab-stage"), labels: $("tab-labels"), views: $("tab-views") };
for (const [tab, button] of Object.entries(tabs)) {
  button.addEventListener("click", () => {
    document.body.dataset.tab = tab;
    choose(tabs, tab);
  });
}
choose(tabs, "stage");
fly(false);
stage.captions();

// For whoever drives the page from outside.
window.labelgs = { rig, stage, link, labels, edits, views, training, input, finding, selecting, measuring, path };
