// Draws the model: sorts the Gaussians by depth and blends them from back to front.

const SORT_BUCKETS = 65536;
const NEAR_PLANE = 0.01;
// How the Gaussians of a label look.
const LOOK = { hidden: 0, shown: 1, tinted: 2, dim: 3 };

class Picture {
  constructor(canvas) {
    this.canvas = canvas;
    const gl = canvas.getContext('webgl2', { alpha: false, antialias: false, depth: false, preserveDrawingBuffer: true });
    if (!gl) throw new Error('This browser has no WebGL 2, which the picture needs.');
    this.gl = gl;
    this.program = this.linked();
    const uniforms = ['data', 'looks', 'width', 'stride', 'degree', 'antialiased', 'turn', 'shift', 'eye', 'lens', 'size'];
    this.place = Object.fromEntries(uniforms.map((name) => [name, gl.getUniformLocation(this.program, name)]));
    this.vertices = gl.createBuffer();
    gl.bindBuffer(gl.ARRAY_BUFFER, this.vertices);
    gl.bufferData(gl.ARRAY_BUFFER, new Float32Array([-1, -1, 1, -1, -1, 1, 1, 1]), gl.STATIC_DRAW);
    const corner = gl.getAttribLocation(this.program, 'corner');
    gl.enableVertexAttribArray(corner);
    gl.vertexAttribPointer(corner, 2, gl.FLOAT, false, 0, 0);
    this.order = gl.createBuffer();
    gl.bindBuffer(gl.ARRAY_BUFFER, this.order);
    const row = gl.getAttribLocation(this.program, 'row');
    gl.enableVertexAttribArray(row);
    gl.vertexAttribIPointer(row, 1, gl.UNSIGNED_INT, 0, 0);
    gl.vertexAttribDivisor(row, 1);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    this.shown = 0;
  }

  linked() {
    const { gl } = this;
    const program = gl.createProgram();
    for (const [kind, source] of [[gl.VERTEX_SHADER, VERTEX], [gl.FRAGMENT_SHADER, FRAGMENT]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, source);
      gl.compileShader(shader);
      gl.attachShader(program, shader);
    }
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error(`The picture cannot be drawn: ${gl.getProgramInfoLog(program)}`);
    gl.useProgram(program);
    return program;
  }

  get texelsMax() { return Math.min(4096, this.gl.getParameter(this.gl.MAX_TEXTURE_SIZE)); }

  texture(unit, name, inner, width, height, format, type, values) {
    const { gl } = this;
    gl.activeTexture(gl.TEXTURE0 + unit);
    gl.bindTexture(gl.TEXTURE_2D, gl.createTexture());
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.NEAREST);
    gl.texImage2D(gl.TEXTURE_2D, 0, inner, width, height, 0, format, type, values);
    gl.uniform1i(this.place[name], unit);
  }

  // Takes a model, and a number of labels.
  hold(model, labels) {
    const { gl } = this;
    this.model = model;
    this.depths = new Float32Array(model.count);
    this.sorted = new Uint32Array(model.count);
    this.texture(0, 'data', gl.RGBA32UI, model.width, model.height, gl.RGBA_INTEGER, gl.UNSIGNED_INT, model.words);
    this.lookRows = Math.max(1, Math.ceil(labels / 256));
    this.texture(1, 'looks', gl.RGBA8UI, 256, this.lookRows, gl.RGBA_INTEGER, gl.UNSIGNED_BYTE, null);
    for (const name of ['width', 'stride', 'degree', 'antialiased']) gl.uniform1i(this.place[name], model[name]);
  }

  // Sets tint and state of each label.
  look(looks) {
    const { gl } = this;
    const bytes = new Uint8Array(256 * this.lookRows * 4);
    looks.forEach((look, row) => bytes.set(look, 4 * row));
    gl.activeTexture(gl.TEXTURE1);
    gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, 256, this.lookRows, gl.RGBA_INTEGER, gl.UNSIGNED_BYTE, bytes);
    this.hidden = looks.map((look) => look[3] === LOOK.hidden);
  }

  // Puts the rows that are shown in order, the farthest first.
  sort({ turn, shift }) {
    const { positions, rows, count } = this.model;
    const [, , forward] = turn;
    let [low, high] = [Infinity, -Infinity];
    for (let row = 0; row < count; row++) {
      let depth = forward[0] * positions[3 * row] + forward[1] * positions[3 * row + 1] + forward[2] * positions[3 * row + 2] + shift[2];
      if (depth < NEAR_PLANE || this.hidden[rows[row]]) depth = -1;
      else {
        low = Math.min(low, depth);
        high = Math.max(high, depth);
      }
      this.depths[row] = depth;
    }
    const scale = (SORT_BUCKETS - 1) / Math.max(high - low, 1e-9);
    const ends = new Uint32Array(SORT_BUCKETS + 1);
    const bucket = (depth) => Math.floor((high - depth) * scale);
    let shown = 0;
    for (const depth of this.depths) if (depth >= 0) { ends[bucket(depth) + 1]++; shown++; }
    for (let at = 1; at <= SORT_BUCKETS; at++) ends[at] += ends[at - 1];
    this.depths.forEach((depth, row) => { if (depth >= 0) this.sorted[ends[bucket(depth)]++] = row; });
    this.shown = shown;
    this.gl.bufferData(this.gl.ARRAY_BUFFER, this.sorted.subarray(0, shown), this.gl.STREAM_DRAW);
  }

  // Draws from a camera: rows of `turn` and `shift` map the world to it; focal lengths and centre are in px of `size`.
  draw(camera) {
    const { gl, canvas } = this;
    const [width, height] = camera.size;
    if (canvas.width !== width || canvas.height !== height) [canvas.width, canvas.height] = [width, height];
    gl.viewport(0, 0, width, height);
    this.sort(camera);
    const { place } = this, { turn, shift } = camera;
    gl.uniformMatrix3fv(place.turn, true, turn.flat());
    gl.uniform3fv(place.shift, shift);
    gl.uniform3fv(place.eye, [0, 1, 2].map((axis) => -turn.reduce((sum, row, at) => sum + row[axis] * shift[at], 0)));
    gl.uniform4fv(place.lens, camera.lens);
    gl.uniform2fv(place.size, camera.size);
    this.camera = camera;
    gl.clearColor(...(camera.ground ?? [0, 0, 0]), 1);
    gl.clear(gl.COLOR_BUFFER_BIT);
    gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, this.shown);
  }
}
