// value4 of all planes (caught_up.glsl).

CAUGHT_UP(means, late_means)
CAUGHT_UP(scales, late_rest.x)
CAUGHT_UP(quats, late_rest.y)
CAUGHT_UP(sh0, late_rest.z)
CAUGHT_UP(sh1, late_rest.w)
CAUGHT_UP(sh2, late_rest.w)
CAUGHT_UP(sh3, late_rest.w)
