// One-dimensional work folded over two axes, because one axis has at most 65,535 groups. Needs constants.glsl.
#ifndef DISPATCH_GLSL
#define DISPATCH_GLSL

uint linear_group_id() {
    return gl_WorkGroupID.y * FOLD + gl_WorkGroupID.x;
}

uvec3 folded_groups(uint groups) {
    return groups <= FOLD ? uvec3(groups, groups > 0u ? 1u : 0u, 1u) : uvec3(FOLD, (groups + FOLD - 1u) / FOLD, 1u);
}

#endif
