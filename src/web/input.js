// Mouse, touch and keys on the image.

/** Radians per pixel of a drag. */
const RADIANS_PER_PIXEL = 0.0055;
/** Pixels that a click may move. */
const CLICK_MOTION_MAX = 4;
/** Milliseconds that a click waits for a second one. */
const DOUBLE_CLICK_MS = 280;

/** Keys that move, by their place on the keyboard: right, down, forward. */
const MOVE_KEYS = {
  KeyW: [0, 0, 1], KeyS: [0, 0, -1], KeyA: [-1, 0, 0], KeyD: [1, 0, 0], KeyQ: [0, 1, 0], KeyE: [0, -1, 0],
};
/** Keys that turn: right and down. */
const TURN_KEYS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };

export class Input {
  /**
   * `stage` has the element `box` and draws after `change`; `actions` has what keys and clicks do besides moving, and may have
   * a `tool` that takes clicks of both buttons and drags of the left one.
   */
  constructor(stage, rig, actions) {
    Object.assign(this, { stage, rig, actions, held: new Set(), pointers: new Map(), isFlight: false });
    this.moved = 0;
    const { box } = stage;
    box.addEventListener("pointerdown", (event) => this.down(event));
    box.addEventListener("pointermove", (event) => this.move(event));
    for (const kind of ["pointerup", "pointercancel"]) box.addEventListener(kind, (event) => this.up(event));
    box.addEventListener("pointerleave", () => this.actions.hover?.(null));
    box.addEventListener("wheel", (event) => this.wheel(event), { passive: false });
    box.addEventListener("contextmenu", (event) => event.preventDefault());
    box.addEventListener("auxclick", (event) => event.preventDefault());
    window.addEventListener("keydown", (event) => this.key(event));
    window.addEventListener("keyup", (event) => this.release(event));
    window.addEventListener("blur", () => this.held.clear());
  }

  at(event) {
    const { left, top } = this.stage.box.getBoundingClientRect();
    return [event.clientX - left, event.clientY - top];
  }

  down(event) {
    if (event.target.closest?.(".wipe, .veil, form, .palette, .chip")) return;
    // The ring around what has the focus is for the keyboard.
    this.stage.box.classList.add("clicked");
    this.stage.box.focus({ preventScroll: true });
    this.stage.box.setPointerCapture(event.pointerId);
    this.pointers.set(event.pointerId, this.at(event));
    this.moved = 0;
    this.start = this.at(event);
    this.tool = this.pointers.size === 1 ? this.actions.tool?.(event) ?? null : this.endTool();
    if (event.button === 1) event.preventDefault();
  }

  move(event) {
    const last = this.pointers.get(event.pointerId);
    if (!last) return this.actions.hover?.(this.at(event));
    const now = this.at(event);
    const [dx, dy] = [now[0] - last[0], now[1] - last[1]];
    this.moved += Math.hypot(dx, dy);
    if (this.moved <= CLICK_MOTION_MAX) return;
    this.pointers.set(event.pointerId, now);
    this.stage.box.classList.add("dragging");
    this.actions.moved?.();
    if (this.pointers.size === 2) return this.pinch(event.pointerId, last, now);
    const isPan = event.buttons & 6 || (event.shiftKey && !this.tool);
    if (this.tool && !isPan) {
      this.isBoxed = true;
      return this.tool.drag(this.start, now, event);
    }
    if (isPan) {
      const ratio = this.rig.size[1] / this.stage.box.clientHeight;
      this.rig.pan(dx * ratio, dy * ratio);
    } else {
      this.rig.orbit(dx * RADIANS_PER_PIXEL, dy * RADIANS_PER_PIXEL, this.isFlight);
    }
    this.stage.change(true);
  }

  /** Two fingers: their distance zooms, their middle pans. */
  pinch(id, last, now) {
    const other = [...this.pointers].find(([key]) => key !== id)[1];
    const far = (point) => Math.max(Math.hypot(point[0] - other[0], point[1] - other[1]), 8);
    this.rig.dolly(far(last) / far(now));
    this.rig.pan((now[0] - last[0]) / 2, (now[1] - last[1]) / 2);
    this.stage.change(true);
  }

  /** A second finger takes the drag over. */
  endTool(to = null, event = null) {
    if (this.isBoxed) this.tool?.box(this.start, to, event);
    this.isBoxed = false;
    return null;
  }

  up(event) {
    if (!this.pointers.delete(event.pointerId)) return;
    this.stage.box.classList.remove("dragging");
    if (this.isBoxed) return this.endTool(event.type === "pointercancel" ? null : this.at(event), event);
    if (this.tool && event.type !== "pointercancel" && this.moved <= CLICK_MOTION_MAX && event.button !== 1) {
      return this.tool.click(this.at(event), event.button === 0, event);
    }
    if (event.type === "pointercancel" || this.moved > CLICK_MOTION_MAX || event.button !== 0) return;
    const at = this.at(event);
    // Of the hand, not of the image that a slow machine drew in between.
    const now = event.timeStamp;
    if (this.last && now - this.last.when < DOUBLE_CLICK_MS && Math.hypot(at[0] - this.last.at[0], at[1] - this.last.at[1]) < 6) {
      this.last = null;
      return this.actions.pivot(at);
    }
    this.last = { at, when: now };
    this.actions.click(at, { add: event.shiftKey, take: event.ctrlKey || event.metaKey });
  }

  wheel(event) {
    event.preventDefault();
    const lines = event.deltaMode === 1 ? 18 : 1;
    const factor = Math.exp(Math.max(-1, Math.min(1, event.deltaY * lines * 0.0012)));
    if (this.isFlight) this.rig.fly([0, 0, (1 - factor) * 2], 1 / this.rig.speed);
    else this.rig.dolly(factor);
    this.stage.change(true);
  }

  key(event) {
    this.stage.box.classList.remove("clicked");
    const target = event.target;
    const isText = target.matches?.("input:not([type=range]):not([type=color]), textarea, select");
    if (isText || document.querySelector("dialog[open]")) return;
    const isCommand = event.ctrlKey || event.metaKey;
    const isArrow = event.code in TURN_KEYS;
    // Arrows belong to lists and bars that have the focus; movement to everything else.
    const isOnPicture = target === document.body || target === this.stage.box;
    if (!isCommand && (event.code in MOVE_KEYS || (isArrow && isOnPicture))) {
      event.preventDefault();
      if (!this.held.has(event.code)) {
        this.held.add(event.code);
        if (this.held.size === 1) this.run(performance.now());
      }
      this.modifiers = event;
      return;
    }
    // Space and Enter press the button that has the focus.
    if ((event.code === "Space" || event.code === "Enter") && !isOnPicture) return;
    const name = `${isCommand ? "Ctrl+" : ""}${event.shiftKey && event.key !== "?" ? "Shift+" : ""}${event.key === "?" ? "?" : event.code}`;
    const action = this.actions.keys[name];
    if (!action) return;
    event.preventDefault();
    if (!event.repeat || name.startsWith("Bracket")) action();
  }

  release(event) {
    this.held.delete(event.code);
    this.modifiers = event;
    this.actions.released?.[event.code]?.();
  }

  /** Moves while keys are held. */
  run(last) {
    requestAnimationFrame((now) => {
      if (this.held.size === 0) return;
      const seconds = Math.min((now - last) / 1000, 0.1);
      const pace = (this.modifiers?.shiftKey ? 4 : 1) * (this.modifiers?.altKey ? 0.25 : 1);
      const sum = (table) => [...this.held].filter((code) => code in table).map((code) => table[code]);
      for (const move of sum(MOVE_KEYS)) this.rig.fly(move.map((part) => part * pace), seconds);
      for (const [right, down] of sum(TURN_KEYS)) this.rig.orbit(right * seconds * 1.4 * pace, down * seconds * 1.4 * pace, this.isFlight);
      this.stage.change(true);
      this.run(now);
    });
  }
}
