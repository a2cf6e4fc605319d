//! Model formats by file extension, and a format that a program adds.

use super::fixtures::*;
use labelgs::internals::cli::context::open_model;
use labelgs::io::{Export, ModelFormat, ModelWriter, ReadModel, read_model, register, write_model};
use labelgs::scene::Gaussians;
use labelgs::{Error, Result};
use std::io::{self, Write};
use std::path::Path;

/// A Gaussian of SH degree 0 a line: place, size, colour, opacity; all are round.
const BALLS: ModelFormat = ModelFormat {
    name: "balls",
    endings: &[".balls", ".balls.txt"],
    read: read_balls,
    write: Some(ModelWriter { losses: |_| Ok(Vec::new()), write, checksum: None }),
};

fn read_balls(path: &Path) -> Result<ReadModel> {
    let mut read = ReadModel::default();
    for (line, text) in labelgs::internals::io::read::text(path)?.lines().enumerate() {
        let row: Vec<f32> = text.split(' ').map_while(|word| word.parse().ok()).collect();
        let &[x, y, z, size, r, g, b, opacity] = row.as_slice() else {
            return Err(Error::data(path, format!("line {}", line + 1), "is no row of 8 numbers"));
        };
        let to = &mut read.gaussians;
        to.means.push([x, y, z]);
        to.scales.push([size; 3]);
        to.sh0.push([r, g, b]);
        to.opacities.push(opacity);
        to.quats.push([1.0, 0.0, 0.0, 0.0]);
    }
    Ok(read)
}

fn write(export: &Export, out: &mut dyn Write) -> io::Result<()> {
    let model = export.model;
    export.rows.iter().try_for_each(|&row| {
        let ([x, y, z], size, [r, g, b]) = (model.means[row], model.scales[row][0], model.sh0[row]);
        writeln!(out, "{x} {y} {z} {size} {r} {g} {b} {}", model.opacities[row])
    })
}

fn balls() -> Gaussians {
    Gaussians {
        means: vec![[1.0, 2.0, 3.0], [-4.0, 5.5, 6.0]],
        quats: vec![[1.0, 0.0, 0.0, 0.0]; 2],
        scales: vec![[-2.0; 3], [-3.0; 3]],
        opacities: vec![0.5, 2.0],
        sh0: vec![[0.25, 0.5, 0.75], [0.125, 1.0, -1.0]],
        ..Gaussians::default()
    }
}

#[test]
fn a_format_that_is_added_is_read_and_written_by_its_endings() {
    static FORMAT: ModelFormat = BALLS;
    register(&FORMAT);
    let scene = Scene::new();
    let mut model = balls();
    for name in ["a.balls", "b.BALLS", "c.balls.txt"] {
        assert_eq!(write_model(scene.at(name), &model).expect("written"), 0);
        assert_eq!(std::fs::read(scene.at(name)).expect("bytes")[..9], *b"1 2 3 -2 ", "{name}");
        assert_eq!(read_model(scene.at(name)).expect("read").gaussians, model);
        assert_eq!(open_model(&scene.at(name)).expect("read"), model, "as commands read it");
    }
    model.opacities[0] = f32::NAN;
    assert_eq!(write_model(scene.at("a.balls"), &model).expect("written"), 1);
    assert_eq!(read_model(scene.at("a.balls")).expect("read").gaussians.means, model.means[1..]);
    let refused = refusal(read_model(scene.write("a.balls", "1 2 3\n")));
    assert!(refused.ends_with("a.balls: line 1: is no row of 8 numbers"), "{refused}");
    // The other formats are unchanged, apart from one more known extension in messages.
    write_model(scene.at("a.ply"), &balls()).expect("written");
    assert!(std::fs::read(scene.at("a.ply")).expect("bytes").starts_with(b"ply\n"));
    let refused = refusal(read_model(scene.write("a.cloud", "1 2 3\n")));
    assert!(refused.contains(".cloud is no extension of a model; .balls, .balls.txt, .ply"), "{refused}");
}

/// Nothing is written under a wrong extension, nor read under one. A file without an extension is known by its content.
#[test]
fn an_unknown_extension_is_refused() {
    let scene = Scene::new();
    write_model(scene.at("a.PLY"), &balls()).expect("written");
    let bytes = std::fs::read(scene.at("a.PLY")).expect("bytes");
    for name in ["a.obj", "a.ply.bak", "a.usdz", "a.gltf", "a.ksplat", "a"] {
        let error = write_model(scene.at(name), &balls()).expect_err("no format");
        assert_eq!(labelgs::internals::cli::status::exit_status(&error), 2, "{error}");
        let error = error.to_string();
        assert!(error.contains(".ply, .spz, .glb, .sog, .html") && !scene.path().join(name).exists(), "{error}");
        let read = read_model(scene.write(name, &bytes));
        if name == "a" {
            assert_eq!(read.expect("read by its content").gaussians, balls());
        } else {
            let refused = refusal(read);
            assert!(refused.contains("is no extension of a model") && refused.contains(".ply"), "{refused}");
        }
    }
    for format in ["spz", "glb", "sog"] {
        write_model(scene.at(&format!("b.{format}")), &balls()).expect("written");
        std::fs::rename(scene.at(&format!("b.{format}")), scene.at("b")).expect("renamed");
        assert_eq!(read_model(scene.at("b")).expect("read by its content").gaussians.len(), balls().len());
    }
    let refused = refusal(read_model(scene.write("video.mp4", b"\0\0\0\x20ftypisom\0\0\0\0")));
    assert!(refused.contains("is a video (MP4), not a model"), "{refused}");
    assert!(refusal(read_model(scene.write("c", "no model\n"))).contains("it has no extension"));
    assert!(refusal(read_model(scene.at("missing"))).contains("no such file"));
}

#[test]
fn columns_that_differ_in_length_are_refused() {
    let scene = Scene::new();
    let cut: [(&str, fn(&mut Gaussians)); 7] = [
        ("quats", |model| model.quats.truncate(1)),
        ("scales", |model| model.scales.push([0.0; 3])),
        ("opacities", |model| model.opacities.clear()),
        ("sh0", |model| model.sh0.truncate(1)),
        ("sh_rest", |model| model.sh_degree = 1),
        ("labels", |model| model.labels = Some(vec![1])),
        ("label_confidence", |model| model.label_confidence = Some(vec![1.0; 3])),
    ];
    assert!(balls().check().is_ok());
    for (name, cut) in cut {
        let mut model = balls();
        cut(&mut model);
        let error = write_model(scene.at("a.ply"), &model).expect_err("columns that differ").to_string();
        assert!(error.contains(name) && error.contains("of 2 Gaussians"), "{error}");
        assert!(!scene.path().join("a.ply").exists());
    }
}
