//! The results of the paper, for comparison. They are quoted, not reproduced: its data sets differ.

/// Data sets of the paper's tables.
const PAPER_DATA_SETS: [&str; 4] = ["3D-OVS", "LLFF", "LERF", "Mip-NeRF360"];

/// A row: name, and mIoU with PSNR (dB) of the objects for each data set.
type Row = (&'static str, [Option<(f64, f64)>; 4]);

/// The paper's ablation (LabelGS, table of components).
const PAPER_ROWS: [Row; 4] = [
    ("LabelGS", [Some((0.925, 34.26)), Some((0.851, 28.02)), Some((0.75, 32.47)), Some((0.75, 32.42))]),
    ("without DOV", [Some((0.922, 33.99)), None, None, None]),
    ("without GPF", [Some((0.926, 34.09)), Some((0.848, 27.97)), Some((0.82, 33.30)), Some((0.76, 32.73))]),
    ("without OAM", [Some((0.928, 34.19)), Some((0.844, 28.01)), Some((0.80, 32.92)), Some((0.79, 32.47))]),
];

/// Returns the results as text.
pub(super) fn table() -> String {
    let mut text = "\nfrom the LabelGS paper, on other scenes: mIoU / PSNR of the objects\n".to_owned();
    text += &format!("{:>24}", "");
    PAPER_DATA_SETS.iter().for_each(|set| text += &format!(" {set:>14}"));
    for (name, cells) in PAPER_ROWS {
        text += &format!("\n{name:>24}");
        for cell in cells {
            let cell = cell.map_or("-".to_owned(), |(iou, psnr)| format!("{iou:.3} / {psnr:.2}"));
            text += &format!(" {cell:>14}");
        }
    }
    text + "\n"
}
