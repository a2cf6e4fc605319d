#version 460
#include "layout.glsl"
#include "constants.glsl"
#include "step.glsl"
// ssim_rows_backward — third of four: horizontal window over the three derivative maps; SSIM sum over row strips.
// Work:    x: 64 rows per workgroup, y: strips of STRIP columns, z: channel.
// Reads:   step; v_moments [3, P]
// Writes:  v_rows [3, P] vec4 (three filtered maps, 0)
// Mirror:  src/reference/loss.rs::ssim_backward

layout(local_size_x = 64) in;
READ1(0, StepUniforms, step);
FETCH4(1, v_moments);
WRITE(2, vec4, v_rows);
#include "ssim.glsl"

void main() {
    uint width = step.width, height = step.height;
    uint y = gl_GlobalInvocationID.x, x0 = gl_WorkGroupID.y * STRIP, channel = gl_WorkGroupID.z;
    if (y >= height) {
        return;
    }
    uint plane = channel * (width * height) + y * width;
    vec3 sum[STRIP];
    float value[STRIP];
    [[unroll]] for (uint k = 0u; k < STRIP; k++) {
        sum[k] = vec3(0.0);
        value[k] = 0.0;
    }
    [[unroll]] for (int r = 0; r < int(STRIP) + 10; r++) {
        int x = int(x0) + r - 5;
        bool inside = x >= 0 && x < int(width);
        vec4 m = fetch4(v_moments, plane + (inside ? uint(x) : 0u));
        m = inside ? m : vec4(0.0);
        [[unroll]] for (int k = 0; k < int(STRIP); k++) {
            if (r >= k && r - k <= 10) {
                sum[k] += WINDOW[r - k] * m.xyz;
            }
            if (r - k == 5) {
                value[k] = m.w;
            }
        }
    }
    [[unroll]] for (uint k = 0u; k < STRIP; k++) {
        if (x0 + k < width) {
            v_rows[plane + x0 + k] = vec4(sum[k], value[k]);
        }
    }
}
