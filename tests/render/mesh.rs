//! Meshes of objects against the shapes that they are of.

use crate::support::device;
use glam::{DMat3, DQuat, DVec3};
use labelgs::formats::Mesh;
use labelgs::render::mesh::object_mesh;
use labelgs::scene::Gaussians;
use labelgs::scene::harmonics::sh0_of;
use labelgs::synth::{Preset, World};
use std::collections::BTreeMap;

/// Discs on the surface of an object of a made scene, as a training would end with in the best case.
fn discs(world: &World, index: usize, count: u32) -> Gaussians {
    let object = &world.objects[index];
    let bound = object.shape.bound();
    // Enough to cover a ball of this radius several times.
    let size = (2.4 * bound / f64::from(count).sqrt()) as f32;
    let mut g = Gaussians::default();
    for at in 0..3 * count {
        let spread = |factor: f64| (f64::from(at) * factor).fract() * 2.0 - 1.0;
        let (z, turn) = (spread(0.618_033_988_7), std::f64::consts::PI * spread(0.754_877_666_2));
        let from = DVec3::new(turn.cos(), turn.sin(), 0.0) * (1.0 - z * z).sqrt() + DVec3::Z * z;
        let origin = object.position + 3.0 * bound * from;
        let aim =
            object.position + bound * DVec3::new(spread(0.569_840_291), spread(0.438_447_187), spread(0.324_717_957));
        let Some(hit) = world.hit_object(index, origin, (aim - origin).normalize()) else { continue };
        let turn = DQuat::from_rotation_arc(DVec3::Z, hit.normal);
        g.means.push(hit.place.as_vec3().to_array());
        g.quats.push([turn.w, turn.x, turn.y, turn.z].map(|value| value as f32));
        g.scales.push([size.ln(), size.ln(), (0.05 * size).ln()]);
        g.opacities.push(4.0);
        g.sh0.push([0.2, 0.4, 0.8].map(sh0_of));
    }
    g
}

/// Edges that are not as often in one direction as in the other.
fn open_edges(mesh: &Mesh) -> usize {
    let mut edges: BTreeMap<(u32, u32), i32> = BTreeMap::new();
    for &[a, b, c] in &mesh.triangles {
        for (from, to) in [(a, b), (b, c), (c, a)] {
            *edges.entry((from.min(to), from.max(to))).or_default() += if from < to { 1 } else { -1 };
        }
    }
    edges.values().filter(|&&count| count != 0).count()
}

/// Six times the volume inside of a closed mesh.
fn volume(mesh: &Mesh) -> f64 {
    let corner = |at: u32| DVec3::from_array(mesh.positions[at as usize].map(f64::from));
    mesh.triangles.iter().map(|&[a, b, c]| DMat3::from_cols(corner(a), corner(b), corner(c)).determinant()).sum()
}

/// Mean distance of the corners from the true surface, in diagonals of the box of the mesh.
fn off(mesh: &Mesh, distance: impl Fn(DVec3) -> f64) -> f64 {
    let places: Vec<DVec3> = mesh.positions.iter().map(|at| DVec3::from_array(at.map(f64::from))).collect();
    let (low, high) = places.iter().fold((DVec3::MAX, DVec3::MIN), |(low, high), &at| (low.min(at), high.max(at)));
    let sum: f64 = places.iter().map(|&at| distance(mesh.origin + at).abs()).sum();
    sum / places.len() as f64 / (high - low).length()
}

#[test]
fn meshes_are_closed_and_near_the_true_surface() {
    let Some(device) = device() else { return };
    let world = World::new(Preset::Default, 0);
    for (index, object) in world.objects.iter().enumerate() {
        let mut model = discs(&world, index, 2500);
        // Far away too, where 32-bit positions need an origin.
        let far = if index % 2 == 0 { DVec3::ZERO } else { DVec3::new(4e5, 5e6, 100.0) };
        model.origin = far;
        let mesh = object_mesh(&device.gpu(), &model, 0, &[], 48).expect("a mesh");
        let off = off(&mesh, |place| object.distance_to(place - far));
        println!("{}: {} triangles, {:.3} % of the diagonal off", object.name, mesh.triangles.len(), 100.0 * off);
        assert!(mesh.triangles.len() > 1000 && open_edges(&mesh) == 0, "{}: {} edges", object.name, open_edges(&mesh));
        assert!(volume(&mesh) > 0.0, "{} is inside out", object.name);
        assert!(off < 0.01, "{} is {off} of its diagonal off", object.name);
        let colours = mesh.colours.iter().map(|colour| DVec3::from_array(colour.map(f64::from)));
        let mean = colours.sum::<DVec3>() / mesh.colours.len() as f64;
        assert!(mean.distance(DVec3::new(0.2, 0.4, 0.8)) < 0.02, "{}: {mean}", object.name);
    }
}

/// A shell that is open below is closed there, seen from above or from all sides.
#[test]
fn what_no_camera_saw_is_closed() {
    let Some(device) = device() else { return };
    let world = World::new(Preset::Default, 0);
    let index = world.objects.iter().position(|object| object.name == "crate").expect("the crate");
    let object = &world.objects[index];
    // Small discs reach little beyond the edge at which they end.
    let whole = discs(&world, index, 6000);
    let lowest = whole.means.iter().map(|mean| mean[2]).fold(f32::MAX, f32::min);
    let open = whole.filtered(|row| whole.means[row][2] > lowest + 0.01 * object.shape.bound() as f32);
    assert!(open.len() < whole.len() - 100, "{} of {}", open.len(), whole.len());
    let cameras: Vec<DVec3> = (0..24)
        .map(|at| {
            let (sin, cos) = (f64::from(at) * 0.8).sin_cos();
            object.position + DVec3::new(4.0 * cos, 4.0 * sin, 1.5 + f64::from(at % 3))
        })
        .collect();
    let mesh = object_mesh(&device.gpu(), &open, 0, &cameras, 48).expect("a mesh");
    let closed = object_mesh(&device.gpu(), &whole, 0, &[], 48).expect("a mesh");
    assert_eq!(open_edges(&mesh), 0);
    let bowl = object_mesh(&device.gpu(), &open, 0, &[], 48).expect("a mesh");
    let [above, around] = [&mesh, &bowl].map(|mesh| volume(mesh) / volume(&closed));
    println!("{above:.3} of the volume from above, {around:.3} from all sides");
    // Discs at the edge reach below it; pictures from below see into the shell, and those from above outnumber them.
    assert!((0.95..1.1).contains(&above) && around > 0.75, "{above} and {around} of the volume");
}
