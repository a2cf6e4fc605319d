//! Watches a training: prints its progress, renders the scene in between, and stops it early.
//!
//! ```sh
//! cargo run --release --example watch -- SCENE OUT STEPS
//! ```

use labelgs::gpu::{Gpu, GpuOptions};
use labelgs::render::{Format, Parts, write_rgb};
use labelgs::run::{self, Event, Flow, LiveScene, Observer, Request};
use labelgs::scene::Camera;
use std::path::PathBuf;

struct Watcher {
    camera: Camera,
    folder: PathBuf,
    stop_after: u32,
}

impl Observer for Watcher {
    fn observe(&mut self, event: &Event, live: &mut LiveScene) -> labelgs::Result<Flow> {
        if let Event::Step { step, report: Some(report), .. } = event {
            if step % 10 == 0 {
                println!("step {step}: loss {:.4}, {} Gaussians", report.loss, live.gaussian_count());
            }
            if *step == self.stop_after {
                let rendered = live.render(&self.camera, Parts::COLOUR)?;
                let file = self.folder.join(format!("step_{step}.png"));
                write_rgb(&file, (rendered.width, rendered.height), &rendered.rgb, Format::Png)?;
                // The model and a checkpoint are written before the run ends.
                return Ok(Flow::Stop);
            }
        }
        Ok(Flow::Continue)
    }
}

fn main() -> labelgs::Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [scene, out, steps] = &arguments[..] else {
        return Err(labelgs::Error::usage("arguments", "expected: SCENE OUT STEPS"));
    };
    let stop_after = steps.parse().map_err(|error| labelgs::Error::usage("STEPS", format!("{error}")))?;
    let views = labelgs::scenes::open(scene.as_ref(), &labelgs::scenes::LoadOptions::default())?;
    let mut watcher = Watcher { camera: views.train[0].camera.clone(), folder: out.into(), stop_after };
    let summary = run::train(&Request::new(scene, out), &|| Gpu::new(&GpuOptions::default()), &mut watcher)?;
    println!("stopped: {}, {} Gaussians in {}", summary.stopped, summary.gaussians, summary.model.display());
    Ok(())
}
