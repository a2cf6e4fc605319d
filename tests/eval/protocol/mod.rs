//! Benchmarks: each layout with a known score, missing predictions, rules of the published scorers, broken inputs.

mod layouts;
mod lpips;
mod refusals;
mod rules;

use labelgs::cli::support::exit_status::exit_status;
use labelgs::eval::Subject;
use labelgs::eval::protocol::{Bench, Layout, LayoutInput, Protocol, Report, SelectBy, run};
use labelgs::files::image::write_png_grey8;
use labelgs::files::{LabelEntry, LabelTable};
use labelgs::render::{Render, RenderOptions};
use labelgs::scene::{Camera, Photo, View};
use labelgs::scenes::truth::{files_below, read_truth};
use labelgs::{Error, Result};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// Width and height of every picture, px.
const SIDE: usize = 8;

/// A scene of labels in columns: pixel (x, y) has the label of its column, in every view. Objects have the colour of
/// the photo, which is 0.8 grey; a label of `dark` is opaque and black.
pub struct Columns {
    /// Label of each column.
    pub labels: [u32; SIDE],
    /// Labels that are drawn black.
    pub dark: Vec<u32>,
    /// Labels that are drawn, if not all.
    pub shown: Option<Vec<u32>>,
}

/// The grey of photos and objects.
const GREY_VALUE: u8 = 204;

impl Subject for Columns {
    fn labels(&self) -> Option<&[u32]> {
        Some(&self.labels)
    }

    fn show(&mut self, only: Option<&[u32]>) -> Result<bool> {
        self.shown = only.map(<[u32]>::to_vec);
        Ok(true)
    }

    fn render(&mut self, camera: &Camera, _: &RenderOptions) -> Result<Render> {
        assert_eq!((camera.width, camera.height), (SIDE as u32, SIDE as u32));
        let labels = self.labels.repeat(SIDE);
        let shown = |id: &u32| self.shown.as_ref().is_none_or(|shown| shown.contains(id));
        let grey = |id: &u32| if self.dark.contains(id) { 0.0 } else { f32::from(GREY_VALUE) / 255.0 };
        Ok(Render {
            width: camera.width,
            height: camera.height,
            rgb: labels.iter().map(|id| if shown(id) { [grey(id); 3] } else { [0.0; 3] }).collect(),
            alpha: labels.iter().map(|id| if shown(id) { 1.0 } else { 0.0 }).collect(),
            depth: Vec::new(),
            top_id: (0..SIDE as i32).cycle().take(SIDE * SIDE).collect(),
            top_weight: Vec::new(),
            labels,
        })
    }
}

impl Columns {
    /// Columns of bright labels.
    pub fn new(labels: [u32; SIDE]) -> Self {
        Self { labels, dark: Vec::new(), shown: None }
    }
}

/// A view with a grey photo.
pub fn view(name: &str) -> View {
    let side = SIDE as u32;
    let camera = Camera {
        rotation: glam::DMat3::IDENTITY,
        translation: glam::DVec3::ZERO,
        fx: 8.0,
        fy: 8.0,
        cx: 4.0,
        cy: 4.0,
        width: side,
        height: side,
    };
    let photo = Photo { width: side, height: side, rgba: vec![[GREY_VALUE, GREY_VALUE, GREY_VALUE, 255]; SIDE * SIDE] };
    View { name: name.to_owned(), camera, photo: Some(photo.into()), mask: None }
}

/// Writes a mask that is white in some columns.
pub fn columns_file(path: &Path, columns: std::ops::Range<usize>) {
    let bytes: Vec<u8> = (0..SIDE * SIDE).map(|i| if columns.contains(&(i % SIDE)) { 255 } else { 0 }).collect();
    write_png_grey8(path, SIDE as u32, SIDE as u32, &bytes).expect("written");
}

/// The layout of the files in a folder.
pub fn layout(protocol: Protocol, truth: &Path, scene: &str, by: SelectBy) -> Result<Layout> {
    let classes = std::fs::read_to_string(truth.join("classes.txt")).ok();
    protocol.layout(&files_below(truth)?, classes.as_deref(), LayoutInput { truth, scene, by })
}

/// Runs a benchmark on views of these names; the views from index `test` on are held out.
pub fn run_on(
    (protocol, compat, by): (Protocol, bool, SelectBy),
    truth: &Path,
    (views, test): (&[&str], usize),
    names: &[(u32, &str)],
    mut columns: Columns,
) -> Result<Report> {
    let layout = layout(protocol, truth, "scene", by)?;
    let views: Vec<View> = views.iter().map(|name| view(name)).collect();
    let views: Vec<&View> = views.iter().collect();
    let entry = |&(id, name): &(u32, &str)| LabelEntry { name: Some(name.to_owned()), ..LabelEntry::new(id) };
    let names = LabelTable::new(names.iter().map(entry).collect());
    let labels: BTreeSet<u32> = columns.labels.into_iter().filter(|&id| id != 0).collect();
    let lenses = BTreeMap::new();
    let bench = Bench {
        protocol,
        compat,
        near: 0.2,
        views: &views,
        test: &views[test..],
        names: Some(&names),
        labels: &labels,
        truth: &|file, view| read_truth(&truth.join(file), view, &lenses),
        lpips: None,
    };
    bench.check(&layout, truth)?;
    run(&layout, &bench, &mut columns, &mut ())
}

/// Message of an error.
pub fn message<T: std::fmt::Debug>(result: Result<T>) -> String {
    let error: Error = result.expect_err("it fails");
    assert_eq!(exit_status(&error), 3, "{error}");
    error.to_string()
}
