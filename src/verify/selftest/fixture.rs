//! A scene on the device: runs the engine's pass lists and reads all buffers back.

use super::order::DepthOrder;
use super::scenes::Scene;
use crate::engine::{Engine, EngineSize, Input, LabelSize, ListKey, Report, SharedRow, TrainInput};
use crate::error::{Error, Result};
use crate::gpu::Gpu;
use crate::pass::{KernelShape, TileSort, Update, Variant};
use crate::reference::loss::ObjectPixel;
use crate::reference::model::ROW_FLOATS;
use crate::reference::splat::{Splat, SplatGradient};
use crate::reference::{Model, Row};
use crate::scene::{Camera, Occluders, Photo};
use crate::scheduler::SchedulerOptions;
use crate::scheduler::plan::{Buf, PlanOptions};
use crate::shaders::structs::StepUniforms;
use crate::train::input::step_input::{self, ObjectLight, SceneScale, StepInput, StepView};
use crate::train::setup::near_plane::NEAR_DEFAULT;
use crate::train::strategy::{self, StepContext};
use crate::train::{LabelRule, TrainConfig};
use bytemuck::Pod;
use std::collections::BTreeMap;
use std::f64::consts::LN_2;
use std::sync::Arc;

/// Parameter planes, in the order of `plane_rows`.
pub const PARAMETER_PLANES: [Buf; 7] = [Buf::MEANS, Buf::SCALES, Buf::QUATS, Buf::SH0, Buf::SH1, Buf::SH2, Buf::SH3];
/// First moments.
pub const MOMENTS_1: [Buf; 7] =
    [Buf::M_MEANS, Buf::M_SCALES, Buf::M_QUATS, Buf::M_SH0, Buf::M_SH1, Buf::M_SH2, Buf::M_SH3];
/// Second moments.
pub const MOMENTS_2: [Buf; 7] =
    [Buf::U_MEANS, Buf::U_SCALES, Buf::U_QUATS, Buf::U_SH0, Buf::U_SH1, Buf::U_SH2, Buf::U_SH3];
/// Gradients, by splat.
pub const GRADIENT_PLANES: [Buf; 7] =
    [Buf::V_MEANS, Buf::V_SCALES, Buf::V_QUATS, Buf::V_SH0, Buf::V_SH1, Buf::V_SH2, Buf::V_SH3];

/// Floats per row of each plane, and their positions in `Row::floats`: (floats, runs of (from, to, length)).
pub(super) const PLANE_LAYOUT: [(usize, &[(usize, usize, usize)]); 7] = [
    (4, &[(0, 0, 3), (3, 10, 1)]),
    (4, &[(0, 7, 3)]),
    (4, &[(0, 3, 4)]),
    (4, &[(0, 11, 4)]),
    (8, &[(0, 15, 8)]),
    (16, &[(0, 23, 16)]),
    (20, &[(0, 39, 20)]),
];

/// Labels per vote sweep: few, so that several sweeps are needed.
pub const VOTE_COLUMNS: u32 = 3;

/// A scene, an engine with its model, and a training step.
pub struct Fixture {
    /// The engine.
    pub engine: Engine,
    /// The scene.
    pub scene: Scene,
    /// Host data of the view.
    pub view: OwnView,
    /// Input of the step.
    pub input: StepInput,
    /// The settings.
    pub config: TrainConfig,
    /// Extent of the scene.
    pub fixed: SceneScale,
    /// Another camera with free space on the way to it, and the near plane there.
    pub free_space: Option<(Camera, f32)>,
    /// True if the last list had object layers.
    layered: bool,
    /// Shared rows of the step.
    pub(crate) shared: Vec<SharedRow>,
}

/// Scheduler options that keep every buffer readable.
pub fn readable() -> SchedulerOptions {
    let plan = PlanOptions { alias: false, guards: true, barrier_everywhere: false };
    SchedulerOptions { plan, poison_step: true, ..SchedulerOptions::default() }
}

/// Data of a scene's only view besides camera and masks.
pub struct OwnView {
    /// Near plane, world units.
    pub near: f32,
    /// Photo.
    pub photo: Photo,
    /// Occluders of each object.
    pub occluders: Occluders,
    /// 1 / known depth of each pixel; empty without.
    pub depths: Vec<f32>,
    shown: BTreeMap<u16, ObjectLight>,
}

impl OwnView {
    fn new(Scene { camera, target, .. }: &Scene) -> Self {
        let rgba = (target.photo.colours.iter().zip(&target.photo.valid))
            .map(|(c, &valid)| {
                let [r, g, b] = c.map(|v| (v * 255.0).round() as u8);
                [r, g, b, if valid { 255 } else { 0 }]
            })
            .collect();
        let occluders = |slot: &ObjectPixel| (slot.label as u16, slot.occluders.iter().map(|&id| id as u16).collect());
        let photo = Photo { width: camera.width, height: camera.height, rgba };
        Self {
            near: NEAR_DEFAULT,
            shown: step_input::shown_objects(&photo.rgba, &target.label_map),
            photo,
            occluders: target.slots.iter().map(occluders).collect(),
            depths: Vec::new(),
        }
    }

    /// Returns the scene's view for a step.
    pub fn step_view<'a>(&'a self, scene: &'a Scene) -> StepView<'a> {
        let Self { near, photo, occluders, depths, shown } = self;
        let (camera, near, valid_pixels) = (&scene.camera, *near, step_input::valid_pixels(&photo.rgba));
        let (finest, view_labels) = (step_input::finest(camera), &scene.target.label_map[..]);
        StepView {
            key: None,
            camera,
            whole: None,
            near,
            finest,
            photo,
            valid_pixels,
            view_labels,
            depths,
            shown,
            occluders,
        }
    }
}

impl Fixture {
    /// Uploads the scene to a device, with or without labels, with kernels of the given shape, but with separate update
    /// passes, so that gradients can be read. Without [`readable`], only some buffers can be read back.
    pub fn new(
        gpu: Arc<Gpu>,
        scene: Scene,
        labels: bool,
        shape: KernelShape,
        options: SchedulerOptions,
    ) -> Result<Self> {
        let shape = KernelShape { update: Update::Split, ..shape };
        Self::with_room(gpu, scene, labels, (shape, options), |room| room)
    }

    /// Same as [`Fixture::new`], with the shape's own update, and with additional memory.
    pub fn with_room(
        gpu: Arc<Gpu>,
        scene: Scene,
        labels: bool,
        (shape, options): (KernelShape, SchedulerOptions),
        with: impl Fn(EngineSize) -> EngineSize,
    ) -> Result<Self> {
        let labels_size = labels.then(|| LabelSize {
            max_label: scene.target.label_map.iter().copied().max().unwrap_or(0).max(1),
            layers: scene.target.slots.len() as u32,
            vote_columns: VOTE_COLUMNS,
        });
        let room = EngineSize::new(scene.gaussians.len().max(1) as u64, (scene.camera.width, scene.camera.height));
        let room = room.for_training().with_labels(labels_size).with_frozen(scene.frozen).with_depths(true);
        let room = with(room);
        let mut engine = Engine::with_shape(gpu, shape, room, options)?;
        engine.upload_model(&scene.gaussians)?;
        let config = TrainConfig {
            background: scene.target.background.map(|v| v as f32),
            sh_degree: scene.gaussians.sh_degree,
            label_rule: LabelRule::Main,
            // Weights of the reference's rules.
            label_weight: 1.0,
            label_alpha: 0.1,
            label_balance: true,
            near: NEAR_DEFAULT,
            ..TrainConfig::adc()
        };
        let layers =
            if labels { scene.target.slots.iter().map(|slot| slot.label as u16).collect() } else { Vec::new() };
        let input = StepInput { step: 1, part: 0, layers, labels, update: false, updates: 1 };
        let view = OwnView::new(&scene);
        let fixed = SceneScale { extent: 1.0 };
        let (free_space, layered, shared) = (None, false, Vec::new());
        let mut fixture = Self { view, engine, scene, input, config, fixed, free_space, layered, shared };
        let weights =
            step_input::layer_weights(&fixture.input, fixture.view.step_view(&fixture.scene), &fixture.config);
        fixture.scene.target.slots.iter_mut().zip(weights).for_each(|(slot, weight)| slot.weight = f64::from(weight));
        Ok(fixture)
    }

    /// The uniforms of the step.
    pub fn uniforms(&self) -> StepUniforms {
        let mut uniforms =
            step_input::uniforms(&self.input, self.view.step_view(&self.scene), &self.config, self.fixed, &self.engine);
        if let Some((camera, near)) = &self.free_space {
            uniforms = self.engine.with_free_space(uniforms, camera, *near);
        }
        let at = StepContext { step: self.input.step, config: &self.config, extent: self.fixed.extent };
        strategy::make(self.config.strategy).uniforms(at, &mut uniforms);
        uniforms
    }

    /// Key of the training step's list.
    pub fn key(&self) -> ListKey {
        ListKey::Train(self.variant())
    }

    /// Variant of the training step.
    pub fn variant(&self) -> Variant {
        let size = (self.scene.camera.width, self.scene.camera.height);
        Variant {
            supervision: self.input.supervision(&self.config),
            sh_degree: self.config.sh_degree,
            update: self.input.update,
            ..Variant::plain(size)
        }
    }

    /// Sorted pairs on the device: keys, and positions before the sort.
    pub fn sorted_pairs(&mut self, count: usize) -> Result<(Vec<u32>, Vec<u32>)> {
        let (shape, capacity) = (*self.engine.shape(), *self.engine.capacity());
        let TileSort { bits, buffers } = TileSort::new(&shape, &capacity, self.layered);
        let (keys, values) = buffers.sorted(&shape, bits);
        let places = self.get(values, count)?;
        if !buffers.narrow {
            return Ok((self.get(keys, count)?, places));
        }
        // Whole words are read.
        let narrow = self.get::<u16>(keys, count.next_multiple_of(2))?;
        Ok((narrow.into_iter().take(count).map(u32::from).collect(), places))
    }

    /// Splats of the sorted (splat, tile) pairs, by depth rank.
    pub fn sorted_splats(&mut self, count: usize) -> Result<Vec<u32>> {
        let splat_from_instance = self.get::<u32>(Buf::SPLAT_FROM_INSTANCE, count)?;
        let (places, ranks) = (self.sorted_pairs(count)?.1, DepthOrder::read(self)?.ranks());
        let rank = |place: u32| ranks.get(*splat_from_instance.get(place as usize)? as usize).copied();
        Ok(places.into_iter().map(|place| rank(place).unwrap_or(u32::MAX)).collect())
    }

    /// Runs a training step; fails if a pass writes outside of its buffers.
    pub fn train(&mut self) -> Result<Report> {
        self.train_as(self.key())
    }

    /// Same as [`Fixture::train`], with the passes of a variant of the extension; 0 for none.
    pub fn train_with(&mut self, passes: u32) -> Result<Report> {
        match passes {
            0 => self.train(),
            passes => self.train_as(ListKey::Extended(self.variant(), passes)),
        }
    }

    /// Same as [`Fixture::train`], with another list.
    pub fn train_as(&mut self, key: ListKey) -> Result<Report> {
        let uniforms = self.uniforms();
        self.layered = matches!(key, ListKey::Train(of) | ListKey::Extended(of, _) if of.supervision.has_layers());
        let view = self.view.step_view(&self.scene);
        let data = step_input::train_input(&self.input, view, &self.config, uniforms, &self.engine);
        self.engine.run(key, &TrainInput { shared: self.shared.clone(), ..data })
    }

    /// Writes the host inputs of a step, for the caller's own lists.
    pub fn write(&mut self) -> Result<()> {
        let uniforms = self.uniforms();
        let view = self.view.step_view(&self.scene);
        let data = step_input::train_input(&self.input, view, &self.config, uniforms, &self.engine);
        self.engine.write(0, Input::Train(&data))
    }

    /// Runs the list of a render.
    pub fn render(&mut self) -> Result<Report> {
        let key = ListKey::Render { sh_degree: self.config.sh_degree, label_rounds: 0 };
        self.layered = false;
        self.engine.run(key, &self.uniforms())
    }

    /// The first `count` values of a buffer.
    pub fn get<T: Pod>(&mut self, buf: Buf, count: usize) -> Result<Vec<T>> {
        self.engine.raw_mut().download(buf, 0, 0, count)
    }

    /// Width and height, px.
    pub fn size(&self) -> (usize, usize) {
        (self.scene.camera.width as usize, self.scene.camera.height as usize)
    }

    /// Number of pixels.
    pub fn pixels(&self) -> usize {
        self.size().0 * self.size().1
    }

    /// Splats of the device, by depth.
    pub fn splats(&mut self) -> Result<Vec<Splat>> {
        let order = DepthOrder::read(self)?;
        let records = self.get::<[f32; 12]>(Buf::SPLATS, order.splats.len())?;
        // The reference looks up these Gaussians.
        let count = self.scene.gaussians.len();
        if let Some(wrong) = order.gaussians.iter().find(|&&gaussian| gaussian as usize >= count) {
            return Err(Error::Check(format!("the device sorts {count} Gaussians but lists number {wrong}")));
        }
        let records = order.sorted(&records);
        Ok(order.gaussians.iter().zip(&records).map(|(&gaussian, record)| splat_of(gaussian, record)).collect())
    }

    /// Gradients of the splats, by depth.
    pub fn splat_gradients(&mut self, splats: &[Splat]) -> Result<Vec<SplatGradient>> {
        let records = self.get::<[f32; 12]>(Buf::V_SPLATS, splats.len())?;
        let records = DepthOrder::read(self)?.sorted(&records);
        let wide = |record: &[f32; 12]| record.map(f64::from);
        let gradients = (records.iter().map(wide).zip(splats))
            .map(|(v, splat)| SplatGradient {
                mean2d: [v[0], v[1]],
                conic: [v[2], v[3], v[4]],
                // The record has the derivative with respect to ln o.
                opacity: v[5] / splat.opacity,
                colour: [v[6], v[7], v[8]],
            })
            .collect();
        Ok(gradients)
    }

    /// `count` rows of a set of planes: parameters or moments by Gaussian, or gradients of splats by depth.
    pub fn rows(&mut self, planes: [Buf; 7], count: usize) -> Result<Vec<Row>> {
        let mut floats = vec![[0.0; ROW_FLOATS]; count];
        // Colour bands above the degree have no plane.
        let there = 4 + self.config.sh_degree as usize;
        for (plane, (stride, runs)) in planes.into_iter().zip(PLANE_LAYOUT).take(there) {
            let values = self.get::<f32>(plane, count * stride)?;
            for (row, values) in floats.iter_mut().zip(values.chunks_exact(stride)) {
                for &(from, to, length) in runs {
                    (0..length).for_each(|i| row[to + i] = f64::from(values[from + i]));
                }
            }
        }
        if planes == GRADIENT_PLANES {
            floats = DepthOrder::read(self)?.sorted(&floats);
        }
        Ok(floats.iter().map(Row::from_floats).collect())
    }

    /// Writes a set of planes; rows must hold f32 values.
    pub fn put_rows(&mut self, planes: [Buf; 7], rows: &[Row]) -> Result<()> {
        for (plane, (stride, runs)) in planes.into_iter().zip(PLANE_LAYOUT) {
            let mut values = vec![0.0_f32; rows.len() * stride];
            for (row, values) in rows.iter().zip(values.chunks_exact_mut(stride)) {
                let floats = row.floats();
                for &(from, to, length) in runs {
                    (0..length).for_each(|i| values[from + i] = floats[to + i] as f32);
                }
            }
            self.engine.raw_mut().upload(plane, 0, 0, &values)?;
        }
        Ok(())
    }

    /// Parameters of `count` Gaussians, and both moments of `trained` ones.
    pub fn planes(&mut self, count: usize, trained: usize) -> Result<[Vec<Row>; 3]> {
        let (rows, [m, u]) = (self.rows(PARAMETER_PLANES, count)?, self.moments(trained)?);
        Ok([rows, m, u])
    }

    /// Gradients of the last step by Gaussian; 0 without a splat.
    pub fn gradient_rows(&mut self) -> Result<Vec<Row>> {
        let splats = self.splats()?;
        let by_splat = self.rows(GRADIENT_PLANES, splats.len())?;
        let mut rows = vec![Row::default(); self.scene.gaussians.len()];
        for (splat, row) in splats.iter().zip(by_splat) {
            if let Some(to) = rows.get_mut(splat.gaussian) {
                *to = row;
            }
        }
        Ok(rows)
    }

    /// The model for the reference.
    pub fn model(&self) -> Model {
        self.scene.model()
    }

    /// Labels of the sampled objects.
    pub fn slots(&self) -> Vec<u32> {
        self.input.layers.iter().map(|&label| u32::from(label)).collect()
    }
}

/// Decodes a splat from its record (glsl/include/record.glsl).
pub fn splat_of(gaussian: u32, record: &[f32; 12]) -> Splat {
    let [x, y, a, b, c, log2_o, red, green, blue, depth, _, _] = record.map(f64::from);
    Splat {
        gaussian: gaussian as usize,
        depth,
        mean2d: [x, y],
        conic: [-2.0 * LN_2 * a, -LN_2 * b, -2.0 * LN_2 * c],
        opacity: log2_o.exp2(),
        colour: [red, green, blue],
    }
}
