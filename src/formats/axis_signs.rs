//! Converts between the axes of file formats by signs. Ours are those of COLMAP and the 3DGS PLY: x right, y down, z
//! forward.

/// The signs of the axes x, y, z: a half turn, or a mirror if their product is negative. It is its own inverse.
#[derive(Clone, Copy, Debug)]
pub(super) struct Signs(pub(super) [f32; 3]);

impl Signs {
    /// Converts a position.
    pub(super) fn position(self, at: [f32; 3]) -> [f32; 3] {
        let Self([x, y, z]) = self;
        [x * at[0], y * at[1], z * at[2]]
    }

    /// Converts a rotation (w, x, y, z). A mirror flips its axis and its sense, which leaves the ellipsoid correct.
    pub(super) fn quat(self, quat: [f32; 4]) -> [f32; 4] {
        let Self([x, y, z]) = self;
        [quat[0], y * z * quat[1], x * z * quat[2], x * y * quat[3]]
    }

    /// Converts the coefficients above degree 0: each basis function is even or odd in each axis.
    pub(super) fn rest(self, rest: &mut [[f32; 3]]) {
        rest.iter_mut().zip(self.signs()).for_each(|(triple, sign)| *triple = triple.map(|value| sign * value));
    }

    /// Returns the factor of each coefficient above degree 0.
    pub(super) fn signs(self) -> [f32; 15] {
        let Self([x, y, z]) = self;
        [y, z, x, x * y, y * z, 1.0, x * z, 1.0, y, x * y * z, y, z, x, z, x]
    }
}
