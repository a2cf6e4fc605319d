//! Solid shapes centred at the origin, and ray intersection. Lengths are world units.

use glam::DVec3;

/// A solid, centred at the origin of its frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shape {
    /// Ellipsoid: radii.
    Ball(DVec3),
    /// Box: half sizes.
    Block(DVec3),
    /// Rounded box: half sizes and added radius. With a single non-zero half size it is a capsule.
    RoundBlock(DVec3, f64),
    /// Upright cylinder: radius, half height.
    Cylinder(f64, f64),
    /// Lying torus: radius of the ring, radius of its tube.
    Ring(f64, f64),
    /// Upright bars along x with two rails: number of bars, pitch, half height, radius of bars and rails.
    Fence(u32, f64, f64, f64),
    /// Open box: outer half sizes, thickness of floor and walls.
    Bin(DVec3, f64),
}

/// The point at which a ray enters a shape.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Entry {
    /// Distance along the ray.
    pub distance: f64,
    /// Outward unit normal.
    pub normal: DVec3,
}

impl Shape {
    /// Returns the radius of a sphere around the origin that contains the shape.
    pub fn bound(&self) -> f64 {
        match *self {
            Self::Ball(radii) => radii.max_element(),
            Self::Block(half) => half.length(),
            Self::RoundBlock(half, radius) => half.length() + radius,
            Self::Cylinder(radius, half) => radius.hypot(half),
            Self::Ring(ring, tube) => ring + tube,
            Self::Fence(bars, pitch, half, radius) => (f64::from(bars) * pitch / 2.0).hypot(half) + radius,
            Self::Bin(half, _) => half.length(),
        }
    }

    /// Returns the distance of a position to the surface, negative inside. For an ellipsoid it is exact to first order
    /// near the surface; inside a fence or bin it is the distance to the nearest part.
    pub fn distance_to(&self, place: DVec3) -> f64 {
        let nearest = |parts: &[Part]| {
            let all = parts.iter().map(|(shape, at)| shape.distance_to(place - at));
            all.fold(f64::INFINITY, f64::min)
        };
        match *self {
            Self::Ball(radii) => {
                let (length, slope) = ((place / radii).length(), (place / (radii * radii)).length());
                if slope > 0.0 { length * (length - 1.0) / slope } else { -radii.min_element() }
            }
            Self::Block(half) => outside_block(place, half),
            Self::RoundBlock(half, radius) => outside_block(place, half) - radius,
            Self::Cylinder(radius, half) => {
                let (across, along) = (place.truncate().length() - radius, place.z.abs() - half);
                across.max(0.0).hypot(along.max(0.0)) + across.max(along).min(0.0)
            }
            Self::Ring(ring, tube) => outside_ring(place, ring, tube),
            Self::Fence(bars, pitch, half, radius) => nearest(&fence_parts(bars, pitch, half, radius)),
            Self::Bin(half, wall) => nearest(&bin_parts(half, wall)),
        }
    }

    /// Returns the first entry of the ray from `origin` (outside the shape) along the unit vector `direction`.
    pub fn enter(&self, origin: DVec3, direction: DVec3) -> Option<Entry> {
        let (near, far) = sphere_span(origin, direction, self.bound() * 1.0001)?;
        if far <= 0.0 {
            return None;
        }
        match *self {
            Self::Ball(radii) => enter_ball(origin, direction, radii),
            Self::Block(half) => enter_block(origin, direction, half),
            Self::Cylinder(radius, half) => enter_cylinder(origin, direction, radius, half),
            Self::RoundBlock(half, radius) => {
                march(|place| outside_block(place, half) - radius, origin, direction, near.max(0.0), far)
            }
            Self::Ring(ring, tube) => {
                march(|place| outside_ring(place, ring, tube), origin, direction, near.max(0.0), far)
            }
            Self::Fence(bars, pitch, half, radius) => {
                enter_parts(&fence_parts(bars, pitch, half, radius), origin, direction)
            }
            Self::Bin(half, wall) => enter_parts(&bin_parts(half, wall), origin, direction),
        }
    }
}

/// Returns the distance of a position to a box of these half sizes.
fn outside_block(place: DVec3, half: DVec3) -> f64 {
    let over = place.abs() - half;
    over.max(DVec3::ZERO).length() + over.max_element().min(0.0)
}

/// Returns the distance of a position to a torus.
fn outside_ring(place: DVec3, ring: f64, tube: f64) -> f64 {
    (place.truncate().length() - ring).hypot(place.z) - tube
}

/// A simple shape and its centre in the frame of the compound shape.
type Part = (Shape, DVec3);

fn fence_parts(bars: u32, pitch: f64, half: f64, radius: f64) -> Vec<Part> {
    let first = -0.5 * pitch * (f64::from(bars) - 1.0);
    let bar = |index: u32| (Shape::Cylinder(radius, half), DVec3::X * (first + pitch * f64::from(index)));
    let rail = |height: f64| (Shape::RoundBlock(DVec3::X * -first, radius), DVec3::Z * height);
    (0..bars).map(bar).chain([rail(0.5 * half), rail(-0.5 * half)]).collect()
}

/// Returns a floor and four walls that meet without overlap.
fn bin_parts(half: DVec3, wall: f64) -> [Part; 5] {
    let thin = wall / 2.0;
    let inner = half.y - wall;
    let side = |x: f64| (Shape::Block(DVec3::new(thin, half.y, half.z)), DVec3::X * x);
    let end = |y: f64| (Shape::Block(DVec3::new(half.x - wall, thin, half.z)), DVec3::Y * y);
    let floor = (Shape::Block(DVec3::new(half.x - wall, inner, thin)), DVec3::Z * (thin - half.z));
    [floor, side(half.x - thin), side(thin - half.x), end(half.y - thin), end(thin - half.y)]
}

fn enter_parts(parts: &[Part], origin: DVec3, direction: DVec3) -> Option<Entry> {
    let entries = parts.iter().filter_map(|(shape, at)| shape.enter(origin - at, direction));
    entries.min_by(|a, b| a.distance.total_cmp(&b.distance))
}

/// Returns the distances at which a ray enters and leaves a sphere around the origin.
fn sphere_span(origin: DVec3, direction: DVec3, radius: f64) -> Option<(f64, f64)> {
    let b = origin.dot(direction);
    let discriminant = b * b - origin.length_squared() + radius * radius;
    if discriminant < 0.0 {
        return None;
    }
    let root = discriminant.sqrt();
    Some((-b - root, -b + root))
}

fn enter_ball(origin: DVec3, direction: DVec3, radii: DVec3) -> Option<Entry> {
    // In the frame where the ellipsoid is a unit sphere, the direction is not a unit vector.
    let (o, d) = (origin / radii, direction / radii);
    let length = d.length();
    let (near, _) = sphere_span(o, d / length, 1.0)?;
    let distance = near / length;
    (distance > 0.0)
        .then(|| Entry { distance, normal: ((origin + direction * distance) / (radii * radii)).normalize() })
}

fn enter_block(origin: DVec3, direction: DVec3, half: DVec3) -> Option<Entry> {
    let inverse = direction.recip();
    let (a, b) = ((-half - origin) * inverse, (half - origin) * inverse);
    let (low, high) = (a.min(b), a.max(b));
    let (distance, leave) = (low.max_element(), high.min_element());
    if distance > leave || distance <= 0.0 {
        return None;
    }
    let axis = low.max_position();
    let mut normal = DVec3::ZERO;
    normal[axis] = -direction[axis].signum();
    Some(Entry { distance, normal })
}

fn enter_cylinder(origin: DVec3, direction: DVec3, radius: f64, half: f64) -> Option<Entry> {
    let (o, d) = (origin.truncate(), direction.truncate());
    let a = d.length_squared();
    if a > 1e-18 {
        let (b, c) = (o.dot(d) / a, (o.length_squared() - radius * radius) / a);
        let discriminant = b * b - c;
        if discriminant < 0.0 {
            return None;
        }
        let distance = -b - discriminant.sqrt();
        let at = origin + direction * distance;
        if distance > 0.0 && at.z.abs() <= half {
            return Some(Entry { distance, normal: (at.truncate() / radius).extend(0.0) });
        }
    }
    let distance = (-half * direction.z.signum() - origin.z) / direction.z;
    let at = origin + direction * distance;
    (distance > 0.0 && at.truncate().length_squared() <= radius * radius)
        .then(|| Entry { distance, normal: DVec3::new(0.0, 0.0, -direction.z.signum()) })
}

/// Traces a ray between two distances with an exact signed distance.
fn march(distance_to: impl Fn(DVec3) -> f64, origin: DVec3, direction: DVec3, near: f64, far: f64) -> Option<Entry> {
    const HIT_DISTANCE: f64 = 1e-7;
    let mut distance = near;
    for _ in 0..200 {
        let gap = distance_to(origin + direction * distance);
        if gap < HIT_DISTANCE {
            let at = origin + direction * distance;
            let slope = |axis: DVec3| distance_to(at + axis * 1e-5) - distance_to(at - axis * 1e-5);
            let normal = DVec3::new(slope(DVec3::X), slope(DVec3::Y), slope(DVec3::Z)).normalize();
            return Some(Entry { distance, normal });
        }
        distance += gap;
        if distance > far {
            return None;
        }
    }
    None
}
