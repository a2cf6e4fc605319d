//! Model formats by file extension.

use super::fixtures::*;
use labelgs_formats::{read_model, write_model};
use labelgs_scene::Gaussians;

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

/// Nothing is written under a wrong extension, nor read under one. A file without an extension is known by its content.
#[test]
fn an_unknown_extension_is_refused() {
    let scene = Scene::new();
    write_model(scene.at("a.PLY"), &balls()).expect("written");
    let bytes = std::fs::read(scene.at("a.PLY")).expect("bytes");
    for name in ["a.obj", "a.ply.bak", "a.usdc", "a.gltf", "a.ksplat", "a"] {
        let error = write_model(scene.at(name), &balls()).expect_err("no format");
        assert!(matches!(error, labelgs_scene::Error::Usage { .. }), "{error}");
        let error = error.to_string();
        assert!(
            error.contains(".ply, .spz, .glb, .sog, .html, .usda, .usd, .usdz") && !scene.path().join(name).exists(),
            "{error}"
        );
        let read = read_model(scene.write(name, &bytes));
        if name == "a" {
            assert_eq!(read.expect("read by its content").gaussians, balls());
        } else {
            let refused = refusal(read);
            assert!(refused.contains("is not a model extension") && refused.contains(".ply"), "{refused}");
        }
    }
    for format in ["spz", "glb", "sog", "usda"] {
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
