// First and second moments m and v of Adam of an element of a plane, each a vec4, in memory: in two planes of floats,
// or with HALF in one of words, a word for each parameter.
//
// A word has q = m / sqrt(v) in its high 16 bits, in steps of 1 / MOMENT_RATIO: Adam lets no |q| be more than 7.3. Its
// low 16 bits have log2(sqrt(v)) above -MOMENT_FLOOR, in steps of 1 / MOMENT_LOG, from about ADAM_EPSILON to 2^14; or 0
// where v is 0, and the whole word is. A plane of zeros therefore means zero moments in both forms.
//
// Values between two steps are rounded stochastically, so that they are right on average over many updates. With
// rounding to nearest, v would never change: an update moves it by a thousandth of g^2 - v, and half a step is 7e-4 of
// v. The draw depends on the step's seed, the element and its plane, so the same step has the same bits. Draws differ
// from those of other passes.

#ifdef HALF
#include "random.glsl"

#define READ_MOMENTS(first, second, name) READ(first, uvec4, m_##name)
#define WRITE_MOMENTS(first, second, name) WRITE(first, uvec4, m_##name)
#define MOMENTS(first, second, name) INOUT(first, uvec4, m_##name)

// sqrt(v) of codes above 0.
vec4 root_of(uvec4 code) {
    vec4 octave = uintBitsToFloat((code / MOMENT_LOG + (127u - MOMENT_FLOOR)) << 23);
    return octave * exp2(vec4(code % MOMENT_LOG) * (1.0 / float(MOMENT_LOG)));
}

void unpack_moments(uvec4 words, out vec4 m, out vec4 v) {
    uvec4 code = words & 0xffffu;
    vec4 root = mix(root_of(code), vec4(0.0), equal(code, uvec4(0u)));
    m = vec4(ivec4(words) >> 16) * (1.0 / MOMENT_RATIO) * root;
    v = root * root;
}

// Rounds down or up, by 16 random bits.
ivec4 round_at_random(vec4 x, uvec4 bits) {
    vec4 low = floor(x);
    return ivec4(low) + ivec4(greaterThan(x - low, (vec4(bits) + 0.5) * (1.0 / 65536.0)));
}

uvec4 pack_moments(vec4 m, vec4 v, uint seed, uint e, uint plane) {
    uint hash = pcg_hash(pcg_hash(seed) + e) + MOMENT_DRAWS + 4u * plane;
    uvec4 draw = uvec4(pcg_hash(hash), pcg_hash(hash + 1u), pcg_hash(hash + 2u), pcg_hash(hash + 3u));
    // By octaves, because a logarithm as large as 50 has no bits for parts of a step.
    uvec4 bits = floatBitsToUint(v);
    vec4 part = log2(uintBitsToFloat((bits & 0x7fffffu) | 0x3f000000u)) * float(MOMENT_LOG / 2u);
    ivec4 octave = ivec4(bits >> 23) - 126 + 2 * int(MOMENT_FLOOR);
    uvec4 code = uvec4(clamp(octave * int(MOMENT_LOG / 2u) + round_at_random(part, draw & 0xffffu), 1, 0xffff));
    vec4 ratio = clamp(m / root_of(code) * MOMENT_RATIO, -32767.0, 32767.0);
    uvec4 words = uvec4(round_at_random(ratio, draw >> 16)) << 16 | code;
    return mix(words, uvec4(0u), lessThan(bits, uvec4(0x800000u)));
}

#define load_moments(name, e, m, v) unpack_moments(m_##name[e], m, v)
#define store_moments(name, e, m, v, seed, plane) m_##name[e] = pack_moments(m, v, seed, e, plane)
#define forget_moments(name, e, part) m_##name[e].part = 0u

#else
#define READ_MOMENTS(first, second, name) FETCH4(first, m_##name); FETCH4(second, u_##name)
#define WRITE_MOMENTS(first, second, name) WRITE(first, vec4, m_##name); WRITE(second, vec4, u_##name)
#define MOMENTS(first, second, name) INOUT(first, vec4, m_##name); INOUT(second, vec4, u_##name)

#define load_moments(name, e, m, v) m = plane4(m_##name, e), v = plane4(u_##name, e)
#define store_moments(name, e, m, v, seed, plane) m_##name[e] = m, u_##name[e] = v
#define forget_moments(name, e, part) m_##name[e].part = 0.0, u_##name[e].part = 0.0
#endif

// All planes of parameters, and their moments.
#define INOUT_PLANES(at, first, second) \
    INOUT(at, vec4, means); INOUT(at + 1, vec4, scales); INOUT(at + 2, vec4, quats); INOUT(at + 3, vec4, sh0); \
    INOUT(at + 4, vec4, sh1); INOUT(at + 5, vec4, sh2); INOUT(at + 6, vec4, sh3); \
    MOMENTS(first, second, means); MOMENTS(first + 1, second + 1, scales); MOMENTS(first + 2, second + 2, quats); \
    MOMENTS(first + 3, second + 3, sh0); MOMENTS(first + 4, second + 4, sh1); MOMENTS(first + 5, second + 5, sh2); \
    MOMENTS(first + 6, second + 6, sh3)
