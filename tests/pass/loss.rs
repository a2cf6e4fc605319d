//! Photo loss: its value, and its gradient by the image.

use super::fixture::{Fixture, prove};
use crate::reference::loss::photo_loss;
use crate::support::compare::{GradientBounds, Tolerance, Verdict, close, gradients};
use crate::support::device;
use crate::support::scenes::{Shape, scene};
use labelgs::pass::KernelShape;
use labelgs::scheduler::plan::Buf;

/// Sums of 121 f32 products of the window, twice; SSIM divides by variances that are small differences. Seen: 0.75 of
/// (1e-5, 1e-5) by element, 0.31 of 1e-5 as a whole.
const BOUNDS: GradientBounds = GradientBounds {
    element: Tolerance { absolute: 1.1e-5, relative: 1.1e-5 },
    outliers: 0.0,
    norm: 4.6e-6,
    angle: 1e-11,
    bias: 4.6e-6,
};
const VALUE: Tolerance = Tolerance { absolute: 1e-6, relative: 0.0 };
/// Pixels nearer than this to the kink of L1 are left out.
const KINK: f64 = 1e-6;

/// Sizes below and above a workgroup, none a multiple of a strip; with a dispatch for each filter, and with tiles in
/// shared memory.
#[test]
fn photo_loss_equals_its_mirror() {
    for (seed, width, height, loss_tile) in [(91, 61, 45, 0), (92, 70, 133, 0), (91, 61, 45, 16), (92, 70, 133, 8)] {
        let Some(turn) = device() else { return };
        let kernels = KernelShape { loss_tile, ..KernelShape::for_device(turn.capabilities()) };
        let shape = Shape { gaussians: 150, width, height, ..Shape::default() };
        let mut fixture = Fixture::with_shape(turn, scene(seed, &shape), false, kernels);
        let counters = fixture.train().counters;
        let pixels = fixture.pixels();
        let image: Vec<[f64; 3]> =
            fixture.get::<[f32; 4]>(Buf::IMAGE, pixels).iter().map(|&[r, g, b, _]| [r, g, b].map(f64::from)).collect();
        let v_image = fixture.get::<[f32; 4]>(Buf::V_IMAGE, pixels);
        let photo = &fixture.scene.target.photo;
        let sums = [counters.loss_l1, counters.loss_ssim].map(|v| f64::from(v) / photo.elements());
        let bearing = ["l1_weight", "dssim_weight", "ssim_sigma", "ssim_reach", "ssim_c1", "ssim_c2"];
        prove(&format!("photo loss {width}x{height}, tiles of {loss_tile}"), &bearing, |rules| -> Verdict {
            let expected = photo_loss(rules, &image, photo);
            let sure: Vec<usize> = (0..pixels).filter(|&i| expected.margins[i] > KINK).collect();
            let actual = sure.iter().flat_map(|&i| [0, 1, 2].map(|c| f64::from(v_image[i][c]))).collect::<Vec<_>>();
            let wanted = sure.iter().flat_map(|&i| expected.v_image[i]).collect::<Vec<_>>();
            let of_gradient = gradients(&actual, &wanted, BOUNDS)?;
            close(&sums, &[expected.l1, expected.ssim], VALUE)?;
            Ok(of_gradient)
        });
    }
}
