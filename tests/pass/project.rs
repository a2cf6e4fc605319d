//! Culling, compaction, order, projection, and the projection's gradient.

use super::fixture::{Fixture, GRADIENT_PLANES, prove};
use crate::reference::model::ROW_FLOATS;
use crate::reference::project::{near_margin, project_backward, project_forward, sigmoid};
use crate::reference::scan::compact;
use crate::reference::sort::radix_sort;
use crate::reference::splat::{Splat, SplatGradient};
use crate::reference::{Rules, tile};
use crate::support::compare::{GradientBounds, Tolerance, check, close, exact};
use crate::support::device;
use crate::support::scenes::{Scene, Shape, scene};
use labelgs::pass::KernelShape;
use labelgs::scheduler::plan::Buf;
use labelgs::shaders::constants::{KEY_INVISIBLE, NO_SPLAT, SPLAT_MASK};
use labelgs::verify::selftest::judge;
use labelgs::verify::selftest::order::DepthOrder;

/// Half of the Gaussians far outside, so that slopes are clamped and many are culled; some behind the near plane.
pub fn wide_scene(seed: u64, sh_degree: u32) -> Scene {
    let mut s = scene(seed, &Shape { gaussians: 300, sh_degree, ..Shape::default() });
    for (index, mean) in s.gaussians.means.iter_mut().enumerate().filter(|(index, _)| index % 2 == 0) {
        let factor = if index % 4 == 0 { 2.0 } else { 4.0 };
        *mean = mean.map(|v| v * factor);
        s.gaussians.scales[index].iter_mut().for_each(|v| *v += 0.4);
    }
    s.gaussians.opacities.iter_mut().step_by(7).for_each(|v| *v -= 4.0);
    s
}

/// The device drops no visible Gaussian, and keeps none that is behind the near plane or too faint.
#[test]
fn visible_gaussians_come_in_depth_order() {
    for looks_back in [false, true] {
        let Some(fixture) = projecting(wide_scene(11, 3), looks_back) else { return };
        come_in_depth_order(fixture);
    }
}

/// With projections of a processor, or with those of a card, which look back.
fn projecting(scene: Scene, looks_back: bool) -> Option<Fixture> {
    let turn = device()?;
    let shape = KernelShape { sweep_items: 0, group_walks: looks_back, ..KernelShape::for_device(turn.capabilities()) };
    Some(Fixture::with_shape(turn, scene, false, shape))
}

fn come_in_depth_order(mut fixture: Fixture) {
    let report = fixture.train();
    let count = fixture.scene.gaussians.len();
    let found = DepthOrder::read(&mut fixture).expect("an order");
    let mut keys = vec![KEY_INVISIBLE; count];
    found.gaussians.iter().zip(&found.keys).for_each(|(&gaussian, &key)| keys[gaussian as usize] = key);
    let (model, camera, size) = (fixture.model(), fixture.scene.camera.clone(), fixture.size());
    prove("cull", &["near"], |rules| {
        let mut depths = (Vec::new(), Vec::new());
        for (index, &key) in keys.iter().enumerate() {
            let projection = project_forward(rules, &camera, &model, index);
            let touch = projection.map(|p| tile::cull(rules, &p.splat, size));
            // f32 decides differently only within its rounding.
            let counts = touch.is_some_and(|touch| touch.touches && touch.margin > 1e-4);
            let near = near_margin(rules, &camera, &model.rows[index]);
            let faint = sigmoid(model.rows[index].opacity) < rules.alpha_min * (1.0 - 1e-5);
            let may_show = near > -1e-6 && !faint;
            match (counts && near > 1e-6, key != KEY_INVISIBLE, may_show) {
                (true, false, _) => return Err(format!("Gaussian {index} counts and was dropped")),
                (_, true, false) => return Err(format!("Gaussian {index} cannot show and was kept")),
                _ => {}
            }
            if let Some(projection) = projection.filter(|_| key != KEY_INVISIBLE) {
                depths.0.push(f64::from(f32::from_bits(key)));
                depths.1.push(projection.splat.depth);
            }
        }
        // z is a sum of three f32 products of some 4 units; 1.1e-6 seen at 8.9, 1.5e-7 at 0.5.
        close(&depths.0, &depths.1, Tolerance { absolute: 2.5e-7, relative: 1.5e-7 })
    });
    let visible = report.counters.visible_count as usize;
    let flags: Vec<u32> = keys.iter().map(|&key| u32::from(key != KEY_INVISIBLE)).collect();
    let listed = compact(&flags);
    assert!(listed.len() == visible && visible > 100 && visible < 280, "{visible} of {count} are visible");
    let order = radix_sort(&listed.iter().map(|&i| keys[i as usize]).collect::<Vec<_>>());
    let expected: Vec<u32> = order.iter().map(|&place| listed[place]).collect();
    check("depth order", exact(&found.gaussians, &expected));
    let mut splat_of = vec![u32::MAX; count];
    let numbered = if fixture.engine.shape().group_walks { &listed } else { &expected };
    numbered.iter().enumerate().for_each(|(splat, &gaussian)| splat_of[gaussian as usize] = splat as u32);
    let words = fixture.get::<u32>(Buf::SPLAT_FROM_GAUSSIAN, count);
    let splat = |word: u32| if word == NO_SPLAT { NO_SPLAT } else { word & SPLAT_MASK };
    let found_splats: Vec<u32> = words.into_iter().map(splat).collect();
    check("splat_from_gaussian", exact(&found_splats, &splat_of));
}

#[test]
fn project_forward_of_each_degree_equals_its_mirror() {
    for (sh_degree, looks_back) in (0..=3).flat_map(|degree| [(degree, false), (degree, true)]) {
        let Some(mut fixture) = projecting(wide_scene(20 + u64::from(sh_degree), sh_degree), looks_back) else {
            return;
        };
        fixture.render();
        let (splats, model, camera) = (fixture.splats(), fixture.model(), fixture.scene.camera.clone());
        let mut bearing = vec!["dilation", "jacobian_margin", "colour_bias", "sh_c0"];
        bearing.extend(&["sh_c1", "sh_c2", "sh_c3"][..sh_degree as usize]);
        prove(&format!("project_forward, degree {sh_degree}"), &bearing, |rules| {
            let expected: Vec<Splat> = (splats.iter())
                .map(|s| project_forward(rules, &camera, &model, s.gaussian).map_or(Splat::default(), |p| p.splat))
                .collect();
            // Centres are some 50 px times the roundings of a quotient; 8.9e-6 seen.
            judge::splats(&splats, &expected, Tolerance { absolute: 1.4e-5, relative: 0.0 })
        });
    }
}

/// A chain of f32 products; 0.42 of (1e-6, 1e-5) seen by element, 0.74 of 1e-6 as a whole.
const BOUNDS: GradientBounds = GradientBounds {
    element: Tolerance { absolute: 6.5e-7, relative: 6.5e-6 },
    outliers: 0.0,
    norm: 1.1e-6,
    angle: 1.1e-12,
    bias: 1.1e-6,
};

#[test]
fn project_backward_of_each_degree_equals_its_mirror() {
    for sh_degree in [3, 1] {
        let Some(turn) = device() else { return };
        let mut fixture = Fixture::new(turn, wide_scene(30 + u64::from(sh_degree), sh_degree), false);
        fixture.train();
        let (splats, model, camera) = (fixture.splats(), fixture.model(), fixture.scene.camera.clone());
        let v_splats: Vec<SplatGradient> = fixture.splat_gradients(&splats);
        let actual = fixture.rows(GRADIENT_PLANES, splats.len());
        assert!(actual.iter().filter(|row| row.floats() != [0.0; ROW_FLOATS]).count() > 60);
        let mut bearing = vec!["dilation", "jacobian_margin", "sh_c0", "sh_c1"];
        bearing.extend(&["sh_c2", "sh_c3"][..sh_degree as usize - 1]);
        prove(&format!("project_backward, degree {sh_degree}"), &bearing, |rules: &Rules| {
            let (mut found, mut expected) = (Vec::new(), Vec::new());
            for (place, splat) in splats.iter().enumerate() {
                let Some(projection) = project_forward(rules, &camera, &model, splat.gaussian) else { continue };
                if projection.clamp_margin.min(projection.colour_margin) > 1e-5 {
                    found.push(actual[place]);
                    expected.push(project_backward(rules, &camera, &model, splat.gaussian, &v_splats[place]));
                }
            }
            judge::rows(&found, &expected, sh_degree, BOUNDS)
        });
    }
}
