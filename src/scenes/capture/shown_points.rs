//! The points of the reconstruction that each photo shows.

use super::Observations;
use glam::{DVec2, DVec3};
use labelgs_scene::sampling::{TESTS_MAX, spread_order, stride};
use labelgs_scene::stage::Stage;
use labelgs_scene::{Point, View};
use rayon::prelude::*;
use std::collections::HashMap;

/// Shared points per photo after which more add no information about its brightness.
const SHARED_POINTS_MAX: usize = 2000;
/// Number of points tested at once for a sample.
const CHUNK_POINTS: usize = 4096;

/// A point in a photo: its index, and its pixel.
pub(super) type Mark = (usize, DVec2);

/// The points of a scene in its photos. The reconstruction decides if it assigns points to a photo. Otherwise a photo
/// shows all points inside its image; these are not listed, because they may be very many.
pub(super) struct ShownPoints<'a> {
    views: Vec<&'a View>,
    points: &'a [Point],
    listed: Vec<Option<Vec<Mark>>>,
}

impl<'a> ShownPoints<'a> {
    pub(super) fn new(views: Vec<&'a View>, points: &'a [Point], looked: &Observations) -> Self {
        let of = |view: &&View| looked.for_view(view).map(|(_, seen)| seen).filter(|seen| !seen.is_empty());
        let observed: Vec<_> = views.iter().map(of).collect();
        let key = |place: DVec3| place.to_array().map(f64::to_bits);
        let is_listed = observed.iter().any(Option::is_some);
        let places = points.iter().enumerate().filter(|_| is_listed);
        let index: HashMap<[u64; 3], usize> = places.map(|(index, point)| (key(point.position), index)).collect();
        let of_view = |(view, seen): (&&View, &Option<&Vec<(DVec2, DVec3)>>)| {
            let mark = |(_, world): &(DVec2, DVec3)| {
                let index = *index.get(&key(*world))?;
                Some((index, view.camera.sees(points[index].position)?))
            };
            seen.map(|seen| seen.iter().filter_map(mark).collect())
        };
        let listed = views.par_iter().zip(&observed).map(of_view).collect();
        Self { views, points, listed }
    }

    /// Returns the points that the reconstruction assigns to each view, or `None` if it assigns none.
    pub(super) fn listed(&self) -> &[Option<Vec<Mark>>] {
        &self.listed
    }

    /// Returns the views without assigned points.
    fn unlisted(&self) -> Vec<usize> {
        (0..self.views.len()).filter(|&view| self.listed[view].is_none()).collect()
    }

    fn pixel(&self, view: usize, point: usize) -> Option<DVec2> {
        self.views[view].camera.sees(self.points[point].position)
    }

    /// Returns how many points each view shows, and how many of these at least two others also show. With very many
    /// points and views, counts every n-th point n times.
    pub(super) fn counts(&self) -> Vec<(usize, usize)> {
        let _stage = Stage::new("counting the points of photos", 0);
        let unlisted = self.unlisted();
        let stride = stride(self.points.len(), unlisted.len());
        let mut times = vec![0_usize; self.points.len()];
        self.listed.iter().flatten().flatten().for_each(|&(point, _)| times[point] += 1);
        times.par_iter_mut().enumerate().filter(|(point, _)| point.is_multiple_of(stride)).for_each(
            |(point, times)| {
                *times += unlisted.iter().filter(|&&view| self.pixel(view, point).is_some()).count();
            },
        );
        let of_view = |view: usize| {
            let mut found = (0, 0);
            let mut count = |point: usize| {
                found.0 += stride;
                found.1 += if times[point] >= 3 { stride } else { 0 };
            };
            let counted = |point: &usize| point.is_multiple_of(stride);
            match &self.listed[view] {
                Some(marks) => marks.iter().map(|&(point, _)| point).filter(counted).for_each(&mut count),
                None => {
                    let points = (0..self.points.len()).step_by(stride);
                    points.filter(|&point| self.pixel(view, point).is_some()).for_each(&mut count);
                }
            }
            found
        };
        (0..self.views.len()).into_par_iter().map(of_view).collect()
    }

    /// Returns a sample of points that several views show, and which of them each view shows: all of them, or
    /// [`SHARED_POINTS_MAX`] per view.
    pub(super) fn sample(&self) -> (usize, Vec<Vec<Mark>>) {
        let _stage = Stage::new("choosing points that photos share", 0);
        let kept = self.shared();
        let mut place = vec![None; self.points.len()];
        kept.iter().enumerate().for_each(|(at, &point)| place[point] = Some(at));
        let of_view = |view: usize| match &self.listed[view] {
            Some(marks) => marks.iter().filter_map(|&(point, pixel)| Some((place[point]?, pixel))).collect(),
            None => {
                let mark = |(at, &point): (usize, &usize)| Some((at, self.pixel(view, point)?));
                kept.iter().enumerate().filter_map(mark).collect()
            }
        };
        (kept.len(), (0..self.views.len()).into_par_iter().map(of_view).collect())
    }

    /// Draws shared points until each view shows enough of them. The points of views with few come last.
    fn shared(&self) -> Vec<usize> {
        let unlisted = self.unlisted();
        let mut listed: Vec<(usize, usize)> = Vec::new();
        for (view, marks) in self.listed.iter().enumerate() {
            listed.extend(marks.iter().flatten().map(|&(point, _)| (point, view)));
        }
        listed.par_sort_unstable();
        let order = spread_order(self.points.len());
        let most = if unlisted.is_empty() { usize::MAX } else { TESTS_MAX / unlisted.len() };
        let (mut kept, mut shows) = (Vec::new(), vec![0; self.views.len()]);
        for first in (0..self.points.len().min(most)).step_by(CHUNK_POINTS) {
            let wants: Vec<bool> = shows.iter().map(|&shows| shows < SHARED_POINTS_MAX).collect();
            if !wants.contains(&true) {
                break;
            }
            let drawn = |rank: usize| {
                let point = order(rank);
                let from = listed.partition_point(|&(other, _)| other < point);
                let said = listed[from..].iter().take_while(|&&(other, _)| other == point).map(|&(_, view)| view);
                let is_wanted = said.clone().any(|view| wants[view])
                    || unlisted.iter().any(|&view| wants[view] && self.pixel(view, point).is_some());
                let seen = unlisted.iter().copied().filter(|&view| is_wanted && self.pixel(view, point).is_some());
                let by: Vec<usize> = said.chain(seen).collect();
                (is_wanted && by.len() >= 2).then_some((point, by))
            };
            let chunk = first..(first + CHUNK_POINTS).min(self.points.len());
            for (point, by) in chunk.into_par_iter().filter_map(drawn).collect::<Vec<_>>() {
                if by.iter().any(|&view| shows[view] < SHARED_POINTS_MAX) {
                    by.iter().for_each(|&view| shows[view] += 1);
                    kept.push(point);
                }
            }
        }
        kept.sort_unstable();
        kept
    }
}

#[cfg(test)]
mod tests {
    use super::{Observations, SHARED_POINTS_MAX, ShownPoints};
    use glam::{DMat3, DVec3};
    use labelgs_scene::{Camera, Point, View};
    use std::collections::BTreeMap;

    /// A camera at a position, looking along z.
    fn view(name: &str, at: DVec3) -> View {
        let (fx, fy, cx, cy) = (50.0, 50.0, 50.0, 50.0);
        let camera = Camera { rotation: DMat3::IDENTITY, translation: -at, fx, fy, cx, cy, width: 100, height: 100 };
        View { name: name.to_owned(), camera, photo: None, mask: None }
    }

    /// Two photos of a dense wall, two of a sparse one far away, and an isolated one: the dense ones share a sample,
    /// the sparse ones everything they have.
    #[test]
    fn a_sample_is_large_enough_for_each_view() {
        let wall = |x: f64, side: usize| {
            let place = move |at: usize| (at as f64 + 0.5) / side as f64 - 0.5;
            (0..side * side).map(move |at| DVec3::new(x + place(at % side), place(at / side), 2.0))
        };
        let positions = wall(0.0, 300).chain(wall(100.0, 9));
        let points: Vec<Point> = positions.map(|position| Point { position, colour: [9; 3] }).collect();
        let views = [view("a", DVec3::ZERO), view("b", DVec3::X * 0.1), view("c", DVec3::X * 100.0)];
        let views = [&views[..], &[view("d", DVec3::X * 100.1), view("e", DVec3::X * 1e4)]].concat();
        let looked = Observations { photos: BTreeMap::new(), faces: BTreeMap::new() };
        let shown = ShownPoints::new(views.iter().collect(), &points, &looked);
        let (count, marks) = shown.sample();
        let of: Vec<usize> = marks.iter().map(Vec::len).collect();
        assert!((SHARED_POINTS_MAX..SHARED_POINTS_MAX + 100).contains(&of[0]) && of[1] == of[0], "{of:?}");
        assert_eq!((of[2], of[3], of[4], count), (81, 81, 0, of[0] + 81));
        // They are spread over the wall.
        let left = marks[0].iter().filter(|(_, pixel)| pixel.x < 50.0).count();
        assert!(left.abs_diff(of[0] / 2) < 50, "{left} of {}", of[0]);
        let counts = shown.counts();
        assert_eq!(counts[2..], [(81, 0), (81, 0), (0, 0)]);
        assert_eq!(counts[0].0, 90_000);
    }

    #[test]
    fn a_small_scene_keeps_all_points_that_several_views_show() {
        let points: Vec<Point> = (0..700)
            .map(|at| Point { position: DVec3::new(f64::from(at) * 0.01 - 3.0, 0.0, 2.0), colour: [9; 3] })
            .collect();
        let views = [view("a", DVec3::ZERO), view("b", DVec3::X)];
        let looked = Observations { photos: BTreeMap::new(), faces: BTreeMap::new() };
        let shown = ShownPoints::new(views.iter().collect(), &points, &looked);
        let both = |point: &&Point| views.iter().all(|view| view.camera.sees(point.position).is_some());
        let expected = points.iter().filter(both).count();
        let (count, marks) = shown.sample();
        assert!(expected > 200 && count == expected && marks.iter().all(|marks| marks.len() == expected));
        assert!(marks.iter().all(|marks| marks.is_sorted_by_key(|&(point, _)| point)));
    }
}
