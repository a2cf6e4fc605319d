//! Patterns of a plane that go on in a hole, and Gaussians that are copied along with them.

use super::{CELL, RADIUS, Under, cameras, gradient, model_of, sight_of};
use glam::{DMat3, DVec3};
use labelgs_edit::{Sight, fill};
use labelgs_scene::Gaussians;
use labelgs_scene::harmonics::{SH_C0, sh0_of};

/// Edge of a tile, and how dark stains are.
const TILE: f64 = 0.23;
const STAIN: f64 = 0.05;

/// Tiles in a turned grid, with light that falls off and stains that never repeat.
fn tiles(place: DVec3) -> [f64; 3] {
    let turned = DMat3::from_rotation_z(0.4) * place;
    let is_odd = ((turned.x / TILE).floor() + (turned.y / TILE).floor()).rem_euclid(2.0) == 1.0;
    let stain = STAIN * ((7.0 * place.x + 1.0).sin() * (11.0 * place.y + 3.0 * place.x).sin());
    let light = 0.05 * place.x + stain;
    if is_odd { [0.7 + light, 0.6 + light, 0.5 + light] } else { [0.3 + light, 0.35 + light, 0.4 + light] }
}

/// Stripes of one width.
fn stripes(place: DVec3) -> [f64; 3] {
    let is_odd = ((0.8 * place.x + 0.6 * place.y) / 0.12).floor().rem_euclid(2.0) == 1.0;
    [if is_odd { 0.7 } else { 0.3 }; 3]
}

/// Blots that never repeat.
fn blots(place: DVec3) -> [f64; 3] {
    let cell = (place / 0.2).floor();
    let word = (cell.x * 12.9898 + cell.y * 78.233).sin() * 43_758.547;
    [0.3 + 0.4 * (word - word.floor()); 3]
}

/// The model with the colours of a plane, as far as sources are looked for.
fn painted_model(plane: fn(DVec3) -> [f64; 3]) -> Gaussians {
    let mut whole = model_of(DVec3::ZERO, 40);
    for row in 0..whole.len() {
        whole.sh0[row] = plane(whole.world(row)).map(sh0_of);
    }
    whole
}

/// Fills the place of the dome on a plane.
fn filled_plane(plane: fn(DVec3) -> [f64; 3]) -> (Gaussians, usize) {
    let sights: Vec<Sight> = cameras().into_iter().map(|camera| sight_of(camera, Under::Hidden, plane)).collect();
    let whole = painted_model(plane);
    let rest = labelgs_edit::remove(&whole, &[1]).expect("rest").len();
    (fill(&whole, &[1], &sights, None).expect("filled").model, rest)
}

/// Fills the place of the dome on a plane, and returns the root of the mean squared error of the new colours, and that
/// of their mean.
fn errors(plane: fn(DVec3) -> [f64; 3]) -> [f64; 2] {
    let (filled, rest) = filled_plane(plane);
    let new: Vec<usize> = (rest..filled.len()).collect();
    let truth: Vec<f64> = new.iter().map(|&row| plane(filled.world(row))[0]).collect();
    let mean = truth.iter().sum::<f64>() / truth.len() as f64;
    let shown = |row: usize| 0.5 + f64::from(filled.sh0[row][0]) * SH_C0;
    let root = |off: &dyn Fn(usize) -> f64| {
        ((0..new.len()).map(|at| off(at) * off(at)).sum::<f64>() / new.len() as f64).sqrt()
    };
    [root(&|at| shown(new[at]) - truth[at]), root(&|at| mean - truth[at])]
}

#[test]
fn tiles_and_stripes_go_on_under_the_object() {
    let [tiled, plain] = errors(tiles);
    assert!(tiled < 0.45 * plain, "{tiled} from the tiles, whose own deviation is {plain}");
    let [striped, plain] = errors(stripes);
    assert!(striped < 0.45 * plain, "{striped} from the stripes, whose own deviation is {plain}");
}

#[test]
fn what_has_no_pattern_stays_smooth() {
    let [blotted, plain] = errors(blots);
    // A copy of blots from elsewhere would be off by the root of two deviations.
    assert!(blotted < 1.2 * plain, "{blotted} from the blots, whose own deviation is {plain}");
}

/// Thickness of a copied Gaussian; the new flat ones have another.
const ROUND: f32 = -3.5;

#[test]
fn gaussians_of_tiles_are_copied_whole_periods_away() {
    let (filled, rest) = filled_plane(tiles);
    let copies: Vec<usize> = (rest..filled.len()).filter(|&row| filled.scales[row] == [ROUND; 3]).collect();
    // One for each place of the lattice of Gaussians under the dome, but for seams.
    let expected = std::f64::consts::PI * (RADIUS / 0.05).powi(2);
    let share = copies.len() as f64 / expected;
    assert!((0.8..1.2).contains(&share), "{} copies in place of {expected:.0}", copies.len());
    let turn = DMat3::from_rotation_z(0.4);
    let mut apart = 0.0;
    for &row in &copies {
        let place = filled.world(row);
        assert!(place.truncate().length() < RADIUS + CELL, "{place} is outside of the disc");
        assert_eq!((filled.label(row), filled.opacities[row]), (0, 3.0));
        assert_eq!(filled.rest(row), filled.rest(0), "harmonics are those of the source");
        // A Gaussian of the plane lies a whole number of periods away: two tiles, or one along both sides.
        let is_source = |&from: &usize| {
            let tiles = turn * (filled.world(from) - place) / TILE;
            let whole = tiles.round();
            (tiles - whole).length() * TILE < CELL && (whole.x + whole.y).rem_euclid(2.0) == 0.0
        };
        assert!((0..rest).any(|from| is_source(&from)), "nothing a period from {place}");
        let shown = 0.5 + f64::from(filled.sh0[row][0]) * SH_C0;
        apart += (shown - tiles(place)[0]).abs() / copies.len() as f64;
    }
    assert!(apart < 0.06, "copies are {apart} from the tiles, which differ by 0.4");
    assert_eq!(filled, filled_plane(tiles).0, "two runs differ");
}

#[test]
fn without_a_pattern_nothing_is_copied() {
    for plane in [blots, gradient] {
        let (filled, rest) = filled_plane(plane);
        let copies = (rest..filled.len()).filter(|&row| filled.scales[row] == [ROUND; 3]).count();
        assert_eq!(copies, 0, "of a plane with the colour {:?} in the middle", plane(DVec3::ZERO));
    }
}
