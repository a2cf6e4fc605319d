// The connection to the server: requests, frames, and reconnection.

/** Bytes of a frame's header. */
const HEADER_BYTES = 36;
/** Milliseconds between two signs of life. */
const ALIVE_INTERVAL_MS = 20000;

export class Link {
  /** `hear` gets the messages by kind; `draw` a frame, and returns a promise that ends when it is drawn. */
  constructor(hear, draw, changed) {
    this.hear = hear;
    this.draw = draw;
    this.changed = changed;
    this.seq = 0;
    this.socket = null;
    this.isOver = false;
    setInterval(() => this.send({ kind: "alive" }), ALIVE_INTERVAL_MS);
    this.open();
  }

  open() {
    const socket = new WebSocket(`ws://${location.host}/socket`);
    socket.binaryType = "arraybuffer";
    this.socket = socket;
    socket.onopen = () => this.changed("on");
    socket.onmessage = ({ data }) => {
      if (typeof data === "string") {
        const message = JSON.parse(data);
        if (message.kind === "over") this.isOver = true;
        this.hear(message);
      } else {
        this.receive(data);
      }
    };
    socket.onclose = () => this.closed();
  }

  /** Reports why the connection is lost, and reconnects. */
  async closed() {
    this.socket = null;
    this.changed(this.isOver ? "over" : "off");
    let wait = 1000;
    try {
      const answer = await fetch("/icon.svg", { cache: "no-store" });
      if (answer.status === 401) {
        this.changed("token");
        wait = 3000;
      }
    } catch {
      // Still away.
    }
    setTimeout(() => this.open(), wait);
  }

  get isOpen() {
    return this.socket?.readyState === WebSocket.OPEN;
  }

  send(message) {
    if (this.isOpen) this.socket.send(JSON.stringify(message));
    return this.isOpen;
  }

  /** Asks for a frame. The server draws the newest request only. */
  look(request) {
    this.seq += 1;
    this.send({ kind: "look", seq: this.seq, ...request });
    return this.seq;
  }

  /** Asks what is at a pixel. Returns the number of the answer. */
  pick(from, pixel) {
    this.seq += 1;
    this.send({ kind: "pick", seq: this.seq, from, pixel });
    return this.seq;
  }

  async receive(data) {
    const words = new DataView(data);
    const word = (index) => words.getUint32(4 * index, true);
    const frame = { seq: word(1), step: word(2), width: word(3), height: word(4), ms: word(5) / 1000, exact: (word(6) & 1) === 1, mapped: (word(6) & 2) === 2, depths: [words.getFloat32(28, true), words.getFloat32(32, true)], blobs: [] };
    let at = HEADER_BYTES;
    for (let index = 0; index < word(6) >> 2; index += 1) {
      const size = words.getUint32(at, true);
      frame.blobs.push(new Blob([new Uint8Array(data, at + 4, size)]));
      at += 4 + size;
    }
    try {
      await this.draw(frame);
    } finally {
      this.send({ kind: "ack", seq: frame.seq });
    }
  }
}
