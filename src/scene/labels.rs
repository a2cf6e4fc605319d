//! Object ids: 0 is unlabelled; objects are from 1 to 65535 in masks, and to 2^31 - 1 in models.

/// Id of the background, in masks and in models.
pub const UNLABELLED: u32 = 0;

/// Occluders of each object in a view: the objects that hide a part of it, with 0 for unlabelled occluders. Keys and
/// lists are sorted.
pub type Occluders = std::collections::BTreeMap<u16, Vec<u16>>;

/// Largest id in masks.
pub const LABEL_MAX: u32 = 65_535;

/// Largest id in models: signed 32-bit columns hold it.
pub const MODEL_LABEL_MAX: u32 = i32::MAX as u32;

/// A map of ids, row-major.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LabelMap {
    /// Width, px.
    pub width: u32,
    /// Height, px.
    pub height: u32,
    /// Ids, `[height, width]`.
    pub ids: Vec<u16>,
}

impl LabelMap {
    /// Returns the id at column `x` and row `y`.
    pub fn at(&self, x: u32, y: u32) -> u16 {
        self.ids[(y * self.width + x) as usize]
    }

    /// Returns the id at column `x` and row `y`, or `None` outside the map.
    pub fn get(&self, x: u32, y: u32) -> Option<u16> {
        (x < self.width && y < self.height).then(|| self.at(x, y))
    }

    /// Returns the ids in the map, sorted, without 0.
    pub fn objects(&self) -> Vec<u16> {
        objects_of(&self.ids)
    }

    /// Returns the bounding box of all objects: left, top, and exclusive right and bottom, px. `None` without objects.
    pub fn bounds(&self) -> Option<[u32; 4]> {
        let mut found: Option<[u32; 4]> = None;
        for (y, row) in (0..).zip(self.ids.chunks(self.width.max(1) as usize)) {
            let Some(first) = row.iter().position(|&id| id != 0) else { continue };
            let last = row.iter().rposition(|&id| id != 0).unwrap_or(first);
            let (first, last) = (first as u32, last as u32 + 1);
            let [left, top, right, _] = found.unwrap_or([first, y, last, y]);
            found = Some([left.min(first), top, right.max(last), y + 1]);
        }
        found
    }

    /// Returns the map resized to at least 1 x 1 px, by the id at the centre of each pixel.
    pub fn resized(&self, width: u32, height: u32) -> Self {
        let from =
            |to: u32, size: u32, full: u32| ((u64::from(to) * 2 + 1) * u64::from(full) / (2 * u64::from(size))) as u32;
        let row = |y: u32| (0..width).map(move |x| self.at(from(x, width, self.width), from(y, height, self.height)));
        Self { width, height, ids: (0..height).flat_map(row).collect() }
    }

    /// Returns the upper left part, clamped to the size of the map.
    pub fn upper_left(&self, width: u32, height: u32) -> Self {
        let (width, height) = (width.min(self.width), height.min(self.height));
        let rows = self.ids.chunks(self.width.max(1) as usize).take(height as usize);
        Self { width, height, ids: rows.flat_map(|row| &row[..width as usize]).copied().collect() }
    }

    /// Returns the city-block distance of each pixel with the id to the nearest pixel without it, px; 0 for other
    /// pixels. Pixels outside the image count as pixels without the id.
    pub fn depths(&self, id: u16) -> Vec<u32> {
        let (width, height) = (self.width as usize, self.height as usize);
        let mut depths: Vec<u32> = self.ids.iter().map(|&other| if other == id { u32::MAX / 2 } else { 0 }).collect();
        for y in 0..height {
            for x in 0..width {
                let up = if y > 0 { depths[(y - 1) * width + x] } else { 0 };
                let left = if x > 0 { depths[y * width + x - 1] } else { 0 };
                let at = y * width + x;
                depths[at] = depths[at].min(up + 1).min(left + 1);
            }
        }
        for y in (0..height).rev() {
            for x in (0..width).rev() {
                let down = if y + 1 < height { depths[(y + 1) * width + x] } else { 0 };
                let right = if x + 1 < width { depths[y * width + x + 1] } else { 0 };
                let at = y * width + x;
                depths[at] = depths[at].min(down + 1).min(right + 1);
            }
        }
        depths
    }

    /// Returns true for pixels with another id within `distance` px, in a square window.
    pub fn near_contour(&self, distance: u32) -> Vec<bool> {
        let (width, height, distance) = (self.width as usize, self.height as usize, distance as usize);
        // Smallest and largest id over rows, then over columns: they differ near contours.
        let rows = || self.ids.chunks(width.max(1));
        let (across, down) = (distance.min(width.saturating_sub(1)), distance.min(height.saturating_sub(1)));
        let low: Vec<u16> = rows().flat_map(|row| widened(row, across, 1, u16::min)).collect();
        let high: Vec<u16> = rows().flat_map(|row| widened(row, across, 1, u16::max)).collect();
        let (low, high) = (widened(&low, down, width, u16::min), widened(&high, down, width, u16::max));
        low.into_iter().zip(high).map(|(low, high)| low != high).collect()
    }
}

/// Folds each value with `pick` over itself and up to `steps` values before and after it, `stride` apart.
#[inline]
fn widened(values: &[u16], steps: usize, stride: usize, pick: impl Fn(u16, u16) -> u16) -> Vec<u16> {
    let mut found = values.to_vec();
    for shift in (1..=steps).map(|step| step * stride) {
        found[shift..].iter_mut().zip(values).for_each(|(to, &before)| *to = pick(*to, before));
        found.iter_mut().zip(&values[shift..]).for_each(|(to, &after)| *to = pick(*to, after));
    }
    found
}

/// Returns the display colours of ids.
pub fn label_colours<T: Copy + Into<u32>>(ids: &[T]) -> Vec<[u8; 3]> {
    ids.iter().map(|&id| label_colour(id.into())).collect()
}

/// Returns the display colour of an id: hues are a golden ratio apart; 0 is black.
pub fn label_colour(id: u32) -> [u8; 3] {
    if id == UNLABELLED {
        return [0; 3];
    }
    let hue = (f64::from(id) * 0.618_033_988_749_895).fract() * 6.0;
    let saturation = if id.is_multiple_of(2) { 0.55 } else { 0.95 };
    let channel = |offset: f64| {
        let k = (offset + hue) % 6.0;
        let value = 1.0 - saturation * k.min(4.0 - k).clamp(0.0, 1.0);
        (value * 255.0).round() as u8
    };
    [channel(5.0), channel(3.0), channel(1.0)]
}

/// Returns the ids of some pixels, sorted, without 0.
pub fn objects_of(ids: &[u16]) -> Vec<u16> {
    // One bit per id.
    let mut seen = [0_u64; 1024];
    ids.iter().for_each(|&id| seen[usize::from(id / 64)] |= 1 << (id % 64));
    seen[0] &= !1;
    let of_word =
        |(at, &word): (u16, &u64)| (0..64).filter(move |bit| word >> bit & 1 == 1).map(move |bit| at * 64 + bit);
    (0..).zip(&seen).filter(|(_, word)| **word != 0).flat_map(of_word).collect()
}

#[cfg(test)]
mod tests {
    use super::LabelMap;

    /// Distances by definition: to the nearest pixel with another id, the frame around the picture included.
    #[test]
    fn depths_are_distances_to_the_next_pixel_without_the_id() {
        let (width, height) = (9_u32, 7_u32);
        let ids = (0..width * height).map(|at| if at % 11 == 3 { 2 } else { 5 }).collect();
        let map = LabelMap { width, height, ids };
        let is_inside = |x: i64, y: i64| {
            (0..i64::from(width)).contains(&x) && (0..i64::from(height)).contains(&y) && map.at(x as u32, y as u32) == 5
        };
        for (at, depth) in map.depths(5).into_iter().enumerate() {
            let (x, y) = ((at % width as usize) as i64, (at / width as usize) as i64);
            let around = (-1..=i64::from(height)).flat_map(|v| (-1..=i64::from(width)).map(move |u| (u, v)));
            let nearest = around.filter(|&(u, v)| !is_inside(u, v)).map(|(u, v)| (x - u).abs() + (y - v).abs()).min();
            assert_eq!(Some(i64::from(depth)), nearest, "at {x},{y}");
        }
    }
}
