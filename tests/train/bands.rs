//! Trainings on photos with more tiles than the device can walk: steps take bands of rows.

use crate::invariants::training::{budgeted, small};
use crate::support::compare::{Tolerance, check, close};
use crate::support::device;
use crate::support::device::Turn;
use crate::train::exposure::go_on;
use labelgs::pass::KernelShape;
use labelgs::run::{ExposureMode, TrainConfig};
use labelgs::scene::{Dataset, Gaussians};
use labelgs::scenes::initial_gaussians;
use labelgs::train::Trainer;
use labelgs::train::setup::TrainerOptions;
use labelgs::train::state::TrainState;

/// Rows of tiles in a band; `None` trains on whole photos.
fn options(turn: &Turn, tile_rows: Option<u32>, dataset: &Dataset) -> TrainerOptions {
    let shape = KernelShape::for_device(turn.capabilities());
    // Each tile counts twice where a step may have object layers.
    let times = if dataset.train[0].mask.is_some() { 2 } else { 1 };
    let loop_rounds = tile_rows.map(|rows| times * rows * (shape.tiles(dataset.train[0].camera.width, 1).0 + 1));
    TrainerOptions { shape: Some(KernelShape { loop_rounds, ..shape }), ..TrainerOptions::default() }
}

fn first(dataset: &Dataset) -> Gaussians {
    let mut model = initial_gaussians(dataset, 0, 100).expect("points");
    // Some reach from beyond the limit of slopes of a band, but not of the photo.
    model.scales.iter_mut().step_by(9).for_each(|scale| *scale = scale.map(|value| value + 1.5));
    model
}

/// Steps that change nothing: the differences of the bands add up to that of the photo.
#[test]
fn bands_have_the_loss_of_the_photo() {
    let Some(turn) = device() else { return };
    let mut dataset = small();
    dataset.train.truncate(1);
    dataset.train[0].mask = None;
    let config =
        TrainConfig { iterations: 9, start_size: Some(1.0), rate_factor: Some(1e-20), opacity_lr: 1e-20, ..budgeted() };
    let camera = dataset.train[0].camera.clone();
    let l1 = |tile_rows: Option<u32>| -> (Vec<f64>, u32) {
        let options = options(&turn, tile_rows, &dataset);
        let mut trainer = Trainer::new(turn.gpu(), config.clone(), &dataset, &first(&dataset), options).expect("one");
        let rows = trainer.engine_mut().size().image.1;
        let mut reports = trainer.step().expect("a step");
        for _ in 1..camera.height.div_ceil(rows) {
            reports.extend(trainer.step().expect("a step"));
        }
        reports.extend(trainer.drain().expect("the last steps"));
        (reports.iter().map(|report| report.l1).collect(), rows)
    };
    let ((whole, all), (bands, rows)) = (l1(None), l1(Some(2)));
    assert_eq!((whole.len(), all), (1, camera.height));
    assert!(bands.len() > 1 && bands.len() == camera.height.div_ceil(rows) as usize, "{bands:?} of {rows} rows");
    // Each band comes once, in any order; the last one may have fewer rows.
    let last = camera.height - rows * (bands.len() as u32 - 1);
    let sums = bands.iter().map(|short| {
        let of = |(index, l1): (usize, &f64)| l1 * f64::from(if bands[index] == *short { last } else { rows });
        bands.iter().enumerate().map(of).sum::<f64>() / f64::from(camera.height)
    });
    let nearest = sums.min_by(|a, b| (a - whole[0]).abs().total_cmp(&(b - whole[0]).abs())).expect("a sum");
    // Places of splats count from the first row of a band, and round otherwise.
    check("l1", close(&[nearest], &whole, Tolerance { absolute: 2e-6, relative: 0.0 }));
}

/// Labels, exposures and refined poses belong to photos; a resumed training has the same bits.
#[test]
fn a_training_in_bands_goes_on_from_a_checkpoint() {
    let Some(turn) = device() else { return };
    let dataset = small();
    let config = TrainConfig {
        iterations: 120,
        exposure: ExposureMode::On,
        refine_poses: true,
        label_from: Some(50),
        layer_every: Some(3),
        ..budgeted()
    };
    let fresh = |tile_rows| {
        let options = options(&turn, tile_rows, &dataset);
        Trainer::new(turn.gpu(), config.clone(), &dataset, &first(&dataset), options).expect("a trainer")
    };
    let mut straight = fresh(Some(3));
    assert!(straight.engine_mut().size().image.1 < dataset.train[0].camera.height);
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("state");
    go_on(&mut straight, 70).write(&file).expect("a file");
    let expected = go_on(&mut straight, 120);
    let state = TrainState::read(&file).expect("a state");
    let mut resumed =
        Trainer::resume(turn.gpu(), &dataset, state, options(&turn, Some(3), &dataset)).expect("it goes on");
    assert_eq!(go_on(&mut resumed, 120).planes, expected.planes);
    let views = dataset.train.len();
    let mut whole = fresh(None);
    assert_eq!(expected.shared, go_on(&mut whole, 120).shared, "the same rows, those of photos");
    assert_eq!((straight.exposures().expect("matrices").len(), straight.poses().expect("poses").len()), (views, views));
    assert_eq!(straight.occluders().len(), views);
    let labelled = |trainer: &mut Trainer| {
        let labels = trainer.labelled_model().expect("a model").labels.expect("labels");
        labels.iter().filter(|&&label| label > 0).count()
    };
    let (bands, all) = (labelled(&mut straight), labelled(&mut whole));
    assert!(bands.abs_diff(all) * 4 < all, "{bands} Gaussians of objects, {all} without bands");
}
