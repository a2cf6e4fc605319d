//! Kernel shapes: the way of reading changes no bit, and the tile size only the last bits.

use crate::pass::fixture::{Fixture, GRADIENT_PLANES};
use crate::support::compare::{Band, Tolerance, check, close_with_band, exact};
use crate::support::device;
use crate::support::scenes::{Scene, Shape, scene};
use labelgs::pass::KernelShape;
use labelgs::scheduler::plan::Buf;

fn crowd() -> Scene {
    scene(201, &Shape { gaussians: 300, width: 61, height: 45, opacities: (-4.0, 8.0), ..Shape::default() })
}

/// Runs a step and a render with a changed kernel shape.
fn with_shape<T>(change: impl Fn(&mut KernelShape), read: impl Fn(&mut Fixture) -> T) -> Option<T> {
    let turn = device()?;
    let mut shape = KernelShape::for_device(turn.capabilities());
    change(&mut shape);
    let mut fixture = Fixture::with_shape(turn, crowd(), true, shape);
    Some(read(&mut fixture))
}

/// Picture, main Gaussians, labels of one shape.
fn picture(fixture: &mut Fixture) -> (Vec<f64>, Vec<i32>, Vec<u32>) {
    let (pixels, count) = (fixture.pixels(), fixture.scene.gaussians.len());
    fixture.render();
    let main = fixture.get::<i32>(Buf::MAIN_GAUSSIAN, pixels);
    fixture.train();
    let image = fixture.get::<f32>(Buf::IMAGE, 4 * pixels);
    (image.iter().map(|&v| f64::from(v)).collect(), main, fixture.get(Buf::LABELS, count))
}

#[test]
fn the_picture_does_not_depend_on_the_tile_size() {
    let tile = |size: (u32, u32)| with_shape(|shape| (shape.tile_width, shape.tile_height) = size, picture);
    let Some(subgroup) = device().map(|turn| turn.subgroup_size()) else { return };
    let Some(first) = tile((8, 8)) else { return };
    // A lane owns pixels of one column, so tiles are at most as wide as a subgroup.
    for size in [(4, 8), (8, 16), (16, 8), (16, 16)]
        .into_iter()
        .filter(|size| size.0 <= subgroup && size.0 * size.1 >= subgroup)
    {
        let Some(other) = tile(size) else { return };
        // Offsets are relative to the corner of the tile, so their last bits differ, and a pair at the cut may flip.
        let tolerance = Tolerance { absolute: 1e-6, relative: 0.0 };
        let band = Band { width: 1.0, flip: 0.01, ratio: 0.0005 };
        let summary = check(
            "picture",
            close_with_band(&other.0, &first.0, &vec![0.0; first.0.len()], (tolerance, band), |_, _| true),
        );
        let different = other.1.iter().zip(&first.1).filter(|(a, b)| a != b).count();
        println!("tiles {size:?}: {} flips, {different} main Gaussians differ", summary.flips);
        assert!(different * 1000 <= first.1.len(), "{different} main Gaussians differ");
        check("labels", exact(&other.2, &first.2));
    }
}

/// All results of a step, as bits.
fn everything(fixture: &mut Fixture) -> Vec<u32> {
    fixture.input.update = true;
    fixture.train();
    let (pixels, splats, count) = (fixture.pixels(), fixture.splats().len(), fixture.scene.gaussians.len());
    let mut bits = fixture.get::<u32>(Buf::IMAGE, 4 * pixels);
    bits.extend(fixture.get::<u32>(Buf::V_IMAGE, 4 * pixels));
    bits.extend(fixture.get::<u32>(Buf::V_SPLATS, 12 * splats));
    GRADIENT_PLANES[..4].iter().for_each(|&plane| bits.extend(fixture.get::<u32>(plane, 4 * splats)));
    bits.extend(fixture.get::<u32>(Buf::MEANS, 4 * count));
    bits.extend(fixture.get::<u32>(Buf::SH3, 20 * count));
    bits.extend(fixture.get::<u32>(Buf::LABELS, count));
    bits
}

#[test]
fn storage_and_texel_reads_give_the_same_bits() {
    let (Some(texel), Some(storage)) =
        (with_shape(|shape| shape.texel = true, everything), with_shape(|shape| shape.texel = false, everything))
    else {
        return;
    };
    check("bits", exact(&storage, &texel));
}

#[test]
fn digits_of_the_sort_change_nothing() {
    let (Some(four), Some(eight)) =
        (with_shape(|shape| shape.digit_bits = 4, everything), with_shape(|shape| shape.digit_bits = 8, everything))
    else {
        return;
    };
    check("bits", exact(&four, &eight));
}
