// What the GPU does for each Gaussian and each of its pixels.

const VERTEX = `#version 300 es
precision highp float;
precision highp int;
precision highp usampler2D;
uniform usampler2D data;     // the model, as decode() makes it
uniform usampler2D looks;    // a row of the list of labels: tint r, g, b, and a LOOK
uniform int width, stride, degree;
uniform bool antialiased;    // blur takes opacity
uniform mat3 turn;           // camera from world: x right, y down, z forward
uniform vec3 shift, eye;
uniform vec4 lens;           // fx, fy, cx, cy
uniform vec2 size;           // of the picture, px
in vec2 corner;
in uint row;
out vec2 offset;
flat out vec4 colour;

uvec4 texel(int index) { return texelFetch(data, ivec2(index % width, index / width), 0); }

uint words[12];
vec3 harmonic(int k) {
  vec3 value;
  for (int c = 0; c < 3; c++) {
    int at = 3 * k + c;
    value[c] = (float((words[at >> 2] >> uint((at & 3) * 8)) & 255u) - 128.0) / 128.0;
  }
  return value;
}

// Colours that depend on the direction: real spherical harmonics with the constants of 3DGS.
vec3 bands(int base, vec3 d) {
  for (int i = 0; i < 3; i++) {
    uvec4 four = texel(base + 3 + i);
    words[4 * i] = four.x; words[4 * i + 1] = four.y; words[4 * i + 2] = four.z; words[4 * i + 3] = four.w;
  }
  vec3 sum = 0.4886025 * (-d.y * harmonic(0) + d.z * harmonic(1) - d.x * harmonic(2));
  if (degree < 2) return sum;
  float xx = d.x * d.x, yy = d.y * d.y, zz = d.z * d.z;
  sum += 1.0925484 * (d.x * d.y * harmonic(3) - d.y * d.z * harmonic(4) - d.x * d.z * harmonic(6))
       + 0.3153916 * (2.0 * zz - xx - yy) * harmonic(5) + 0.5462742 * (xx - yy) * harmonic(7);
  if (degree < 3) return sum;
  return sum - 0.5900436 * (d.y * (3.0 * xx - yy) * harmonic(8) + d.x * (xx - 3.0 * yy) * harmonic(14))
       + 2.8906114 * d.x * d.y * d.z * harmonic(9) + 1.4453057 * d.z * (xx - yy) * harmonic(13)
       - 0.4570458 * (4.0 * zz - xx - yy) * (d.y * harmonic(10) + d.x * harmonic(12))
       + 0.3731763 * d.z * (2.0 * zz - 3.0 * xx - 3.0 * yy) * harmonic(11);
}

void main() {
  gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
  offset = vec2(0.0);
  colour = vec4(0.0);
  int base = int(row) * stride;
  uvec4 first = texel(base), second = texel(base + 1), third = texel(base + 2);
  uvec4 look = texelFetch(looks, ivec2(int(first.w) % 256, int(first.w) / 256), 0);
  vec3 place = uintBitsToFloat(first.xyz);
  vec3 p = turn * place + shift;
  if (look.a == 0u || p.z < 0.01) return;

  vec4 c = uintBitsToFloat(second);
  vec2 c2 = uintBitsToFloat(third.xy);
  mat3 spread = mat3(c.x, c.y, c.z, c.y, c.w, c2.x, c.z, c2.x, c2.y);
  // Slopes beyond the image are limited as in 3DGS, where the projection is no longer linear.
  vec2 most = 1.3 * 0.5 * size / lens.xy, centre = (lens.zw - 0.5 * size) / lens.xy;
  vec2 slope = clamp(p.xy / p.z, -most - centre, most - centre);
  mat3x2 j = mat3x2(lens.x / p.z, 0.0, 0.0, lens.y / p.z, -lens.x * slope.x / p.z, -lens.y * slope.y / p.z);
  mat3x2 m = j * turn;
  mat2 flat2 = m * spread * transpose(m);
  float a = flat2[0][0] + 0.3, b = flat2[0][1], d = flat2[1][1] + 0.3;
  float middle = 0.5 * (a + d), half_gap = length(vec2(0.5 * (a - d), b));
  float large = middle + half_gap, small = max(middle - half_gap, 0.1);
  vec2 axis = abs(b) < 1e-9 ? (a >= d ? vec2(1.0, 0.0) : vec2(0.0, 1.0)) : normalize(vec2(b, large - a));

  vec4 bytes = vec4(third.z & 255u, (third.z >> 8) & 255u, (third.z >> 16) & 255u, third.z >> 24) / 255.0;
  if (antialiased) bytes.a *= sqrt(max(determinant(flat2) / (a * d - b * b), 0.0));
  if (bytes.a < 1.0 / 255.0) return;
  float reach = sqrt(2.0 * log(255.0 * bytes.a));
  offset = corner * reach;
  vec2 at = lens.xy * p.xy / p.z + lens.zw;
  at += axis * sqrt(large) * offset.x + vec2(-axis.y, axis.x) * sqrt(small) * offset.y;
  gl_Position = vec4(2.0 * at.x / size.x - 1.0, 1.0 - 2.0 * at.y / size.y, 0.0, 1.0);

  vec3 shade = 0.5 + 0.2820948 * (bytes.rgb - 0.5) / 0.15;
  if (degree > 0) shade += bands(base, normalize(place - eye));
  shade = max(shade, 0.0);
  if (look.a == 2u) shade = mix(shade, vec3(look.rgb) / 255.0, 0.6);
  if (look.a == 3u) shade = mix(vec3(dot(shade, vec3(0.299, 0.587, 0.114))), shade, 0.3) * 0.4;
  colour = vec4(shade, bytes.a);
}`;

const FRAGMENT = `#version 300 es
precision highp float;
in vec2 offset;
flat in vec4 colour;
out vec4 pixel;
void main() {
  float alpha = min(0.99, colour.a * exp(-0.5 * dot(offset, offset)));
  if (alpha < 1.0 / 255.0) discard;
  pixel = vec4(colour.rgb * alpha, alpha);
}`;
