//! The crop of a picture around an object.

/// A rectangle of pixels; the end is exclusive.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Crop {
    /// First column and row.
    pub start: (usize, usize),
    /// Column and row after the last.
    pub end: (usize, usize),
}

/// Padding on each side, as a share of the box side.
const PADDING_SHARE: f64 = 0.15;

impl Crop {
    /// Returns the crop in which the paper's later scorer compares an object: the box of its mask, padded by 15 % on
    /// each side, then enlarged about its centre to the aspect ratio of the image, both times clipped to the image.
    /// `None` for an empty mask.
    pub fn around(mask: &[bool], width: usize, height: usize) -> Option<Self> {
        let (mut low, mut high) = ((width, height), (0, 0));
        for index in (0..mask.len()).filter(|&index| mask[index]) {
            let (x, y) = (index % width, index / width);
            low = (low.0.min(x), low.1.min(y));
            high = (high.0.max(x + 1), high.1.max(y + 1));
        }
        if high == (0, 0) {
            return None;
        }
        let padded = |low: usize, high: usize, side: usize| {
            let (low, high) = (low as f64, high as f64);
            let more = PADDING_SHARE * (high - low);
            ((low - more).max(0.0), (high + more).min(side as f64))
        };
        let (x, y) = (padded(low.0, high.0, width), padded(low.1, high.1, height));
        let ratio = ((x.1 - x.0) / width as f64).max((y.1 - y.0) / height as f64);
        let fitted = |(low, high): (f64, f64), side: usize| {
            let (centre, half) = (0.5 * (low + high), 0.5 * ratio * side as f64);
            // Half a millionth of a pixel protects integers from rounding errors.
            let whole = |value: f64| (value.clamp(0.0, side as f64) + 5e-7) as usize;
            (whole(centre - half), whole(centre + half).min(side))
        };
        let (x, y) = (fitted(x, width), fitted(y, height));
        Some(Self { start: (x.0, y.0), end: (x.1, y.1) })
    }

    /// Returns the numbers of columns and rows.
    pub fn size(&self) -> (usize, usize) {
        (self.end.0 - self.start.0, self.end.1 - self.start.1)
    }

    /// Returns the crop's pixel indices in a row-major image `width` px wide.
    pub fn indices(self, width: usize) -> impl Iterator<Item = usize> {
        (self.start.1..self.end.1).flat_map(move |y| (self.start.0..self.end.0).map(move |x| y * width + x))
    }
}
