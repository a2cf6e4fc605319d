// The page: labels and the first camera.

const SPZ_AXIS_SIGNS = [1, -1, -1]; // between the axes of scenes (x right, y down, z forward) and those of the SPZ
const middle = (values) => values.sort()[values.length >> 1];

// A camera that sees the model, upright: from where the first photo was taken, but no farther than a small model needs.
function rigOf(positions, { view }, size) {
  const count = positions.length / 3;
  const step = Math.max(1, Math.floor(count / 20000));
  const rows = Array.from({ length: Math.ceil(count / step) }, (_, at) => 3 * at * step);
  const target = [0, 1, 2].map((axis) => middle(Float32Array.from(rows, (row) => positions[row + axis])));
  const far = Float32Array.from(rows, (row) => length(sub(positions.subarray(row, row + 3), target))).sort();
  const whole = 2.2 * Math.max(far[Math.floor(0.6 * far.length)], 1e-3);
  const from = view ? sub(view.eye, target) : [0.45, 0.34, 0.82];
  const rig = new Rig();
  rig.size = size;
  rig.reset({ views: [], target, distance: view ? Math.min(whole, length(from)) : whole, up: view?.up ?? [0, 1, 0], from });
  return rig;
}

// A camera of `labelgs render --camera` in the axes of the model.
function cameraOf(text) {
  const { w2c, ...lens } = JSON.parse(text);
  const rows = w2c.slice(0, 3).map((row) => [...SPZ_AXIS_SIGNS.map((sign, axis) => sign * row[axis]), row[3] + dot(row, about.origin)]);
  const numbers = [...rows.flat(), ...['fx', 'fy', 'cx', 'cy', 'W', 'H'].map((name) => lens[name])];
  if (!numbers.every(Number.isFinite)) throw new Error('not a camera');
  return { w2c: rows, ...lens };
}

// The widest lens that a tall window gets, which would see past the ends of most scenes: focal length in heights.
const TALL_FOCAL_MIN = 0.7;
// Behind an object that is shown alone, so that a dark one is seen too.
const SOLO_BACKGROUND = [0.16, 0.17, 0.19];

const byId = (id) => document.getElementById(id);
const about = JSON.parse(byId('about').textContent);

function fail(error) {
  byId('message').textContent = error.message;
  byId('message').hidden = false;
}

async function start() {
  const canvas = byId('picture');
  const picture = new Picture(canvas);
  const rowOf = new Map(about.labels.map(({ id }, row) => [id, row]));
  const model = await decode(byId('model').textContent, rowOf, picture.texelsMax);
  picture.hold(model, about.labels.length);
  const ratio = Math.min(2, window.devicePixelRatio || 1);
  const size = () => [canvas.clientWidth, canvas.clientHeight].map((side) => Math.max(1, Math.round(side * ratio)));
  const rig = rigOf(model.positions, about, size());
  const states = about.labels.map(() => ({ shown: true, tinted: false }));
  const nameOf = ({ id, name }) => name ?? (id === 0 ? 'no label' : `label ${id}`);
  let asked = false, changed = true, chosen = null, isAlone = false;

  function lookOf(row) {
    const { shown, tinted } = states[row];
    if (isAlone) return row === chosen ? LOOK.shown : LOOK.hidden;
    if (!shown) return LOOK.hidden;
    if (chosen !== null && chosen !== row) return LOOK.dim;
    return tinted ? LOOK.tinted : LOOK.shown;
  }
  function draw() {
    asked = false;
    if (changed) picture.look(about.labels.map(({ colour }, row) => [...colour, lookOf(row)]));
    changed = false;
    rig.size = size();
    const { w2c, fx, fy, cx, cy, W, H } = rig.file();
    const rows = w2c.slice(0, 3);
    const camera = { turn: rows.map((row) => row.slice(0, 3)), shift: rows.map((row) => row[3]), lens: [fx, fy, cx, cy], size: [W, H] };
    picture.draw({ ...camera, ground: isAlone ? SOLO_BACKGROUND : [0, 0, 0] });
  }
  function ask() {
    if (asked) return;
    asked = true;
    requestAnimationFrame(draw);
  }

  const list = byId('labels');
  const items = about.labels.map((label, row) => {
    const item = document.createElement('li');
    const [box, tint, text, number] = ['input', 'button', 'button', 'span'].map((tag) => document.createElement(tag));
    const words = nameOf(label);
    Object.assign(box, { type: 'checkbox', ariaLabel: `Show ${words}` });
    box.addEventListener('change', () => { states[row].shown = box.checked; update(); });
    Object.assign(tint, { type: 'button', className: 'tint', title: 'Tint', ariaLabel: `Tint ${words}` });
    tint.style.setProperty('--colour', `rgb(${label.colour.join(' ')})`);
    tint.addEventListener('click', () => { states[row].tinted = !states[row].tinted; update(); });
    Object.assign(text, { type: 'button', textContent: words, className: 'name' });
    text.addEventListener('click', () => choose(chosen === row ? null : row));
    Object.assign(number, { textContent: label.gaussians.toLocaleString('en'), className: 'number' });
    item.append(box, tint, text, number);
    list.append(item);
    return { box, tint, text };
  });
  // Shows the state of all labels in the image and the list.
  function update() {
    items.forEach(({ box, tint, text }, row) => {
      box.checked = states[row].shown;
      tint.ariaPressed = String(states[row].tinted);
      text.ariaPressed = String(chosen === row);
    });
    byId('chosen').hidden = chosen === null;
    byId('chosen-name').textContent = chosen === null ? '' : nameOf(about.labels[chosen]);
    byId('alone').ariaPressed = String(isAlone);
    changed = true;
    ask();
  }
  function choose(row, alone = false) {
    [chosen, isAlone] = [row, row !== null && alone];
    update();
  }
  // First to all objects, then to no choice.
  const back = () => choose(isAlone ? chosen : null);
  const isLabelled = about.labels.length > 1 || about.labels.some(({ id }) => id !== 0);
  const at = (point) => {
    const pixel = [(point[0] * canvas.width) / canvas.clientWidth, (point[1] * canvas.height) / canvas.clientHeight];
    const row = isLabelled ? picked(picture, pixel) : null;
    return row !== null && about.labels[row].id !== 0 ? row : null;
  };

  const panel = byId('panel');
  panel.hidden = about.labels.length < 2;
  panel.open = window.innerWidth > 640;
  byId('show-all').addEventListener('click', () => {
    states.forEach((state) => { state.shown = true; });
    choose(null);
  });
  byId('tint-all').addEventListener('click', () => {
    const on = states.some(({ tinted }) => !tinted);
    states.forEach((state) => { state.tinted = on; });
    choose(null);
  });
  byId('alone').addEventListener('click', () => choose(chosen, !isAlone));
  byId('back').addEventListener('click', back);
  byId('counts').addEventListener('change', (event) => document.body.classList.toggle('counted', event.target.checked));

  function hint(isTouch) {
    const [move, pick] = isTouch ? ['Use two fingers to pan and zoom.', 'Tap'] : ['Right-drag to pan, scroll to zoom.', 'Click'];
    const twice = isTouch ? 'double-tap' : 'double-click';
    byId('hint').textContent = `Drag to rotate. ${move}${isLabelled ? ` ${pick} an object to select it, ${twice} to show only this object.` : ''}`;
  }
  hint(matchMedia('(pointer: coarse)').matches);
  window.addEventListener('pointerdown', ({ pointerType }) => hint(pointerType === 'touch'), true);

  const zoom = (factor) => () => { rig.dolly(factor); ask(); };
  function home() {
    rig.home();
    // A tall window shows less at the sides instead of nothing above and below.
    if (rig.view === null) rig.focal = rig.focal.map((focal) => Math.max(focal, TALL_FOCAL_MIN));
    ask();
  }
  function fromAddress() {
    const found = location.hash.match(/^#camera=(.*)$/);
    if (found) {
      try {
        rig.views = [{ camera: cameraOf(decodeURIComponent(found[1])) }];
      } catch {
        fail(new Error('The camera in the address is not a camera of “labelgs render --camera”.'));
      }
    }
    home();
  }
  const keys = { KeyR: home, Escape: back, Minus: zoom(1.1), Equal: zoom(0.9), 'Shift+Equal': zoom(0.9), NumpadAdd: zoom(0.9), NumpadSubtract: zoom(1.1) };
  const click = (point) => { if (!isAlone) choose(at(point)); };
  // The first click of two has chosen already.
  const pivot = () => { if (chosen !== null) choose(chosen, !isAlone); };
  new Input({ box: canvas, change: ask }, rig, { keys, click, pivot });
  byId('reset').addEventListener('click', home);
  const full = byId('full');
  full.hidden = !document.fullscreenEnabled;
  full.addEventListener('click', () => (document.fullscreenElement ? document.exitFullscreen() : document.documentElement.requestFullscreen()));
  document.addEventListener('fullscreenchange', () => { full.textContent = document.fullscreenElement ? 'Exit full screen' : 'Full screen'; });
  window.addEventListener('resize', ask);
  window.addEventListener('hashchange', fromAddress);
  fromAddress();
  update();
  draw();
  byId('message').hidden = true;
}

window.ready = start().then(() => true, (error) => { fail(error); return false; });
