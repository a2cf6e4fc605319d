// Extensions, and the macros with which every shader declares its interface. First include of every .comp file.
//
// A storage block has exactly one member. The member's name is the buffer's name in GLSL and in Rust:
//   READ(0, vec4, means)       readonly array       WRITE, INOUT likewise
//   READ1(1, Counters, counts) one readonly struct  WRITE1, INOUT1 likewise
//   FETCH4(2, quats)           array of vec4 that is only read by fetch4(quats, i); a texel buffer if TEXEL is defined
//   FETCH2(3, records)         array of vec2, likewise with fetch2(records, i)
//   FETCHU(3, labels)          array of uint, likewise with fetchu(labels, i)
//   FETCHC(3, target)          array of RGBA8 colours, read by fetchc(target, i) as vec4 in 0 to 1
#ifndef LAYOUT_GLSL
#define LAYOUT_GLSL

#extension GL_EXT_samplerless_texture_functions : require
#extension GL_EXT_control_flow_attributes : require
#extension GL_KHR_memory_scope_semantics : require
#extension GL_KHR_shader_subgroup_basic : require
#extension GL_KHR_shader_subgroup_arithmetic : require
#extension GL_KHR_shader_subgroup_shuffle : require
#extension GL_KHR_shader_subgroup_ballot : require

#define STORAGE(number, access) layout(std430, set = 0, binding = number) access buffer

#define READ(number, T, name) STORAGE(number, readonly) name##_block { T name[]; }
#define WRITE(number, T, name) STORAGE(number, writeonly) name##_block { T name[]; }
#define INOUT(number, T, name) STORAGE(number, ) name##_block { T name[]; }

// Also sees writes of other workgroups of the dispatch that have arrived before (arrival.glsl).
#define INOUT_SHARED(number, T, name) STORAGE(number, coherent) name##_block { T name[]; }

#define READ1(number, T, name) STORAGE(number, readonly) name##_block { T name; }
#define WRITE1(number, T, name) STORAGE(number, writeonly) name##_block { T name; }
#define INOUT1(number, T, name) STORAGE(number, ) name##_block { T name; }

// Push constants of a pass: passes that differ only in these are compiled once. On the Rust side they are like
// specialisation constants.
layout(push_constant) uniform PassWords {
    uint COUNT_SOURCE; // what the items are (count.glsl)
    uint LANES;        // of a sort or scan over all workgroups
    uint SHIFT;        // of a digit
    uint TOTAL;        // counter of a scan: 0 visible, 1 instances, 2 layer tiles, 3 densified
    uint CELLS;        // totals of a sort
    uint SEGMENT;      // of long lists (blend_tile.glsl),
    uint SEGMENTS;     // and their number
    uint WALK;         // walk of a tile for its labels,
    uint WALKS;        // and their number
    uint SORT_PASS;    // pass among those of the step's sorts; first pass of the sort of the keys that are written
    uint LOOK_FIRST;   // ticket of a pass that looks back; the words of its partitions follow (look_back.glsl)
    uint LOOK_HELD;    // for tests: 1 + the partition that tells nothing
    uint VISIBLE_ITEMS; // Gaussians of an invocation of project_visible
    uint PARTIALS;     // sums of the loss, or of the exposure
    uint PLANE;        // of a state (find_nonfinite.comp),
    uint ROW_WORDS;    // the words of its rows,
    uint ROWS_FIXED;   // and their number, 0 for one of each Gaussian
};

#ifdef TEXEL
#define FETCH4(number, name) layout(set = 0, binding = number) uniform textureBuffer name
#define FETCH2(number, name) FETCH4(number, name)
#define FETCHU(number, name) layout(set = 0, binding = number) uniform utextureBuffer name
#define fetch4(name, i) texelFetch(name, int(i))
#define fetch2(name, i) texelFetch(name, int(i)).xy
#define fetchu(name, i) texelFetch(name, int(i)).x
#else
#define FETCH4(number, name) READ(number, vec4, name)
#define FETCH2(number, name) READ(number, vec2, name)
#define FETCHU(number, name) READ(number, uint, name)
#define fetch4(name, i) name[i]
#define fetch2(name, i) name[i]
#define fetchu(name, i) name[i]
#endif
// The shader unpacks the bytes, not the texel unit: the same bits on every device.
#define FETCHC(number, name) FETCHU(number, name)
#define fetchc(name, i) unpackUnorm4x8(fetchu(name, i))

#endif
