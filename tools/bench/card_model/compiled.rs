//! Instructions of the kernels, from a compiler for cards.
//!
//! The totals are those of `tests/golden/kernels`, which the tests keep equal to what Mesa's compiler for AMD's Navi 21
//! makes of every kernel for subgroups of 32. How many of them are in loops was counted in its disassembly: the
//! instructions from the target of a backward branch to that branch. If a kernel's total has changed since, its
//! straight part and its loops are scaled by the same factor. No compiler of NVIDIA's was at hand; its instructions are
//! assumed to be as many.

use labelgs::{Error, Result};
use std::collections::HashMap;
use std::path::Path;

const TABLE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/golden/kernels/navi21.txt");

/// Instructions of a loop's body without the loops inside of it; and how many are special functions.
type Body = (f64, f64);

/// Name of a kernel; its instructions and special functions when the loops were counted; its loops, as in the text.
type Counted = (&'static str, (f64, f64), &'static [Body]);

const COUNTED: &[Counted] = &[
    ("adam", (117.0, 8.0), &[]),
    ("blend_backward", (717.0, 18.0), &[(86.0, 0.0), (348.0, 16.0)]),
    ("blend_backward_labels", (1183.0, 18.0), &[(86.0, 0.0), (348.0, 16.0)]),
    ("blend_forward", (542.0, 10.0), &[(51.0, 0.0), (200.0, 8.0)]),
    ("blend_forward_labels", (1813.0, 10.0), &[(51.0, 0.0), (200.0, 8.0)]),
    ("cull", (146.0, 6.0), &[]),
    ("emit_instances", (191.0, 2.0), &[(95.0, 2.0)]),
    ("emit_instances_labels", (215.0, 2.0), &[(104.0, 2.0)]),
    ("gather", (130.0, 1.0), &[(40.0, 0.0)]),
    ("gather_labels", (144.0, 1.0), &[(42.0, 0.0)]),
    ("loss_reduce", (43.0, 0.0), &[(16.0, 0.0)]),
    ("loss_reduce_labels", (68.0, 0.0), &[(16.0, 0.0), (15.0, 0.0)]),
    ("project_backward", (827.0, 11.0), &[]),
    ("project_forward", (529.0, 14.0), &[(76.0, 2.0)]),
    ("project_forward_labels", (541.0, 14.0), &[(76.0, 2.0)]),
    ("radix_count", (90.0, 0.0), &[(19.0, 0.0)]),
    ("radix_scan", (62.0, 0.0), &[(16.0, 0.0), (21.0, 0.0)]),
    ("radix_scatter", (88.0, 0.0), &[(28.0, 0.0)]),
    ("scan_apply", (42.0, 0.0), &[(19.0, 0.0)]),
    ("scan_apply_flag", (43.0, 0.0), &[(20.0, 0.0)]),
    ("scan_reduce", (41.0, 0.0), &[(15.0, 0.0)]),
    ("scan_reduce_flag", (42.0, 0.0), &[(16.0, 0.0)]),
    ("scan_spine", (98.0, 0.0), &[(17.0, 0.0), (18.0, 0.0)]),
    ("ssim_rows", (975.0, 24.0), &[]),
    ("tile_ranges", (104.0, 0.0), &[(17.0, 0.0), (17.0, 0.0)]),
    ("tile_ranges_labels", (110.0, 0.0), &[(17.0, 0.0), (17.0, 0.0)]),
];

/// Instructions of a kernel.
#[derive(Clone, Debug)]
pub struct Code {
    /// Outside of loops: instructions, special functions.
    pub straight: Body,
    /// In each loop.
    pub loops: Vec<Body>,
}

/// Instructions of all kernels.
pub struct Compiler {
    /// The table's first line: driver and version.
    pub name: String,
    totals: HashMap<String, f64>,
}

impl Compiler {
    /// Reads the table.
    pub fn read() -> Result<Self> {
        let bad = |what: &str| Error::Check(format!("{TABLE}: {what}"));
        let text = std::fs::read_to_string(Path::new(TABLE)).map_err(|error| bad(&error.to_string()))?;
        let mut lines = text.lines();
        let name = lines.next().unwrap_or_default().to_owned();
        // One name has two words.
        let head = lines.next().unwrap_or_default().replace("shared B", "shared");
        let head: Vec<&str> = head.split_whitespace().collect();
        let column = |wanted: &str| head.iter().position(|word| *word == wanted).ok_or_else(|| bad("no such column"));
        let (size, count) = (column("subgroup")?, column("instructions")?);
        let mut totals = HashMap::new();
        for line in lines {
            let words: Vec<&str> = line.split_whitespace().collect();
            if words.get(size) == Some(&"32") {
                let total = words.get(count).and_then(|word| word.parse().ok()).ok_or_else(|| bad(line))?;
                totals.insert(words[0].to_owned(), total);
            }
        }
        Ok(Self { name, totals })
    }

    /// Instructions of a kernel, by the name of the variant.
    pub fn code(&self, kernel: &str) -> Result<Code> {
        let total = *self.totals.get(kernel).ok_or_else(|| Error::Check(format!("{TABLE}: {kernel} is missing")))?;
        let Some((_, (counted, specials), loops)) = COUNTED.iter().find(|(name, ..)| *name == kernel) else {
            return Ok(Code { straight: (total, 0.0), loops: Vec::new() });
        };
        let scale = total / counted;
        let inside = loops.iter().fold((0.0, 0.0), |sum, body| (sum.0 + body.0, sum.1 + body.1));
        let straight = ((counted - inside.0) * scale, specials - inside.1);
        Ok(Code { straight, loops: loops.iter().map(|body| (body.0 * scale, body.1)).collect() })
    }
}
