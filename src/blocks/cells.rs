//! Divides the ground into block cores by repeated halving.

use crate::error::{Error, Result, Setting};
use crate::records::block_file::Bounds;
use glam::DVec3;

/// Margin of the zone on each side of the core, as a share of the core's side.
const ZONE_MARGIN_SHARE: f64 = 0.1;
/// Share of the Gaussians at each end of an axis that is ignored when a core is measured.
const OUTLIER_SHARE: f64 = 0.01;

/// A core with the Gaussians in it.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Cell {
    /// Bounds of the core; open at the border of the scene.
    pub core: Bounds,
    /// Rows of the coarse model, ascending.
    pub rows: Vec<usize>,
    /// Box of these Gaussians without outliers. Unlike the core, it is closed on all sides.
    pub inside: [DVec3; 2],
}

impl Cell {
    /// Makes one cell of all Gaussians. `places` are their rows and positions in the ground frame.
    pub(super) fn whole(places: &[(usize, DVec3)]) -> Self {
        Self::new(Bounds::ALL, places.to_vec())
    }

    fn new(core: Bounds, places: Vec<(usize, DVec3)>) -> Self {
        let side = |axis: usize| {
            let mut values: Vec<f64> = places.iter().map(|(_, at)| at[axis]).collect();
            values.sort_by(f64::total_cmp);
            let cut = (OUTLIER_SHARE * values.len() as f64) as usize;
            let ends = |at: usize| values.get(at).copied().unwrap_or(0.0);
            let most = [ends(cut), ends(values.len().saturating_sub(cut + 1))];
            [core.low[axis].unwrap_or(most[0]), core.high[axis].unwrap_or(most[1])]
        };
        let sides = [side(0), side(1), side(2)];
        let inside = [0, 1].map(|end| DVec3::new(sides[0][end], sides[1][end], sides[2][end]));
        Self { core, rows: places.into_iter().map(|(row, _)| row).collect(), inside }
    }

    /// Returns the zone: the core plus a margin on its closed sides.
    pub(super) fn zone(&self) -> Bounds {
        let mut zone = self.core;
        for axis in 0..2 {
            let margin = ZONE_MARGIN_SHARE * (self.inside[1][axis] - self.inside[0][axis]);
            zone.low[axis] = zone.low[axis].map(|side| side - margin);
            zone.high[axis] = zone.high[axis].map(|side| side + margin);
        }
        zone
    }

    /// Halves the cell across its longer ground axis, with equally many Gaussians in both halves. `place` gives the
    /// position of a row. Fails if all Gaussians have the same position.
    pub(super) fn halves(&self, place: impl Fn(usize) -> DVec3) -> Result<[Self; 2]> {
        let size = self.inside[1] - self.inside[0];
        let axes = if size.x >= size.y { [0, 1] } else { [1, 0] };
        let mut places: Vec<(usize, DVec3)> = self.rows.iter().map(|&row| (row, place(row))).collect();
        for axis in axes {
            // Ties are broken by row, so the order is deterministic.
            places.sort_by(|a, b| a.1[axis].total_cmp(&b.1[axis]).then(a.0.cmp(&b.0)));
            let cut = places.get(places.len() / 2).map_or(0.0, |(_, at)| at[axis]);
            let (mut low, mut high): (Vec<_>, Vec<_>) = places.iter().copied().partition(|(_, at)| at[axis] < cut);
            if low.is_empty() || high.is_empty() {
                continue;
            }
            low.sort_by_key(|(row, _)| *row);
            high.sort_by_key(|(row, _)| *row);
            let (mut before, mut after) = (self.core, self.core);
            (before.high[axis], after.low[axis]) = (Some(cut), Some(cut));
            return Ok([Self::new(before, low), Self::new(after, high)]);
        }
        let problem = format!("{} Gaussians of a block have the same position and cannot be halved", self.rows.len());
        Err(Error::usage(
            Setting("blocks"),
            format!("{problem}; request fewer blocks, or train the coarse model for longer"),
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Zone;
    use std::collections::BTreeSet;

    /// Scattered positions, with some duplicates and some exactly on later borders.
    fn places(count: usize) -> Vec<(usize, DVec3)> {
        let at = |i: usize| DVec3::new((i * 7 % 16) as f64, (i * 5 % 12) as f64, (i % 3) as f64);
        (0..count).map(|i| (i, at(i))).collect()
    }

    fn leaves(places: &[(usize, DVec3)], count: usize) -> Vec<Cell> {
        let mut cells = vec![Cell::whole(places)];
        while cells.len() < count {
            let largest =
                (0..cells.len()).fold(0, |a, b| if cells[b].rows.len() > cells[a].rows.len() { b } else { a });
            let halves = cells[largest].halves(|row| places.iter().find(|p| p.0 == row).expect("a row").1);
            cells.splice(largest..=largest, halves.expect("halves"));
        }
        cells
    }

    fn zone(bounds: &Bounds) -> Zone {
        bounds.zone([DVec3::X, DVec3::Y, DVec3::Z].map(|axis| axis.to_array()))
    }

    #[test]
    fn every_place_is_in_one_core() {
        let all = places(400);
        let cells = leaves(&all, 6);
        let probes =
            all.iter().map(|(_, at)| *at).chain([DVec3::splat(-1e9), DVec3::splat(1e9), DVec3::new(8.0, 6.0, 0.0)]);
        for at in probes {
            assert_eq!(cells.iter().filter(|cell| zone(&cell.core).contains(at)).count(), 1, "{at}");
        }
        for cell in &cells {
            assert!(cell.rows.is_sorted() && cell.rows.len() >= 400 / 12, "{} rows", cell.rows.len());
            assert!(cell.rows.iter().all(|&row| zone(&cell.core).contains(all[row].1)));
            assert!(cell.rows.iter().all(|&row| zone(&cell.zone()).contains(all[row].1)));
        }
        assert_eq!(cells.iter().map(|cell| cell.rows.len()).sum::<usize>(), 400);
    }

    #[test]
    fn the_order_of_the_places_does_not_matter() {
        let all = places(300);
        let mut mixed = all.clone();
        mixed.sort_by_key(|(row, _)| row * 77 % 300);
        let sorted = |cells: Vec<Cell>| -> Vec<(Bounds, BTreeSet<usize>)> {
            cells.into_iter().map(|cell| (cell.core, cell.rows.into_iter().collect())).collect()
        };
        assert_eq!(sorted(leaves(&all, 5)), sorted(leaves(&mixed, 5)));
    }

    #[test]
    fn one_place_cannot_be_halved() {
        let one: Vec<(usize, DVec3)> = (0..5).map(|row| (row, DVec3::ONE)).collect();
        let error = Cell::whole(&one).halves(|_| DVec3::ONE).expect_err("one place");
        assert!(error.to_string().contains("cannot be halved"), "{error}");
        assert!(Cell::whole(&one[..1]).halves(|_| DVec3::ONE).is_err());
    }

    #[test]
    fn a_zone_is_larger_where_it_has_neighbours() {
        let cells = leaves(&places(400), 2);
        let (left, right) = (cells[0].zone(), cells[1].zone());
        let cut = cells[0].core.high[0].expect("a cut along x, the longer side");
        assert!(left.low == [None; 3] && left.high[0].expect("a side") > cut && right.low[0].expect("a side") < cut);
        assert_eq!((right.high, left.high[1]), ([None; 3], None));
    }
}
