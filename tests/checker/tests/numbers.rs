//! Arithmetic, control flow and subgroup operations give what Rust gives.

use crate::support::{Buffers, compile};

const COUNT: usize = 256;

/// Runs `glsl`, which makes a word `r` of the words `a`, `b` and `c`, and compares with `expected` for many inputs.
fn compare(glsl: &str, expected: impl Fn(u32, u32, u32) -> u32) {
    let program = compile(
        &format!(
            "layout(local_size_x = 64) in;
             layout(binding = 0) readonly buffer A {{ uint left[]; }};
             layout(binding = 1) readonly buffer B {{ uint middle[]; }};
             layout(binding = 2) readonly buffer C {{ uint right[]; }};
             layout(binding = 3) writeonly buffer R {{ uint result[]; }};
             float f(uint bits) {{ return uintBitsToFloat(bits); }}
             uint u(float value) {{ return floatBitsToUint(value); }}
             void main() {{
                 uint i = gl_GlobalInvocationID.x, a = left[i], b = middle[i], c = right[i], r;
                 {glsl}
                 result[i] = r;
             }}"
        ),
        &[],
    );
    let mut buffers = Buffers::zeros(&[COUNT; 4]);
    let mut state = 1_u32;
    let mut next = || {
        state = state.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
        let bits = ((state >> ((state >> 28) + 4)) ^ state).wrapping_mul(277_803_737);
        // Floats near 1 half of the time, so that sums do not only have one term.
        if bits & 1 == 0 { 0x3f80_0000 ^ (bits >> 7) } else { bits }
    };
    buffers.words[..3].iter_mut().for_each(|words| words.iter_mut().for_each(|word| *word = next()));
    assert_eq!(buffers.run(&program, [4, 1, 1], 32, 0), []);
    for i in 0..COUNT {
        let [a, b, c, found] = [0, 1, 2, 3].map(|binding| buffers.words[binding][i]);
        let expected = expected(a, b, c);
        let both_nan = f32::from_bits(found).is_nan() && f32::from_bits(expected).is_nan();
        assert!(found == expected || both_nan, "{glsl}: of {a:#x}, {b:#x}, {c:#x} is {found:#x}, not {expected:#x}");
    }
}

fn f(bits: u32) -> f32 {
    f32::from_bits(bits)
}

#[test]
fn floats_round_once() {
    compare("r = u(f(a) + f(b));", |a, b, _| (f(a) + f(b)).to_bits());
    compare("precise float p = f(a) * f(b); precise float q = p - f(c); r = u(q);", |a, b, c| {
        (f(a) * f(b) - f(c)).to_bits()
    });
    compare("r = u(f(a) / f(b));", |a, b, _| (f(a) / f(b)).to_bits());
    compare("r = u(fma(f(a), f(b), f(c)));", |a, b, c| f(a).mul_add(f(b), f(c)).to_bits());
    compare("r = u(sqrt(abs(f(a))));", |a, _, _| f(a).abs().sqrt().to_bits());
    compare("r = u(exp2(f(a)));", |a, _, _| (f64::from(f(a)).exp2() as f32).to_bits());
    compare("r = u(log2(abs(f(a))));", |a, _, _| (f64::from(f(a).abs()).log2() as f32).to_bits());
    compare("r = u(floor(f(a)) + ceil(f(b)));", |a, b, _| (f(a).floor() + f(b).ceil()).to_bits());
    compare("r = u(mix(f(a), f(b), f(c) < 1.0));", |a, b, c| if f(c) < 1.0 { b } else { a });
}

#[test]
fn integers_wrap() {
    compare("r = a * b + (c >> 3) - (a << (b & 31));", |a, b, c| {
        a.wrapping_mul(b).wrapping_add(c >> 3).wrapping_sub(a << (b & 31))
    });
    compare("r = a / (b | 1) + c % (a | 1);", |a, b, c| (a / (b | 1)).wrapping_add(c % (a | 1)));
    compare("r = uint(int(a) >> int(b & 31));", |a, b, _| (a.cast_signed() >> (b & 31)).cast_unsigned());
    compare("r = uint(bitCount(a) + findLSB(b | 8) + findMSB(c | 8));", |a, b, c| {
        a.count_ones() + (b | 8).trailing_zeros() + 31 - (c | 8).leading_zeros()
    });
    compare("r = bitfieldExtract(a, int(b & 15), int(c & 15));", |a, b, c| a >> (b & 15) & ((1 << (c & 15)) - 1));
    compare("r = uint(clamp(int(a), -5, int(b & 255)));", |a, b, _| {
        a.cast_signed().max(-5).min((b & 255).cast_signed()).cast_unsigned()
    });
    compare("r = uint(float(a)) ^ uint(int(float(int(b))));", |a, b, _| {
        (a as f32) as u32 ^ ((b.cast_signed() as f32) as i32).cast_unsigned()
    });
}

#[test]
fn vectors_and_matrices() {
    let dot = |a: [f32; 3], b: [f32; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    compare("vec3 v = vec3(f(a), f(b), f(c)); r = u(dot(v, v.zxy));", |a, b, c| {
        dot([f(a), f(b), f(c)], [f(c), f(a), f(b)]).to_bits()
    });
    compare("r = u(distance(vec3(f(a), f(b), f(c)), vec3(1, 2, 3)));", |a, b, c| {
        let d = [f(a) - 1.0, f(b) - 2.0, f(c) - 3.0];
        dot(d, d).sqrt().to_bits()
    });
    compare(
        "mat3 m = mat3(1, 2, 3, 4, 5, 6, 7, 8, 9); vec3 v = vec3(f(a), f(b), f(c)); r = u((m * v).y + (v * m).z);",
        |a, b, c| {
            let v = [f(a), f(b), f(c)];
            (dot([2.0, 5.0, 8.0], v) + dot(v, [7.0, 8.0, 9.0])).to_bits()
        },
    );
    compare("uvec4 v = uvec4(a, b, c, 7); v.yx = v.zw; r = v[c & 3] + v.y;", |_, b, c| {
        let _ = b;
        [7, c, c, 7][(c & 3) as usize].wrapping_add(c)
    });
}

#[test]
fn loops_and_branches() {
    compare(
        "r = 0; uint x = a % 1000;
         for (uint n = 0; n < (b & 31); ++n) {
             if ((x & 1) == 0) { x /= 2; continue; }
             if (x == 1) break;
             x = 3 * x + 1;
             switch (x & 3) { case 0: r += 1; break; case 2: r += 2; default: r += 10; }
         }
         r += x;",
        |a, b, _| {
            let (mut r, mut x) = (0_u32, a % 1000);
            for _ in 0..b & 31 {
                if x & 1 == 0 {
                    x /= 2;
                    continue;
                }
                if x == 1 {
                    break;
                }
                x = 3 * x + 1;
                r += match x & 3 {
                    0 => 1,
                    2 => 12,
                    _ => 10,
                };
            }
            r + x
        },
    );
    compare(
        "uint local[8]; for (uint n = 0; n < 8; ++n) local[n] = a >> n;
         uint x = a, y = b;
         for (uint n = 0; n < (c & 15); ++n) { uint z = x; x = y; y = z + local[n & 7]; }
         r = x ^ y;",
        |a, b, c| {
            let (mut x, mut y) = (a, b);
            for n in 0..c & 15 {
                (x, y) = (y, x.wrapping_add(a >> (n & 7)));
            }
            x ^ y
        },
    );
}

#[test]
fn subgroups_of_every_size() {
    let program = compile(
        "layout(local_size_x_id = 1) in;
         layout(binding = 0) writeonly buffer R { uint result[]; };
         void main() {
             uint lane = gl_LocalInvocationIndex, value = lane * 7 + 3, r = 0;
             r += subgroupAdd(value);
             r = r * 3 + subgroupExclusiveAdd(value);
             r = r * 3 + subgroupInclusiveAdd(value);
             r = r * 3 + subgroupShuffle(value, (gl_SubgroupInvocationID + 1) % gl_SubgroupSize);
             r = r * 3 + subgroupShuffleXor(value, 2);
             r = r * 3 + subgroupBallot((value & 1) == 0).x;
             r = r * 3 + subgroupBallot((value & 1) == 0).y;
             r = r * 3 + uint(subgroupElect()) + uint(subgroupAny(lane == 5)) + uint(subgroupAll(lane > 5));
             r = r * 3 + gl_SubgroupID + gl_NumSubgroups;
             result[lane] = r;
         }",
        &[(1, 128)],
    );
    for lanes in [4_u32, 8, 16, 32, 64] {
        let mut buffers = Buffers::zeros(&[128]);
        assert_eq!(buffers.run(&program, [1, 1, 1], lanes, 5), []);
        let value = |lane: u32| lane * 7 + 3;
        for lane in 0..128 {
            let (own, first) = (lane % lanes, lane / lanes * lanes);
            let sum = |range: std::ops::Range<u32>| range.map(value).sum::<u32>();
            let ballot = (0..lanes).fold(0_u64, |bits, other| bits | u64::from(value(first + other) & 1 == 0) << other);
            let holds = u32::from(own == 0) + u32::from(first / lanes == 5 / lanes) + u32::from(first > 5);
            let terms = [
                sum(first..first + lanes),
                sum(first..lane),
                sum(first..lane + 1),
                value(first + (own + 1) % lanes),
                value(lane ^ 2),
                ballot as u32,
                (ballot >> 32) as u32,
                holds,
                lane / lanes + 128 / lanes,
            ];
            let expected = terms.iter().fold(0_u32, |sum, term| sum.wrapping_mul(3).wrapping_add(*term));
            assert_eq!(buffers.words[0][lane as usize], expected, "lane {lane} of {lanes}");
        }
    }
}
