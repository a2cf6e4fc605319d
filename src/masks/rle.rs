//! COCO run lengths: alternating numbers of pixels outside and inside, down the columns.
//!
//! `counts` is a list, or a text of bytes from `0` on with 6 bits each: 5 bits of the number, lowest first, and a bit
//! that says that more follow. From the fourth number on, a number is the difference from the one two before.

use super::spans::{Spans, cell_of, first_beyond};
use serde_json::Value;

/// The pixels of an object in an image.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Rle {
    /// Width and height, px.
    pub(super) size: (u32, u32),
    /// Runs of pixels inside, column-major.
    runs: Vec<(u64, u64)>,
}

/// The expected form of such a segmentation, for messages.
pub(super) const EXPECTED_FORM: &str = r#"expected {"size": [height, width], "counts": a text or a list of numbers}"#;

impl Rle {
    /// Reads the object of a JSON file. The error describes what is wrong.
    pub(super) fn read(value: &Value) -> Result<Self, String> {
        let side = |at: usize| {
            let side = value.get("size").and_then(|size| size.get(at)).and_then(Value::as_u64);
            side.and_then(|side| u32::try_from(side).ok()).filter(|&side| side > 0)
        };
        let (Some(height), Some(width)) = (side(0), side(1)) else {
            return Err(format!("has no `size` with two numbers above 0; {EXPECTED_FORM}"));
        };
        let counts = match value.get("counts") {
            Some(Value::String(text)) => parse_text(text)?,
            Some(Value::Array(list)) => parse_list(list)?,
            _ => return Err(format!("has no `counts`; {EXPECTED_FORM}")),
        };
        let pixels = u64::from(width) * u64::from(height);
        let (mut runs, mut at) = (Vec::new(), 0_u64);
        for (index, &count) in counts.iter().enumerate() {
            let end = at.saturating_add(count);
            if end > pixels {
                break;
            }
            if index % 2 == 1 && count > 0 {
                runs.push((at, end));
            }
            at = end;
        }
        let sum = counts.iter().fold(0_u64, |sum, &count| sum.saturating_add(count));
        if sum != pixels {
            let problem = "the file is truncated or belongs to another image; export it again";
            return Err(format!("the run lengths add up to {sum}, but {width} x {height} px are {pixels}: {problem}"));
        }
        Ok(Self { size: (width, height), runs })
    }

    /// Returns the pixels in an image of another size: those whose centre is inside.
    pub(super) fn spans(&self, (width, height): (u32, u32)) -> Spans {
        let own = u64::from(self.size.1);
        let mut inside = vec![false; width as usize * height as usize];
        for x in 0..width {
            let column = cell_of(x, width, self.size.0) * own;
            let first = self.runs.partition_point(|&(_, end)| end <= column);
            for &(start, end) in self.runs[first..].iter().take_while(|(start, _)| *start < column + own) {
                let (start, end) = (start.max(column) - column, end.min(column + own) - column);
                let rows = first_beyond(start, self.size.1, height)..first_beyond(end, self.size.1, height);
                rows.for_each(|y| inside[y * width as usize + x as usize] = true);
            }
        }
        Spans::from_mask(&inside)
    }
}

fn parse_list(list: &[Value]) -> Result<Vec<u64>, String> {
    let number =
        |value: &Value| value.as_u64().ok_or_else(|| format!("`counts` has {value}; expected a number of pixels"));
    list.iter().map(number).collect()
}

fn parse_text(text: &str) -> Result<Vec<u64>, String> {
    let mut counts: Vec<i64> = Vec::new();
    let (mut number, mut bits) = (0_i64, 0);
    for (at, byte) in text.bytes().enumerate() {
        let wrong =
            |problem: &str| Err(format!("`counts` is wrong at character {}: {problem}; export it again", at + 1));
        let Some(six) = byte.checked_sub(b'0').filter(|six| *six < 64) else {
            return wrong("expected characters from `0` to `o`");
        };
        // An image has fewer than 2^32 pixels, and differences are signed.
        if bits > 30 {
            return wrong("a number has more than 35 bits");
        }
        number |= i64::from(six & 31) << bits;
        bits += 5;
        if six & 32 != 0 {
            continue;
        }
        if six & 16 != 0 {
            number |= -1 << bits;
        }
        if let [.., before, _] = counts[..]
            && counts.len() > 2
        {
            number += before;
        }
        if number < 0 {
            return wrong("a run has a negative length");
        }
        counts.push(number);
        (number, bits) = (0, 0);
    }
    if bits > 0 {
        return Err("`counts` ends in the middle of a number; export it again".to_owned());
    }
    Ok(counts.into_iter().map(|count| count as u64).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn inside(value: &Value, size: (u32, u32)) -> Vec<u8> {
        let mut pixels = vec![0; (size.0 * size.1) as usize];
        let spans = Rle::read(value).expect("run lengths").spans(size);
        spans.runs().for_each(|run| pixels[run].fill(1));
        pixels
    }

    /// Texts that pycocotools wrote.
    #[test]
    fn texts_and_lists_of_other_programs_are_read() {
        let list = json!({"size": [2, 3], "counts": [1, 2, 3]});
        let expected = [0, 1, 0, 1, 0, 0];
        assert_eq!(inside(&list, (3, 2)), expected);
        assert_eq!(inside(&json!({"size": [2, 3], "counts": "123"}), (3, 2)), expected);
        // Differences, also negative ones, and a number of two bytes: 0 40 7 30 3 20.
        let list = json!({"size": [10, 10], "counts": [0, 40, 7, 30, 3, 20]});
        let text = json!({"size": [10, 10], "counts": "0X17FLF"});
        assert_eq!(inside(&list, (10, 10)), inside(&text, (10, 10)));
    }

    #[test]
    fn another_size_takes_the_id_at_the_centre() {
        let value = json!({"size": [2, 2], "counts": [2, 2]});
        assert_eq!(inside(&value, (4, 4)), [[0, 0, 1, 1]; 4].concat());
        assert_eq!(inside(&json!({"size": [4, 4], "counts": [8, 8]}), (2, 2)), [0, 1, 0, 1]);
    }

    #[test]
    fn wrong_run_lengths_are_told() {
        let message = |value: Value| Rle::read(&value).expect_err("refused");
        for (value, expected) in [
            (json!({"counts": [4]}), "no `size`"),
            (json!({"size": [0, 2], "counts": [4]}), "no `size`"),
            (json!({"size": [2, 2]}), "no `counts`"),
            (json!({"size": [2, 2], "counts": [3]}), "add up to 3, but 2 x 2 px are 4"),
            (json!({"size": [2, 2], "counts": [1, u64::MAX]}), "add up to"),
            (json!({"size": [2, 2], "counts": [-1, 5]}), "`counts` has -1"),
            (json!({"size": [2, 2], "counts": "é"}), "character 1: expected characters"),
            (json!({"size": [2, 2], "counts": "4P"}), "ends in the middle of a number"),
            (json!({"size": [2, 2], "counts": "OOO"}), "negative length"),
            (json!({"size": [2, 2], "counts": "oooooooooooooo"}), "35 bits"),
        ] {
            assert!(message(value.clone()).contains(expected), "{expected}: {}", message(value));
        }
    }
}
