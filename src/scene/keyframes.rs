//! A smooth camera path through keyframes.
//!
//! Positions and intrinsics are cubic Hermite curves over time, rotations are cubic Bézier curves of quaternions (Kim,
//! Kim and Shin, A general construction scheme for unit quaternion curves, 1995). The rate at a keyframe has the
//! direction of a centripetal Catmull-Rom curve, which bisects the angle between the incoming and the outgoing chord.
//! Its magnitude is a harmonic mean of the speeds before and after (Fritsch and Butland, 1984). So equal steps give a
//! constant speed, a pause stands still, and a camera that turns back at a keyframe does not overshoot it.

use super::Camera;
use super::words::counted;
use glam::{DMat3, DQuat, DVec3};

/// Most frames of a path: more than a day at 10 per second.
const FRAMES_MAX: f64 = 1e6;
/// Share of the frame interval by which the last frame may exceed the end, because times in files are rounded.
const END_TOLERANCE: f64 = 1e-6;

/// A path through keyframes of the same image size.
#[derive(Clone, Debug, PartialEq)]
pub struct CameraPath {
    knots: Vec<Knot>,
}

/// A keyframe and the rates of change there.
#[derive(Clone, Debug, PartialEq)]
struct Knot {
    time: f64,
    camera: Camera,
    /// Centre, focal lengths, principal point.
    values: [DVec3; 3],
    /// Rates of change, per second.
    rates: [DVec3; 3],
    /// World from camera.
    turn: DQuat,
    /// Rotation rate in the camera's frame: axis times radians per second.
    spin: DVec3,
}

impl Knot {
    fn new(time: f64, camera: Camera) -> Self {
        let Camera { fx, fy, cx, cy, .. } = camera;
        let values = [camera.centre(), DVec3::new(fx, fy, 0.0), DVec3::new(cx, cy, 0.0)];
        let turn = DQuat::from_mat3(&camera.rotation.transpose()).normalize();
        Self { time, camera, values, rates: [DVec3::ZERO; 3], turn, spin: DVec3::ZERO }
    }
}

impl CameraPath {
    /// Creates a path through cameras at given times, s. Errors if there are none, if times do not increase, or if
    /// image sizes differ.
    pub fn new(keyframes: Vec<(f64, Camera)>) -> Result<Self, String> {
        let mut knots: Vec<Knot> = keyframes.into_iter().map(|(time, camera)| Knot::new(time, camera)).collect();
        let Some(first) = knots.first() else { return Err("there is none; a path needs one or more".to_owned()) };
        let size = first.camera.size();
        for (at, knot) in knots.iter().enumerate() {
            let before = at.checked_sub(1).map(|before| knots[before].time);
            if !knot.time.is_finite() || before.is_some_and(|before| knot.time <= before) {
                let before = before.map_or(String::new(), |before| format!(", after {before} s"));
                return Err(format!("number {at} is at {} s{before}; times must increase", knot.time));
            }
            if knot.camera.size() != size {
                let ((width, height), (own_width, own_height)) = (size, knot.camera.size());
                return Err(format!(
                    "number {at} has {own_width} x {own_height} px, but the first has {width} x {height}; images of \
                     a path have one size"
                ));
            }
        }
        let inner: Vec<([DVec3; 3], DVec3)> = (0..knots.len()).map(|at| inner_rates(&knots, at)).collect();
        knots.iter_mut().zip(inner).for_each(|(knot, rates)| (knot.rates, knot.spin) = rates);
        let last = knots.len() - 1;
        if last > 0 {
            let ends = [end_rates(&knots, 0, 1), end_rates(&knots, last - 1, last - 1)];
            [0, last].into_iter().zip(ends).for_each(|(at, rates)| (knots[at].rates, knots[at].spin) = rates);
        }
        Ok(Self { knots })
    }

    /// Returns the time from the first keyframe to the last, s.
    pub fn duration(&self) -> f64 {
        self.knots.last().map_or(0.0, |last| last.time - self.knots[0].time)
    }

    /// Returns the camera at a time, s, clamped to the first and last keyframe. At a keyframe it is exactly that
    /// camera.
    pub fn at(&self, time: f64) -> Camera {
        let after = self.knots.partition_point(|knot| knot.time < time);
        match self.knots.get(after.saturating_sub(1)..=after) {
            Some([from, to]) if to.time != time => segment(from, to, (time - from.time) / (to.time - from.time)),
            _ => self.knots[after.min(self.knots.len() - 1)].camera.clone(),
        }
    }

    /// Returns the cameras of a video with this many frames per second, from the first keyframe to the last, or shortly
    /// before it. Errors for more than a million frames.
    pub fn frames(&self, per_second: f64) -> Result<Vec<Camera>, String> {
        let steps = self.duration() * per_second;
        if !(per_second > 0.0 && steps < FRAMES_MAX) {
            let duration = self.duration();
            let most = counted(FRAMES_MAX as u64, "frame");
            return Err(format!(
                "{duration} s of {per_second} frames per second; expected more than 0 and at most {most}"
            ));
        }
        let (start, end) = (self.knots[0].time, self.knots[0].time + self.duration());
        let at = |frame: u32| self.at((start + f64::from(frame) / per_second).min(end));
        Ok((0..=(steps + END_TOLERANCE) as u32).map(at).collect())
    }
}

/// Returns the rates at an inner keyframe; 0 at an end.
fn inner_rates(knots: &[Knot], at: usize) -> ([DVec3; 3], DVec3) {
    if at == 0 || at + 1 == knots.len() {
        return ([DVec3::ZERO; 3], DVec3::ZERO);
    }
    let times = [at, at + 1].map(|at| knots[at].time - knots[at - 1].time);
    let [(before, turned), (after, turning)] = [at - 1, at].map(|from| chords(knots, from));
    ([0, 1, 2].map(|value| rate([before[value], after[value]], times)), rate([turned, turning], times))
}

/// Returns the rates at an end, so that the change there is even. `from` is the first keyframe of the end segment,
/// `inner` the neighbour of the end.
fn end_rates(knots: &[Knot], from: usize, inner: usize) -> ([DVec3; 3], DVec3) {
    let (chord, turn) = chords(knots, from);
    if knots.len() == 2 {
        return (chord, turn);
    }
    let free = |chord: DVec3, rate: DVec3| 1.5 * chord - 0.5 * rate;
    let inner = &knots[inner];
    ([0, 1, 2].map(|value| free(chord[value], inner.rates[value])), free(turn, inner.spin))
}

/// Returns the mean rates from a keyframe to the next one: of the values, and of the rotation along the shorter way.
fn chords(knots: &[Knot], from: usize) -> ([DVec3; 3], DVec3) {
    let (a, b) = (&knots[from], &knots[from + 1]);
    let time = b.time - a.time;
    ([0, 1, 2].map(|value| (b.values[value] - a.values[value]) / time), vector_of(a.turn.inverse() * b.turn) / time)
}

/// Returns the rate at a keyframe from the mean rates before and after it.
fn rate([before, after]: [DVec3; 2], [time_before, time_after]: [f64; 2]) -> DVec3 {
    let speeds = [before.length(), after.length()];
    if speeds.contains(&0.0) {
        return DVec3::ZERO;
    }
    // The speed of the shorter interval has more weight.
    let weights = [2.0 * time_after + time_before, time_after + 2.0 * time_before];
    let speed = (weights[0] + weights[1]) / (weights[0] / speeds[0] + weights[1] / speeds[1]);
    0.5 * (before / speeds[0] + after / speeds[1]) * speed
}

/// Returns the camera between two keyframes at a share of the interval.
fn segment(from: &Knot, to: &Knot, share: f64) -> Camera {
    let time = to.time - from.time;
    let (left, share2, share3) = (1.0 - share, share * share, share * share * share);
    let value = |at: usize| {
        from.values[at] * (1.0 - 3.0 * share2 + 2.0 * share3)
            + to.values[at] * (3.0 * share2 - 2.0 * share3)
            + (from.rates[at] * left - to.rates[at] * share) * (share * left * time)
    };
    let (first, last) = (from.spin * (time / 3.0), to.spin * (time / 3.0));
    let quat = DQuat::from_scaled_axis;
    let middle = vector_of(quat(-first) * from.turn.inverse() * to.turn * quat(-last));
    let turn = from.turn
        * quat(first * (1.0 - left * left * left))
        * quat(middle * (3.0 * share2 - 2.0 * share3))
        * quat(last * share3);
    let rotation = DMat3::from_quat(turn.normalize()).transpose();
    let (centre, focal, principal) = (value(0), value(1), value(2));
    Camera {
        rotation,
        translation: -(rotation * centre),
        fx: focal.x,
        fy: focal.y,
        cx: principal.x,
        cy: principal.y,
        ..from.camera
    }
}

/// Returns the axis times the angle of a rotation, along the shorter way.
fn vector_of(turn: DQuat) -> DVec3 {
    (if turn.w < 0.0 { -turn } else { turn }).to_scaled_axis()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    fn camera(centre: DVec3, turn: DQuat) -> Camera {
        let rotation = DMat3::from_quat(turn).transpose();
        let camera = Camera::at_origin([80.0, 81.0, 32.0, 24.0], (64, 48));
        Camera { rotation, translation: -(rotation * centre), ..camera }
    }

    fn path(keyframes: &[(f64, Camera)]) -> CameraPath {
        CameraPath::new(keyframes.to_vec()).expect("a path")
    }

    /// Angle between the rotations of two cameras, radians.
    fn angle(a: &Camera, b: &Camera) -> f64 {
        vector_of(DQuat::from_mat3(&a.rotation).inverse() * DQuat::from_mat3(&b.rotation)).length()
    }

    /// Keyframes with uneven times, places, turns and lenses.
    fn wild() -> Vec<(f64, Camera)> {
        let place = |i: f64| DVec3::new((7.0 * i).sin() * 4.0, i * i * 0.1, (3.0 * i).cos());
        let turn = |i: f64| DQuat::from_scaled_axis(DVec3::new(i.sin(), 2.0 * (2.0 * i).cos(), 0.3 * i));
        let key = |i: u32| {
            let i = f64::from(i);
            let lens = Camera { fx: 80.0 + 9.0 * i, cx: 32.0 - i, ..camera(place(i), turn(i)) };
            (i + 0.4 * (5.0 * i).sin(), lens)
        };
        (0..9).map(key).collect()
    }

    #[test]
    fn it_passes_the_keyframes_and_has_no_kinks() {
        let keys = wild();
        let path = path(&keys);
        for (time, camera) in &keys {
            assert_eq!(&path.at(*time), camera, "at {time}");
        }
        assert_eq!((path.at(-9.0), path.at(99.0)), (keys[0].1.clone(), keys[8].1.clone()));
        // Places, turns and lenses go on as fast after a keyframe as before it.
        let step = 1e-5;
        for (time, here) in &keys[1..8] {
            let (before, after) = (path.at(time - step), path.at(time + step));
            let (come, go) = (here.centre() - before.centre(), after.centre() - here.centre());
            assert!(come.distance(go) < 1e-3 * (come.length() + step), "{come} {go} at {time}");
            let (come, go) = (angle(&before, here), angle(here, &after));
            assert!((come - go).abs() < 1e-3 * step && angle(&before, &after) > (2.0 - 1e-3) * come, "{come} {go}");
            assert!((2.0 * here.fx - before.fx - after.fx).abs() < 1e-3 * step);
        }
        for frame in path.frames(30.0).expect("frames") {
            let gram = frame.rotation.transpose() * frame.rotation - DMat3::IDENTITY;
            assert!(gram.to_cols_array().iter().all(|value| value.abs() < 1e-12), "no rotation");
        }
    }

    #[test]
    fn equal_steps_give_an_even_speed() {
        // Half a circle around the origin, with the camera turning along.
        let key = |i: u32| {
            let angle = TAU * f64::from(i) / 16.0;
            let place = 3.0 * DVec3::new(angle.cos(), 0.0, angle.sin());
            (2.0 * f64::from(i), camera(place, DQuat::from_rotation_y(-angle)))
        };
        let path = path(&(0..9).map(key).collect::<Vec<_>>());
        let frames = path.frames(10.0).expect("frames");
        assert_eq!(frames.len(), 161);
        let (length, turn) = (3.0 * TAU / 2.0 / 160.0, TAU / 2.0 / 160.0);
        for pair in frames.windows(2) {
            let moved = pair[0].centre().distance(pair[1].centre()) / length;
            let turned = angle(&pair[0], &pair[1]) / turn;
            assert!((moved - 1.0).abs() < 0.08 && (turned - 1.0).abs() < 1e-6, "{moved} {turned}");
            assert!((pair[1].centre().length() - 3.0).abs() < 0.03, "{}", pair[1].centre());
        }
    }

    #[test]
    fn what_turns_back_or_pauses_does_not_go_beyond() {
        let turns = [0.0, 1.0, 1.0, 1.2, -0.5, -0.4];
        let key = |(i, &turn): (u32, &f64)| {
            (f64::from(i), camera(DVec3::X * (10.0 * turn + 5.0), DQuat::from_rotation_z(turn)))
        };
        let keys: Vec<(f64, Camera)> = (0..).zip(&turns).map(key).collect();
        let path = path(&keys);
        for step in 0..=500 {
            let time = f64::from(step) / 100.0;
            let part = (time as usize).min(4);
            let (low, high) = (turns[part].min(turns[part + 1]), turns[part].max(turns[part + 1]));
            let found = path.at(time);
            let turn = vector_of(DQuat::from_mat3(&found.rotation.transpose()));
            assert!(turn.x.abs() + turn.y.abs() < 1e-9, "{turn} leaves the axis");
            assert!((low - 1e-9..=high + 1e-9).contains(&turn.z), "{turn} at {time}, of {low} to {high}");
            let place = (found.centre().x - 5.0) / 10.0;
            assert!((low - 1e-9..=high + 1e-9).contains(&place), "{place} at {time}, of {low} to {high}");
        }
        assert!(path.at(1.5).centre().distance(keys[1].1.centre()) < 1e-12, "a pause stands still");
    }

    #[test]
    fn few_keyframes_make_a_path_too() {
        let a = camera(DVec3::new(1.0, 2.0, 3.0), DQuat::from_rotation_y(0.2));
        let one = path(&[(5.0, a.clone())]);
        assert_eq!((one.duration(), one.frames(30.0)), (0.0, Ok(vec![a.clone()])));

        // The shorter way, although the quaternions of the ends point to opposite sides.
        let b = camera(DVec3::new(5.0, 2.0, 1.0), DQuat::from_rotation_y(TAU - 0.6));
        let two = path(&[(1.0, a.clone()), (3.0, b.clone())]);
        let frames = two.frames(2.0).expect("frames");
        assert_eq!((frames.len(), &frames[0], &frames[4]), (5, &a, &b));
        for (at, frame) in (0..).zip(&frames) {
            let share = f64::from(at) / 4.0;
            assert!(frame.centre().distance(a.centre().lerp(b.centre(), share)) < 1e-12, "a straight line");
            assert!((angle(&a, frame) - 0.8 * share).abs() < 1e-9, "an even turn");
        }
        // 0.3 s of 10 frames per second, although 0.1 + 0.2 is more.
        let short = path(&[(0.1 + 0.2, a.clone()), (0.6, b)]);
        assert_eq!(short.frames(10.0).expect("frames").len(), 4);
    }

    #[test]
    fn what_is_no_path_is_refused() {
        let a = camera(DVec3::ZERO, DQuat::IDENTITY);
        let refused = |keys: Vec<(f64, Camera)>, part: &str| {
            let problem = CameraPath::new(keys).expect_err("refused");
            assert!(problem.contains(part), "{problem}");
        };
        refused(vec![], "one or more");
        refused(vec![(0.0, a.clone()), (0.0, a.clone())], "number 1 is at 0 s, after 0 s; times must increase");
        refused(vec![(0.0, a.clone()), (-1.0, a.clone())], "number 1 is at -1 s");
        refused(vec![(f64::NAN, a.clone())], "number 0 is at NaN s");
        refused(vec![(0.0, a.clone()), (1.0, Camera { width: 65, ..a.clone() })], "number 1 has 65 x 48 px");
        let long = path(&[(0.0, a.clone()), (1e9, a)]);
        for per_second in [0.0, -1.0, f64::NAN, 30.0] {
            assert!(long.frames(per_second).expect_err("refused").contains("at most 1000000 frames"));
        }
    }
}
