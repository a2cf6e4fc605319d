//! Trains a labelled model and prints its scores.
//!
//! ```sh
//! cargo run --release --example train -- SCENE MASKS OUT [ITERATIONS]
//! ```

use labelgs::gpu::{Gpu, GpuOptions};
use labelgs::run::{self, Request, Settings, Start};

fn main() -> labelgs::Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [scene, masks, out, rest @ ..] = &arguments[..] else {
        return Err(labelgs::Error::usage("arguments", "expected: SCENE MASKS OUT [ITERATIONS]"));
    };
    let mut settings = Settings::default();
    if let Some(iterations) = rest.first() {
        settings.train.iterations =
            iterations.parse().map_err(|error| labelgs::Error::usage("ITERATIONS", format!("{error}")))?;
    }
    let mut request = Request::new(scene, out);
    request.start = Start::New(settings);
    request.inputs.masks = Some(masks.into());

    // A closure opens the device, because a run can reopen it after a loss. `()` observes nothing.
    let summary = run::train(&request, &|| Gpu::new(&GpuOptions::default()), &mut ())?;
    println!("{} Gaussians in {}", summary.gaussians, summary.model.display());
    if let Some(psnr) = summary.scores.and_then(|scores| scores.mean.psnr) {
        println!("PSNR {psnr:.2} dB over the held-out views");
    }
    Ok(())
}
