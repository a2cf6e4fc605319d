//! How far a program is, from a line that it prints.

/// Returns k of a line of COLMAP with `[k/n]`: photos whose features are found, or whose pairs are looked for.
pub(super) fn item(line: &str) -> Option<usize> {
    counts(line)?.first().map(|&(at, _)| at)
}

/// Returns how many of `pairs` are compared when COLMAP begins the block `[i/n, j/n]` of them.
pub(super) fn pairs(line: &str, pairs: usize) -> Option<usize> {
    let counts = counts(line)?;
    let [(row, rows), (column, columns)] = counts[..] else { return None };
    let done = row.checked_sub(1)? * columns + column.checked_sub(1)?;
    Some(pairs * done / (rows * columns).max(1))
}

/// Returns the number of photos that have a pose when COLMAP adds one: `Registering image #7 (18)`, or `(name=18)`.
pub(super) fn placed(line: &str) -> Option<usize> {
    let (_, count) = line.split_once("Registering")?.1.rsplit_once('(')?;
    count.split_once(')')?.0.rsplit('=').next()?.parse().ok()
}

/// Returns the number of frames that ffmpeg has written.
pub(super) fn frame(line: &str) -> Option<usize> {
    line.strip_prefix("frame=")?.trim().parse().ok()
}

/// The counts in the first brackets of a line.
fn counts(line: &str) -> Option<Vec<(usize, usize)>> {
    let inside = line.split_once('[')?.1.split_once(']')?.0;
    let count = |text: &str| {
        let (at, of) = text.trim().split_once('/')?;
        Some((at.parse().ok()?, of.parse().ok()?))
    };
    inside.split(',').map(count).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_of_all_versions_tell_how_far_the_work_is() {
        assert_eq!(item("Processed file [12/40]"), Some(12));
        assert_eq!(item("I20250619 20:05:59.566437 14324 feature_extraction.cc:258] Processed file [2/24]"), Some(2));
        assert_eq!(item("Matching image [7/300] in 0.1s"), Some(7));
        assert_eq!(item("  Features:        7045"), None);
        assert_eq!(item("Elapsed time: 0.040 [minutes]"), None);
        assert_eq!(pairs("Matching block [1/2, 1/2]", 100), Some(0));
        assert_eq!(pairs("I0425 18:00:26.533618 2 pairing.cc:234] Processing block [2/2, 1/2]", 100), Some(50));
        assert_eq!(pairs("Processed file [2/24]", 100), None);
        assert_eq!(placed("Registering image #81 (18)"), Some(18));
        assert_eq!(placed("I0412 pipeline.cc:390] Registering frame #537 (num_reg_frames=702)"), Some(702));
        assert_eq!(placed("=> Image sees 159 / 175 points"), None);
        assert_eq!(frame("frame=31"), Some(31));
        assert_eq!(frame("fps=4.0"), None);
    }
}
