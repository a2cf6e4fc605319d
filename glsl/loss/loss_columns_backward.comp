#version 460
#include "layout.glsl"
#include "constants.glsl"
#include "step.glsl"
#include "subgroup.glsl"
// loss_columns_backward — last of four: vertical window, gradient of L1 and SSIM with respect to the image, loss sums.
// Work:    64 columns per workgroup, strips of STRIP rows.
// Reads:   step; v_rows [3, P]; image [P]; target [P]
// Writes:  v_image [P] (rgb, 0); loss_partials [strips, subgroups of columns] (sum |x - y|, sum ssim)
// Math:    (1 - lambda) |x - y| + lambda (1 - ssim), times loss_scale = 1 / (3 valid pixels)
// Order:   fixed, bitwise reproducible.
// Mirror:  src/reference/loss.rs::ssim_backward

layout(local_size_x = 64) in;
READ1(0, StepUniforms, step);
FETCH4(1, v_rows);
FETCH4(2, image);
FETCHC(3, target);
WRITE(4, vec4, v_image);
WRITE(5, vec2, loss_partials);
#include "ssim.glsl"

void main() {
    uint width = step.width, height = step.height;
    uint x = gl_GlobalInvocationID.x, y0 = gl_WorkGroupID.y * STRIP;
    uint column = min(x, width - 1u), pixels = width * height;
    float weight = step.lambda_dssim * step.loss_scale, weight_l1 = (1.0 - step.lambda_dssim) * step.loss_scale;
    vec2 losses = vec2(0.0);
    vec3 gradient[STRIP];
    [[unroll]] for (uint k = 0u; k < STRIP; k++) {
        gradient[k] = vec3(0.0);
    }
    [[unroll]] for (uint channel = 0u; channel < 3u; channel++) {
        vec3 sum[STRIP];
        [[unroll]] for (uint k = 0u; k < STRIP; k++) {
            sum[k] = vec3(0.0);
        }
        [[unroll]] for (int r = 0; r < int(STRIP) + 10; r++) {
            int y = int(y0) + r - 5;
            bool inside = y >= 0 && y < int(height);
            vec4 m = fetch4(v_rows, channel * pixels + (inside ? uint(y) * width + column : 0u));
            m = inside ? m : vec4(0.0);
            losses.y += r >= 5 && r < int(STRIP) + 5 ? m.w : 0.0;
            [[unroll]] for (int k = 0; k < int(STRIP); k++) {
                if (r >= k && r - k <= 10) {
                    sum[k] += WINDOW[r - k] * m.xyz;
                }
            }
        }
        [[unroll]] for (uint k = 0u; k < STRIP; k++) {
            bool inside = y0 + k < height;
            uint p = inside ? (y0 + k) * width + column : 0u;
            vec4 c = fetch4(image, p), t = fetchc(target, p);
            float a = c[channel], b = t[channel];
            bool counts = inside && t.w > 0.5;
            float difference = counts ? a - b : 0.0;
            losses.x += abs(difference);
            float v = weight_l1 * sign(difference) - weight * (sum[k].x + 2.0 * a * sum[k].y + b * sum[k].z);
            gradient[k][channel] = counts ? v : 0.0;
        }
    }
    if (x < width) {
        [[unroll]] for (uint k = 0u; k < STRIP; k++) {
            if (y0 + k < height) {
                v_image[(y0 + k) * width + x] = vec4(gradient[k], 0.0);
            }
        }
    }
    losses = x < width ? losses : vec2(0.0);
    vec2 total = vec2(subgroup_add(losses.x), subgroup_add(losses.y));
    if (subgroup_elect()) {
        uint subgroups = gl_NumWorkGroups.x * 64u / SUBGROUP_SIZE;
        loss_partials[gl_WorkGroupID.y * subgroups + gl_GlobalInvocationID.x / SUBGROUP_SIZE] = total;
    }
}
