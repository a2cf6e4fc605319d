//! Pictures in bands, for devices that end loops after some rounds.

use super::fixture::readable;
use crate::support::compare::{Tolerance, check, close, exact};
use crate::support::device;
use crate::support::scenes::{Shape, scene};
use labelgs::engine::{Engine, EngineSize};
use labelgs::pass::KernelShape;
use labelgs::render::{Render, RenderOptions, label_map, render};

#[test]
fn bands_make_the_picture_of_the_whole() {
    let Some(turn) = device() else { return };
    let mut scene = scene(97, &Shape { gaussians: 200, width: 61, height: 45, ..Shape::default() });
    // Beyond the limit of slopes of a band, but not of the picture.
    scene.gaussians.scales.iter_mut().step_by(9).for_each(|scale| *scale = scale.map(|value| value + 1.0));
    let draw = |loop_rounds: Option<u32>| -> (u32, Render, Vec<u16>) {
        let shape = KernelShape { loop_rounds, ..KernelShape::for_device(turn.capabilities()) };
        let (camera, options) = (&scene.camera, RenderOptions::default());
        let size = EngineSize::for_model(&scene.gaussians, std::iter::once((camera.width, camera.height)));
        let mut engine = Engine::with_shape(turn.gpu(), shape, size, readable()).expect("an engine");
        engine.upload_model(&scene.gaussians).expect("it fits");
        let drawn = render(&mut engine, camera, &options).expect("a picture");
        let labels = label_map(&mut engine, camera, options.near).expect("a label map").ids;
        (engine.size().image.1, drawn, labels)
    };
    // Two rows of tiles at a time.
    let tiles_x = KernelShape::for_device(turn.capabilities()).tiles(61, 1).0;
    let ((whole, expected, labels), (band, found, in_bands)) = (draw(None), draw(Some(2 * tiles_x + 3)));
    assert!(whole == 45 && band * 2 < 45, "bands of {band} rows");
    let floats = |drawn: &Render| -> Vec<f64> {
        let colours = drawn.rgb.as_flattened().iter().chain(&drawn.alpha).chain(&drawn.depth).chain(&drawn.top_weight);
        colours.map(|&value| f64::from(value)).collect()
    };
    // Places of splats count from the first row of the band, and round otherwise.
    check("picture", close(&floats(&found), &floats(&expected), Tolerance { absolute: 2e-5, relative: 2e-5 }));
    check("main Gaussians", exact(&found.top_id, &expected.top_id));
    check("labels", exact(&found.labels, &expected.labels));
    check("label map", exact(&in_bands, &labels));
}
