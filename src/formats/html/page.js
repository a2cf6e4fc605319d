// The page: labels, mouse, keys and touch.

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
  const camera = new Camera(model.positions, about);
  const looks = about.labels.map(({ colour }) => [...colour, 1]);
  let asked = false, changed = true;

  function draw() {
    asked = false;
    if (changed) picture.look(looks);
    changed = false;
    const ratio = Math.min(2, window.devicePixelRatio || 1);
    picture.draw(camera.at(Math.round(canvas.clientWidth * ratio), Math.round(canvas.clientHeight * ratio)));
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
      camera.take(JSON.parse(decodeURIComponent(found[1])));
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

  const touches = new Map();
  canvas.addEventListener('pointerdown', (event) => {
    canvas.setPointerCapture(event.pointerId);
    touches.set(event.pointerId, event);
  });
  for (const kind of ['pointerup', 'pointercancel']) canvas.addEventListener(kind, (event) => touches.delete(event.pointerId));
  canvas.addEventListener('pointermove', (event) => {
    const before = touches.get(event.pointerId);
    if (!before) return;
    const side = Math.min(canvas.clientWidth, canvas.clientHeight);
    const [x, y] = [(event.clientX - before.clientX) / side, (event.clientY - before.clientY) / side];
    if (touches.size === 2) {
      const [other] = [...touches.values()].filter((touch) => touch.pointerId !== event.pointerId);
      const gap = (touch) => Math.hypot(touch.clientX - other.clientX, touch.clientY - other.clientY);
      camera.zoom(Math.max(1, gap(before)) / Math.max(1, gap(event)));
      camera.pan(x / 2, y / 2);
    } else if (event.buttons & 6 || event.shiftKey) camera.pan(x, y);
    else camera.orbit(3 * x, 3 * y);
    touches.set(event.pointerId, event);
    ask();
  });
  canvas.addEventListener('contextmenu', (event) => event.preventDefault());
  canvas.addEventListener('wheel', (event) => {
    event.preventDefault();
    camera.zoom(Math.exp(0.0015 * event.deltaY));
    ask();
  }, { passive: false });
  canvas.addEventListener('keydown', (event) => {
    const keys = {
      ArrowLeft: () => camera.orbit(0.1, 0), ArrowRight: () => camera.orbit(-0.1, 0),
      ArrowUp: () => camera.orbit(0, 0.1), ArrowDown: () => camera.orbit(0, -0.1),
      '+': () => camera.zoom(0.9), '-': () => camera.zoom(1.1), r: () => camera.reset(),
    };
    if (!keys[event.key]) return;
    event.preventDefault();
    keys[event.key]();
    ask();
  });
  byId('reset').addEventListener('click', () => { camera.reset(); ask(); });
  window.addEventListener('resize', ask);
  window.addEventListener('hashchange', fromAddress);
  fromAddress();
  draw();
  byId('message').hidden = true;
}

window.ready = start().then(() => true, (error) => { fail(error); return false; });
