#version 460
#include "layout.glsl"
#include "constants.glsl"
#include "step.glsl"
// ssim_columns — first of four: vertical Gaussian window over x, y, x^2 + y^2 and x y.
// Work:    x: 64 columns per workgroup, y: strips of STRIP rows, z: channel. A lane reads STRIP + 10 rows once.
// Reads:   step; image [P]; target [P] RGBA8 (pixels with alpha 0 are ignored; both images count as 0 there)
// Writes:  moments [3, P] vec4 (mean x, mean y, mean x^2 + y^2, mean x y), filtered along columns
// Math:    SSIM needs only the sum of the two second moments. 11 taps, sigma 1.5, zero padding.
// Mirror:  src/reference/loss.rs::ssim

layout(local_size_x = 64) in;
READ1(0, StepUniforms, step);
FETCH4(1, image);
FETCHC(2, target);
WRITE(3, vec4, moments);
#include "ssim.glsl"

void main() {
    uint width = step.width, height = step.height;
    uint x = gl_GlobalInvocationID.x, y0 = gl_WorkGroupID.y * STRIP, channel = gl_WorkGroupID.z;
    if (x >= width) {
        return;
    }
    vec4 sum[STRIP];
    [[unroll]] for (uint k = 0u; k < STRIP; k++) {
        sum[k] = vec4(0.0);
    }
    [[unroll]] for (int r = 0; r < int(STRIP) + 10; r++) {
        int y = int(y0) + r - 5;
        bool inside = y >= 0 && y < int(height);
        uint p = inside ? uint(y) * width + x : 0u;
        vec4 t = fetchc(target, p), c = fetch4(image, p);
        bool counts = inside && t.w > 0.5;
        float a = counts ? (channel == 0u ? c.x : channel == 1u ? c.y : c.z) : 0.0;
        float b = counts ? (channel == 0u ? t.x : channel == 1u ? t.y : t.z) : 0.0;
        vec4 m = vec4(a, b, a * a + b * b, a * b);
        [[unroll]] for (int k = 0; k < int(STRIP); k++) {
            if (r >= k && r - k <= 10) {
                sum[k] += WINDOW[r - k] * m;
            }
        }
    }
    [[unroll]] for (uint k = 0u; k < STRIP; k++) {
        if (y0 + k < height) {
            moments[channel * (width * height) + (y0 + k) * width + x] = sum[k];
        }
    }
}
