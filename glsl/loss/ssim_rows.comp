#version 460
#include "layout.glsl"
#include "constants.glsl"
#include "step.glsl"
// ssim_rows — second of four: horizontal window, SSIM and its derivatives with respect to the filtered moments.
// Work:    x: 64 rows per workgroup, y: strips of STRIP columns, z: channel.
// Reads:   step; moments [3, P]; target [P] (the value of pixels with alpha 0 is ignored)
// Writes:  v_moments [3, P] vec4: d ssim / d mean x, / d mean (x^2 + y^2), / d mean x y, value; 0 for ignored pixels
// Math:    ssim.glsl
// Mirror:  src/reference/loss.rs::ssim

layout(local_size_x = 64) in;
READ1(0, StepUniforms, step);
FETCH4(1, moments);
FETCHC(2, target);
WRITE(3, vec4, v_moments);
#include "ssim.glsl"

void main() {
    uint width = step.width, height = step.height;
    uint y = gl_GlobalInvocationID.x, x0 = gl_WorkGroupID.y * STRIP, channel = gl_WorkGroupID.z;
    if (y >= height) {
        return;
    }
    uint plane = channel * (width * height) + y * width;
    vec4 sum[STRIP];
    [[unroll]] for (uint k = 0u; k < STRIP; k++) {
        sum[k] = vec4(0.0);
    }
    [[unroll]] for (int r = 0; r < int(STRIP) + 10; r++) {
        int x = int(x0) + r - 5;
        bool inside = x >= 0 && x < int(width);
        vec4 m = fetch4(moments, plane + (inside ? uint(x) : 0u));
        m = inside ? m : vec4(0.0);
        [[unroll]] for (int k = 0; k < int(STRIP); k++) {
            if (r >= k && r - k <= 10) {
                sum[k] += WINDOW[r - k] * m;
            }
        }
    }
    [[unroll]] for (uint k = 0u; k < STRIP; k++) {
        uint x = x0 + k;
        if (x < width) {
            bool counts = fetchc(target, y * width + x).w > 0.5;
            v_moments[plane + x] = counts ? ssim(sum[k]) : vec4(0.0);
        }
    }
}
