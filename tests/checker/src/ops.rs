//! What arithmetic instructions compute, once for constants and for vectors of lanes.
//!
//! Registers have 32 bits. A bool is 0 or 1; a 16-bit integer is a word. Sums, products, quotients and square roots
//! of f32 are those of IEEE 754, one rounding each. Transcendental functions are computed in f64 and rounded.

/// Applies an expression to every lane of its arguments.
macro_rules! lanes {
    ($all:ident ($($arg:ident),*) $body:expr) => {{
        let [$($arg),*] = $all;
        std::array::from_fn(|lane| {
            $(let $arg: u32 = $arg[lane];)*
            $body
        })
    }};
}

/// Defines an enum of operations on `n` arguments, with a function that applies one of them to every lane.
macro_rules! operations {
    ($(#[$meta:meta])* $name:ident[$n:literal] $args:tt { $($variant:ident => $body:expr,)* }) => {
        $(#[$meta])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        #[allow(missing_docs, reason = "the names of SPIR-V")]
        pub enum $name { $($variant),* }

        impl $name {
            /// Applies the operation to every lane.
            #[inline(always)]
            pub fn each<const W: usize>(self, all: [&[u32; W]; $n]) -> [u32; W] {
                match self { $($name::$variant => lanes!(all $args $body),)* }
            }

            /// Applies the operation to one value, as for constants.
            pub fn one(self, all: [u32; $n]) -> u32 {
                let all = all.map(|value| [value]);
                self.each::<1>(all.each_ref())[0]
            }
        }
    };
}

fn f(bits: u32) -> f32 {
    f32::from_bits(bits)
}

fn wide(bits: u32) -> f64 {
    f64::from(f(bits))
}

fn rounded(value: f64) -> u32 {
    (value as f32).to_bits()
}

fn i(bits: u32) -> i32 {
    bits.cast_signed()
}

operations!(
    /// Operations on one value.
    Unary[1] (a) {
        FNegate => a ^ 0x8000_0000,
        SNegate => i(a).wrapping_neg().cast_unsigned(),
        Not => !a,
        LogicalNot => a ^ 1,
        BitCount => a.count_ones(),
        BitReverse => a.reverse_bits(),
        ConvertFToU => f(a) as u32,
        ConvertFToS => (f(a) as i32).cast_unsigned(),
        ConvertUToF => (a as f32).to_bits(),
        ConvertSToF => (i(a) as f32).to_bits(),
        Low16 => a & 0xffff,
        IsNan => u32::from(f(a).is_nan()),
        IsInf => u32::from(f(a).is_infinite()),
        FAbs => a & 0x7fff_ffff,
        SAbs => i(a).wrapping_abs().cast_unsigned(),
        FSign => if f(a) > 0.0 { 1.0_f32.to_bits() } else if f(a) < 0.0 { (-1.0_f32).to_bits() } else { 0 },
        SSign => i(a).signum().cast_unsigned(),
        Floor => f(a).floor().to_bits(),
        Ceil => f(a).ceil().to_bits(),
        Trunc => f(a).trunc().to_bits(),
        RoundEven => f(a).round_ties_even().to_bits(),
        Fract => (f(a) - f(a).floor()).to_bits(),
        Sqrt => f(a).sqrt().to_bits(),
        InverseSqrt => rounded(1.0 / wide(a).sqrt()),
        Exp => rounded(wide(a).exp()),
        Exp2 => rounded(wide(a).exp2()),
        Log => rounded(wide(a).ln()),
        Log2 => rounded(wide(a).log2()),
        Sin => rounded(wide(a).sin()),
        Cos => rounded(wide(a).cos()),
        Tan => rounded(wide(a).tan()),
        Asin => rounded(wide(a).asin()),
        Acos => rounded(wide(a).acos()),
        Atan => rounded(wide(a).atan()),
        FindILsb => if a == 0 { u32::MAX } else { a.trailing_zeros() },
        FindUMsb => if a == 0 { u32::MAX } else { 31 - a.leading_zeros() },
        FindSMsb => {
            let bits = if i(a) < 0 { !a } else { a };
            if bits == 0 { u32::MAX } else { 31 - bits.leading_zeros() }
        },
    }
);

operations!(
    /// Operations on two values. A quotient by 0 is 0, as no kernel may use it.
    Binary[2] (a, b) {
        IAdd => a.wrapping_add(b),
        ISub => a.wrapping_sub(b),
        IMul => a.wrapping_mul(b),
        UDiv => a.checked_div(b).unwrap_or(0),
        UMod => a.checked_rem(b).unwrap_or(0),
        SDiv => i(a).checked_div(i(b)).unwrap_or(0).cast_unsigned(),
        SRem => i(a).checked_rem(i(b)).unwrap_or(0).cast_unsigned(),
        SMod => {
            let rest = i(a).checked_rem(i(b)).unwrap_or(0);
            (if rest != 0 && (rest < 0) != (i(b) < 0) { rest + i(b) } else { rest }).cast_unsigned()
        },
        FAdd => (f(a) + f(b)).to_bits(),
        FSub => (f(a) - f(b)).to_bits(),
        FMul => (f(a) * f(b)).to_bits(),
        FDiv => (f(a) / f(b)).to_bits(),
        FMod => (f(a) - f(b) * (f(a) / f(b)).floor()).to_bits(),
        ShiftLeftLogical => a.wrapping_shl(b),
        ShiftRightLogical => a.wrapping_shr(b),
        ShiftRightArithmetic => i(a).wrapping_shr(b).cast_unsigned(),
        BitwiseAnd => a & b,
        BitwiseOr => a | b,
        BitwiseXor => a ^ b,
        LogicalNotEqual => a ^ b,
        LogicalEqual => (a ^ b) ^ 1,
        IEqual => u32::from(a == b),
        INotEqual => u32::from(a != b),
        ULessThan => u32::from(a < b),
        ULessThanEqual => u32::from(a <= b),
        UGreaterThan => u32::from(a > b),
        UGreaterThanEqual => u32::from(a >= b),
        SLessThan => u32::from(i(a) < i(b)),
        SLessThanEqual => u32::from(i(a) <= i(b)),
        SGreaterThan => u32::from(i(a) > i(b)),
        SGreaterThanEqual => u32::from(i(a) >= i(b)),
        FOrdEqual => u32::from(f(a) == f(b)),
        FOrdNotEqual => u32::from(f(a) < f(b) || f(a) > f(b)),
        FUnordNotEqual => u32::from(f(a) != f(b)),
        FOrdLessThan => u32::from(f(a) < f(b)),
        FOrdLessThanEqual => u32::from(f(a) <= f(b)),
        FOrdGreaterThan => u32::from(f(a) > f(b)),
        FOrdGreaterThanEqual => u32::from(f(a) >= f(b)),
        FUnordLessThan => u32::from(!(f(a) >= f(b))),
        FUnordLessThanEqual => u32::from(!(f(a) > f(b))),
        FUnordGreaterThan => u32::from(!(f(a) <= f(b))),
        FUnordGreaterThanEqual => u32::from(!(f(a) < f(b))),
        UMin => a.min(b),
        UMax => a.max(b),
        SMin => i(a).min(i(b)).cast_unsigned(),
        SMax => i(a).max(i(b)).cast_unsigned(),
        FMin => if f(b) < f(a) { b } else { a },
        FMax => if f(a) < f(b) { b } else { a },
        Step => if f(b) < f(a) { 0 } else { 1.0_f32.to_bits() },
        Pow => rounded(wide(a).powf(wide(b))),
        Atan2 => rounded(wide(a).atan2(wide(b))),
        // Byte `b` of an UnpackUnorm4x8.
        UnpackUnorm8 => (f32::from((a >> (8 * b)) as u8) / 255.0).to_bits(),
    }
);

operations!(
    /// Operations on three values.
    Ternary[3] (a, b, c) {
        Select => if a != 0 { b } else { c },
        Fma => f(a).mul_add(f(b), f(c)).to_bits(),
        FClamp => {
            let raised = if f(a) < f(b) { b } else { a };
            if f(c) < f(raised) { c } else { raised }
        },
        UClamp => a.max(b).min(c),
        SClamp => i(a).max(i(b)).min(i(c)).cast_unsigned(),
        FMix => (f(a) * (1.0 - f(c)) + f(b) * f(c)).to_bits(),
        BitFieldUExtract => ((u64::from(a) >> b) & ((1_u64 << c) - 1)) as u32,
        BitFieldSExtract => if c == 0 { 0 } else {
            ((u64::from(a) >> b) as u32).wrapping_shl(32 - c).cast_signed().wrapping_shr(32 - c).cast_unsigned()
        },
    }
);
