//! Extracts an object from a model: writes the object, and the scene without it.
//!
//! ```sh
//! cargo run --release --example extract -- MODEL LABEL OBJECT.ply REST.ply
//! ```

use labelgs::edit::{MIN_LABEL_CONFIDENCE, extract, remove, summarise};
use labelgs::formats::{read_model, write_model};

fn main() -> labelgs::Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [model, label, object_out, rest_out] = &arguments[..] else {
        return Err(labelgs::Error::usage("arguments", "expected: MODEL LABEL OBJECT.ply REST.ply"));
    };
    let label = label.parse().map_err(|error| labelgs::Error::usage("LABEL", format!("{error}")))?;
    let model = read_model(model)?.gaussians;
    for row in summarise(&model) {
        println!("label {:>5}: {:>7} Gaussians around {:.2?}", row.label, row.count, row.centre);
    }
    // Gaussians that straddle the object's contour would stick out of the isolated object.
    let object = extract(&model, &[label], MIN_LABEL_CONFIDENCE)?;
    let rest = remove(&model, &[label])?;
    println!("{} Gaussians of the object, {} of the rest", object.len(), rest.len());
    write_model(object_out, &object)?;
    write_model(rest_out, &rest)?;
    Ok(())
}
