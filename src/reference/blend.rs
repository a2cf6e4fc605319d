//! Front-to-back blending of splats at pixels, its gradient, and the object layers.

use super::Rules;
use super::splat::{Splat, SplatGradient};
use super::tile::exponent;

/// Margins: distances of decisions to their opposite.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Margins {
    /// Distance of the exponent to the smallest exponent that counts, log2 units.
    pub cut: f64,
    /// Distance of the remaining transmittance to the stop threshold, relative.
    pub stop: f64,
    /// Distance of the unclamped alpha to the largest alpha, relative; matters for gradients only.
    pub clamp: f64,
    /// Distance of the largest weight to the second largest, relative; matters for the main Gaussian only.
    pub main: f64,
}

impl Default for Margins {
    fn default() -> Self {
        let far = f64::INFINITY;
        Self { cut: far, stop: far, clamp: far, main: far }
    }
}

impl Margins {
    /// Margin for colour, depth and transmittance.
    pub fn image(&self) -> f64 {
        self.cut.min(self.stop)
    }

    /// Margin for gradients.
    pub fn gradient(&self) -> f64 {
        self.image().min(self.clamp)
    }
}

/// A splat's contribution to a pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contribution {
    /// Index in the list of splats.
    pub splat: usize,
    /// Clamped alpha.
    pub alpha: f64,
    /// Transmittance in front of it.
    pub transmittance: f64,
    /// True if alpha was clamped to the maximum.
    pub clamped: bool,
}

impl Contribution {
    /// Blending weight, alpha T.
    pub fn weight(&self) -> f64 {
        self.alpha * self.transmittance
    }
}

/// Everything along the ray of one pixel.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Trace {
    /// Front to back.
    pub contributions: Vec<Contribution>,
    /// Transmittance left for the background.
    pub transmittance: f64,
    /// Margins of the nearest decisions (without `main`).
    pub margins: Margins,
    /// True if the transmittance rule ended the ray.
    pub stopped: bool,
}

/// Half the width and height of the box around {alpha >= alpha_min}, px; `None` if it is empty.
pub fn reach(rules: &Rules, splat: &Splat) -> Option<[f64; 2]> {
    let level = 2.0 * (splat.opacity / rules.alpha_min).ln();
    let [a, b, c] = splat.conic;
    let det = a * c - b * b;
    (level > -0.1).then(|| [c, a].map(|other| (level.max(0.0) * other / det).sqrt()))
}

/// Splats with their bounding boxes, one pixel wider than exact, so that margins near the border are included.
struct BoxedSplats<'a> {
    splats: &'a [Splat],
    reaches: Vec<[f64; 2]>,
}

impl<'a> BoxedSplats<'a> {
    fn new(rules: &Rules, splats: &'a [Splat]) -> Self {
        let reaches = splats.iter().map(|s| reach(rules, s).map_or([-1.0; 2], |r| r.map(|v| v + 1.0)));
        Self { splats, reaches: reaches.collect() }
    }

    fn splats_near(&self, at: [f64; 2]) -> impl Iterator<Item = (usize, &Splat)> {
        let inside = move |place: usize, splat: &Splat| {
            (splat.mean2d[0] - at[0]).abs() <= self.reaches[place][0]
                && (splat.mean2d[1] - at[1]).abs() <= self.reaches[place][1]
        };
        self.splats.iter().enumerate().filter(move |(place, splat)| inside(*place, splat))
    }
}

/// Blends `splats` (nearest first) at a position; indices in the result are the iterator's.
pub fn trace<'a>(rules: &Rules, splats: impl Iterator<Item = (usize, &'a Splat)>, at: [f64; 2]) -> Trace {
    let mut ray = Trace { transmittance: 1.0, ..Trace::default() };
    for (place, splat) in splats {
        let above = exponent(splat, at) - rules.exponent_min();
        ray.margins.cut = ray.margins.cut.min(above.abs());
        if above < 0.0 {
            continue;
        }
        let raw = exponent(splat, at).exp2();
        let alpha = raw.min(rules.alpha_max);
        ray.margins.clamp = ray.margins.clamp.min((raw / rules.alpha_max - 1.0).abs());
        let after = ray.transmittance * (1.0 - alpha);
        ray.margins.stop = ray.margins.stop.min((after / rules.transmittance_min - 1.0).abs());
        if after < rules.transmittance_min {
            ray.stopped = true;
            break;
        }
        let (transmittance, clamped) = (ray.transmittance, raw > rules.alpha_max);
        ray.contributions.push(Contribution { splat: place, alpha, transmittance, clamped });
        ray.transmittance = after;
    }
    ray
}

/// Result of blending at a pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pixel {
    /// Sum of alpha T c, plus the background times the remaining transmittance.
    pub colour: [f64; 3],
    /// Transmittance after the last splat; 1 - alpha of the pixel.
    pub transmittance: f64,
    /// Sum of alpha T z, world units, not normalised.
    pub depth: f64,
    /// Gaussian with the largest weight, ties to the nearer; -1 if there is none.
    pub main: i32,
    /// Largest weight.
    pub main_weight: f64,
    /// 1 + index of the last blended splat in the list; 0 if there is none.
    pub last: usize,
    /// Number of blended splats.
    pub count: usize,
    /// Margins of the nearest decisions.
    pub margins: Margins,
}

/// An image of pixels, row-major.
#[derive(Clone, Debug, PartialEq)]
pub struct BlendedImage {
    /// Width and height, px.
    pub size: (usize, usize),
    /// `[height, width]`.
    pub pixels: Vec<Pixel>,
}

impl BlendedImage {
    /// Colours of the pixels.
    pub fn colours(&self) -> Vec<[f64; 3]> {
        self.pixels.iter().map(|pixel| pixel.colour).collect()
    }

    /// Opacities of the pixels.
    pub fn alphas(&self) -> Vec<f64> {
        self.pixels.iter().map(|pixel| 1.0 - pixel.transmittance).collect()
    }
}

/// Sums the contributions of a ray.
pub fn shade(splats: &[Splat], ray: &Trace, background: [f64; 3]) -> Pixel {
    let mut pixel = Pixel {
        colour: background.map(|channel| channel * ray.transmittance),
        transmittance: ray.transmittance,
        depth: 0.0,
        main: -1,
        main_weight: 0.0,
        last: ray.contributions.last().map_or(0, |c| c.splat + 1),
        count: ray.contributions.len(),
        margins: ray.margins,
    };
    let mut second = 0.0_f64;
    for contribution in &ray.contributions {
        let (splat, weight) = (&splats[contribution.splat], contribution.weight());
        (0..3).for_each(|channel| pixel.colour[channel] += weight * splat.colour[channel]);
        pixel.depth += weight * splat.depth;
        if weight > pixel.main_weight {
            second = pixel.main_weight;
            (pixel.main, pixel.main_weight) = (splat.gaussian as i32, weight);
        } else {
            second = second.max(weight);
        }
    }
    if pixel.main >= 0 {
        pixel.margins.main = 1.0 - second / pixel.main_weight;
    }
    pixel
}

/// Centre of pixel `index`.
pub fn centre(index: usize, width: usize) -> [f64; 2] {
    [(index % width) as f64 + 0.5, (index / width) as f64 + 0.5]
}

/// Blends depth-ordered splats over a background.
pub fn blend_forward(rules: &Rules, splats: &[Splat], size: (usize, usize), background: [f64; 3]) -> BlendedImage {
    layer_forward(rules, &BoxedSplats::new(rules, splats), |_| true, size, background)
}

/// Blends the splats of `member`.
fn layer_forward(
    rules: &Rules,
    boxed: &BoxedSplats,
    member: impl Fn(&Splat) -> bool,
    size: (usize, usize),
    background: [f64; 3],
) -> BlendedImage {
    let pixel = |index: usize| {
        let at = centre(index, size.0);
        let members = boxed.splats_near(at).filter(|(_, splat)| member(splat));
        shade(boxed.splats, &trace(rules, members, at), background)
    };
    BlendedImage { size, pixels: (0..size.0 * size.1).map(pixel).collect() }
}

/// Gradients of splats, with the margins of the decisions that affect them.
#[derive(Clone, Debug, PartialEq)]
pub struct SplatGradients {
    /// By splat, in the order of the list.
    pub values: Vec<SplatGradient>,
    /// Smallest gradient margin of all pixels in which each splat counts.
    pub margins: Vec<f64>,
}

impl SplatGradients {
    fn none(count: usize) -> Self {
        Self { values: vec![SplatGradient::default(); count], margins: vec![f64::INFINITY; count] }
    }
}

/// Gradient of a loss with respect to an image.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Upstream {
    /// With respect to the colours, `[height, width]`.
    pub colours: Vec<[f64; 3]>,
    /// With respect to the opacities, `[height, width]`.
    pub alphas: Vec<f64>,
}

impl Upstream {
    /// Gradient of a loss that depends on colours only.
    pub fn from_colours(colours: &[[f64; 3]]) -> Self {
        Self { colours: colours.to_vec(), alphas: vec![0.0; colours.len()] }
    }
}

/// Gradients of depth-ordered splats, given the gradient of the image.
pub fn blend_backward(
    rules: &Rules,
    splats: &[Splat],
    size: (usize, usize),
    background: [f64; 3],
    v_image: &Upstream,
) -> SplatGradients {
    layer_backward(rules, &BoxedSplats::new(rules, splats), |_| true, size, background, v_image)
}

/// Gradients of a layer with the splats of `member`; all other splats get 0.
fn layer_backward(
    rules: &Rules,
    boxed: &BoxedSplats,
    member: impl Fn(&Splat) -> bool,
    size: (usize, usize),
    background: [f64; 3],
    v_image: &Upstream,
) -> SplatGradients {
    let mut out = SplatGradients::none(boxed.splats.len());
    for (index, (&v_colour, &v_alpha)) in v_image.colours.iter().zip(&v_image.alphas).enumerate() {
        let at = centre(index, size.0);
        let near = || boxed.splats_near(at).filter(|(_, splat)| member(splat));
        let ray = trace(rules, near(), at);
        ray_backward(boxed.splats, &ray, at, dot(background, v_colour) - v_alpha, v_colour, &mut out.values);
        for (place, splat) in near() {
            let above = exponent(splat, at) - rules.exponent_min();
            let of_ray = if above >= 0.0 { ray.margins.gradient() } else { f64::INFINITY };
            out.margins[place] = out.margins[place].min(of_ray).min(above.abs());
        }
    }
    out
}

/// For each splat, the smallest of the values of all pixels where it is large enough to count (hidden or not).
pub fn smallest_over_pixels(rules: &Rules, splats: &[Splat], size: (usize, usize), values: &[f64]) -> Vec<f64> {
    let boxed = BoxedSplats::new(rules, splats);
    let mut out = vec![f64::INFINITY; splats.len()];
    for (index, &value) in values.iter().enumerate() {
        let at = centre(index, size.0);
        for (place, splat) in boxed.splats_near(at) {
            if exponent(splat, at) >= rules.exponent_min() {
                out[place] = out[place].min(value);
            }
        }
    }
    out
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

/// Adds one ray's contribution. With C = sum w_i c_i + T b: dC/d alpha_i = T_i c_i - (everything behind i) / (1 -
/// alpha_i). `v_transmittance` is the gradient with respect to the final transmittance: b times that of the colour,
/// minus that of the opacity.
fn ray_backward(
    splats: &[Splat],
    ray: &Trace,
    at: [f64; 2],
    v_transmittance: f64,
    v_colour: [f64; 3],
    v_splats: &mut [SplatGradient],
) {
    let mut behind = ray.transmittance * v_transmittance;
    for contribution in ray.contributions.iter().rev() {
        let splat = &splats[contribution.splat];
        let v = &mut v_splats[contribution.splat];
        let (alpha, weight) = (contribution.alpha, contribution.weight());
        let own = dot(splat.colour, v_colour);
        let v_alpha = contribution.transmittance * own - behind / (1.0 - alpha);
        behind += weight * own;
        (0..3).for_each(|channel| v.colour[channel] += weight * v_colour[channel]);
        if contribution.clamped {
            continue;
        }
        v.opacity += alpha / splat.opacity * v_alpha;
        let v_power = alpha * v_alpha;
        let (dx, dy) = (splat.mean2d[0] - at[0], splat.mean2d[1] - at[1]);
        let [a, b, c] = splat.conic;
        v.conic[0] -= 0.5 * dx * dx * v_power;
        v.conic[1] -= dx * dy * v_power;
        v.conic[2] -= 0.5 * dy * dy * v_power;
        v.mean2d[0] -= (a * dx + b * dy) * v_power;
        v.mean2d[1] -= (b * dx + c * dy) * v_power;
    }
}

/// The scene and its objects: layer 0 blends every splat over `background`, layer 1 + j only the splats of `slots[j]`
/// over black, each layer with its own transmittance.
pub fn blend_layers_forward(
    rules: &Rules,
    splats: &[Splat],
    labels: &[u32],
    slots: &[u32],
    size: (usize, usize),
    background: [f64; 3],
) -> Vec<BlendedImage> {
    let boxed = BoxedSplats::new(rules, splats);
    let object = |&slot: &u32| layer_forward(rules, &boxed, |splat| labels[splat.gaussian] == slot, size, [0.0; 3]);
    let scene = layer_forward(rules, &boxed, |_| true, size, background);
    std::iter::once(scene).chain(slots.iter().map(object)).collect()
}

/// Gradients of all layers: the scene's share, and the sum over the object layers.
pub fn blend_layers_backward(
    rules: &Rules,
    splats: &[Splat],
    labels: &[u32],
    slots: &[u32],
    size: (usize, usize),
    background: [f64; 3],
    v_layers: &[Upstream],
) -> (SplatGradients, SplatGradients) {
    let boxed = BoxedSplats::new(rules, splats);
    let scene = layer_backward(rules, &boxed, |_| true, size, background, &v_layers[0]);
    let mut objects = SplatGradients::none(splats.len());
    for (slot, &label) in slots.iter().enumerate() {
        let member = |splat: &Splat| labels[splat.gaussian] == label;
        let layer = layer_backward(rules, &boxed, member, size, [0.0; 3], &v_layers[slot + 1]);
        for place in 0..splats.len() {
            objects.values[place] = objects.values[place].plus(&layer.values[place]);
            objects.margins[place] = objects.margins[place].min(layer.margins[place]);
        }
    }
    (scene, objects)
}
