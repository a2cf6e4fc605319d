// The page: labels and the first camera.

const FLIP = [1, -1, -1]; // between the axes of scenes (x right, y down, z forward) and those of the SPZ
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
  const rows = w2c.slice(0, 3).map((row) => [...FLIP.map((sign, axis) => sign * row[axis]), row[3] + dot(row, about.origin)]);
  const numbers = [...rows.flat(), ...['fx', 'fy', 'cx', 'cy', 'W', 'H'].map((name) => lens[name])];
  if (!numbers.every(Number.isFinite)) throw new Error('not a camera');
  return { w2c: rows, ...lens };
}

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
  const looks = about.labels.map(({ colour }) => [...colour, 1]);
  let asked = false, changed = true;

  function draw() {
    asked = false;
    if (changed) picture.look(looks);
    changed = false;
    rig.size = size();
    const { w2c, fx, fy, cx, cy, W, H } = rig.file();
    const rows = w2c.slice(0, 3);
    picture.draw({ turn: rows.map((row) => row.slice(0, 3)), shift: rows.map((row) => row[3]), lens: [fx, fy, cx, cy], size: [W, H] });
  }
  function ask() {
    if (asked) return;
    asked = true;
    requestAnimationFrame(draw);
  }
  function look(row, state) {
    looks[row][3] = state;
    changed = true;
    ask();
  }

  function fromAddress() {
    const found = location.hash.match(/^#camera=(.*)$/);
    if (!found) return;
    try {
      rig.views = [{ camera: cameraOf(decodeURIComponent(found[1])) }];
      rig.home();
    } catch {
      fail(new Error('The camera in the address is not one of “render --camera”.'));
    }
    ask();
  }

  const list = byId('labels');
  about.labels.forEach(({ id, name, colour, gaussians }, row) => {
    const item = document.createElement('li');
    const [shown, tint, text, number] = ['input', 'button', 'span', 'span'].map((tag) => document.createElement(tag));
    const words = name ?? (id === 0 ? 'without a label' : `label ${id}`);
    Object.assign(shown, { type: 'checkbox', checked: true, ariaLabel: `Show ${words}` });
    shown.addEventListener('change', () => look(row, shown.checked ? (tint.ariaPressed === 'true' ? 2 : 1) : 0));
    Object.assign(tint, { type: 'button', className: 'tint', title: 'Tint', ariaLabel: `Tint ${words}`, ariaPressed: 'false' });
    tint.style.setProperty('--colour', `rgb(${colour.join(' ')})`);
    tint.addEventListener('click', () => {
      tint.ariaPressed = tint.ariaPressed === 'true' ? 'false' : 'true';
      if (shown.checked) look(row, tint.ariaPressed === 'true' ? 2 : 1);
    });
    Object.assign(text, { textContent: words, className: 'name' });
    Object.assign(number, { textContent: gaussians.toLocaleString('en'), className: 'number' });
    item.append(shown, tint, text, number);
    list.append(item);
  });
  byId('panel').hidden = about.labels.length < 2;
  const all = (what) => list.querySelectorAll(what);
  byId('show-all').addEventListener('click', () => all('input:not(:checked)').forEach((box) => box.click()));
  byId('tint-all').addEventListener('click', () => {
    const buttons = [...all('.tint')];
    const on = buttons.some((button) => button.ariaPressed !== 'true');
    buttons.filter((button) => (button.ariaPressed === 'true') !== on).forEach((button) => button.click());
  });

  const zoom = (factor) => () => { rig.dolly(factor); ask(); };
  const reset = () => { rig.home(); ask(); };
  const keys = { KeyR: reset, Minus: zoom(1.1), Equal: zoom(0.9), 'Shift+Equal': zoom(0.9), NumpadAdd: zoom(0.9), NumpadSubtract: zoom(1.1) };
  new Input({ box: canvas, change: ask }, rig, { keys, click() {}, pivot() {} });
  byId('reset').addEventListener('click', reset);
  window.addEventListener('resize', ask);
  window.addEventListener('hashchange', fromAddress);
  fromAddress();
  draw();
  byId('message').hidden = true;
}

window.ready = start().then(() => true, (error) => { fail(error); return false; });
