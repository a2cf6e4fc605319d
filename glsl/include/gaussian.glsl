// A Gaussian in the world: its rotation, its place before a camera, its opacity.

// Unit quaternion, and 1 / length. If the squared length leaves the range of f32, the largest component is scaled to
// 1 first; a quaternion of 0 has no direction and gives NaN.
vec4 unit_quat(vec4 q, out float inv_norm) {
    float squared = dot(q, q);
    bool usual = squared > 1e-24 && squared < 1e24;
    float scale = usual ? 1.0 : 1.0 / max(max(abs(q.x), abs(q.y)), max(abs(q.z), abs(q.w)));
    vec4 scaled = q * scale;
    float inv_scaled = inversesqrt(usual ? squared : dot(scaled, scaled));
    inv_norm = scale * inv_scaled;
    return scaled * inv_scaled;
}

mat3 rotation_from_quat(vec4 q) { // unit (w, x, y, z)
    float w = q.x, x = q.y, y = q.z, z = q.w;
    return mat3(
        1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z), 2.0 * (x * z - w * y),
        2.0 * (x * y - w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z + w * x),
        2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y));
}

// Subtracts the camera centre before the rotation, so that scenes far from the origin keep their precision.
vec3 to_view(StepUniforms step, vec3 mean) {
    vec3 d = mean - step.camera_centre;
    return vec3(dot(step.view_row0, d), dot(step.view_row1, d), dot(step.view_row2, d));
}

// log2 of the sigmoid, without rounding the sigmoid first.
float log2_opacity(float logit) {
    return -log2(1.0 + exp(-clamp(logit, -30.0, 30.0)));
}

float sigmoid(float logit) {
    return exp2(log2_opacity(logit));
}

bool finite(float x) { // tests the exponent bits, because drivers fold x - x
    return (floatBitsToUint(x) & 0x7f800000u) != 0x7f800000u;
}

// Scales that are at least the smallest deviation, their last element, if there is one.
vec4 limited(vec4 scale) {
    return vec4(scale.w > 0.0 ? max(scale.xyz, vec3(log(scale.w))) : scale.xyz, scale.w);
}
