//! Edits of an editor, one by one and replayed from a file.

use labelgs_edit::fill::Sight;
use labelgs_edit::{Document, Edit, EditsFile, Rows};
use labelgs_files::label_table::{LabelEntry, LabelTable};
use labelgs_scene::{Gaussians, Result};
use std::path::Path;

fn no_sights(_: &Gaussians) -> Result<Vec<Sight>> {
    panic!("nothing is filled")
}

/// Beads in a row that do not touch; labels 0 to 3 in turn.
fn model(count: usize) -> Gaussians {
    Gaussians {
        means: (0..count).map(|row| [row as f32, 0.0, 0.0]).collect(),
        quats: vec![[1.0, 0.0, 0.0, 0.0]; count],
        scales: vec![[-3.0; 3]; count],
        opacities: (0..count).map(|row| row as f32).collect(),
        sh0: (0..count).map(|row| [0.1 * row as f32; 3]).collect(),
        sh_rest: (0..count * 3).map(|row| [0.01 * row as f32; 3]).collect(),
        sh_degree: 1,
        labels: Some((0..count as u32).map(|row| row % 4).collect()),
        label_confidence: Some(vec![0.9; count]),
        ..Gaussians::default()
    }
}

fn document() -> Document {
    let entry = |id, name: &str| LabelEntry { name: Some(name.into()), ..LabelEntry::new(id) };
    Document { model: model(12), table: Some(LabelTable::new(vec![entry(1, "cup"), entry(2, "box"), entry(3, "mat")])) }
}

fn rows(count: usize, is_in: impl Fn(usize) -> bool) -> Rows {
    Rows::from_mask(&(0..count).map(is_in).collect::<Vec<_>>())
}

/// One edit of each kind, in an order that makes each possible.
fn edits() -> Vec<(Edit, &'static str)> {
    let first_six = rows(12, |row| row < 6);
    vec![
        (Edit::Rename { label: 1, name: "mug".into() }, "Renamed cup to mug"),
        (Edit::Recolour { labels: vec![1], colour: [1.0, 0.0, 0.5], mix: 0.7 }, "Recoloured mug"),
        (
            Edit::Assign { rows: first_six.clone(), label: None, name: Some("new".into()) },
            "New label of 6 Gaussians: new",
        ),
        (Edit::Assign { rows: rows(12, |row| row == 7), label: Some(4), name: None }, "Gave 1 Gaussian to new"),
        (
            Edit::Assign { rows: rows(12, |row| row == 0), label: Some(0), name: None },
            "Removed the label of 1 Gaussian",
        ),
        (Edit::Duplicate { rows: first_six, shift: [0.0, 100.0, 0.0], name: None }, "Duplicated 6 Gaussians"),
        (Edit::Split { label: 4 }, "Split new"),
        (Edit::Merge { labels: vec![1, 2] }, "Merged mug, box"),
        (Edit::Delete { rows: rows(18, |row| row == 17) }, "Deleted 1 Gaussian"),
        (Edit::Remove { labels: vec![3], fill: false }, "Removed mat"),
        (Edit::Keep { rows: rows(12, |row| row < 9) }, "Kept only 9 Gaussians"),
    ]
}

#[test]
fn changes_do_what_they_say() {
    let mut document = document();
    for (edit, words) in edits() {
        assert_eq!(document.told(&edit), words);
        let after = document.apply(&edit, &mut no_sights).unwrap_or_else(|error| panic!("{edit:?}: {error}"));
        after.model.check().expect("whole columns");
        assert_eq!(edit.changes_rows(), after.model.len() != document.model.len(), "{edit:?}");
        match &edit {
            Edit::Assign { rows, label, name } => {
                let chosen = rows.mask(document.model.len()).expect("rows");
                let given = label.unwrap_or(4);
                for (row, is_in) in chosen.into_iter().enumerate() {
                    let expected = if is_in { given } else { document.model.label(row) };
                    assert_eq!(after.model.label(row), expected, "{edit:?}, row {row}");
                }
                let table = after.table.as_ref().expect("a table");
                assert!(name.is_none() || table.name(4) == name.as_deref());
            }
            Edit::Duplicate { rows, shift, .. } => {
                let chosen = rows.mask(document.model.len()).expect("rows");
                let sources = (0..12).filter(|&row| chosen[row]);
                for (copy, source) in (12..).zip(sources) {
                    let way = after.model.world(copy) - document.model.world(source);
                    assert!((way - glam::DVec3::from(*shift)).length() < 1e-4);
                    assert_eq!(after.model.sh0[copy], document.model.sh0[source]);
                    assert_eq!(after.model.label(copy), 5);
                }
            }
            Edit::Keep { .. } => assert_eq!(after.model, document.model.filtered(|row| row < 9)),
            _ => {}
        }
        document = after;
    }
}

#[test]
fn a_file_of_changes_makes_the_same_model() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("edits.json");
    let first = document();
    let edits: Vec<Edit> = edits().into_iter().map(|(edit, _)| edit).collect();
    let one_by_one =
        edits.iter().fold(first.clone(), |document, edit| document.apply(edit, &mut no_sights).expect("a change"));
    EditsFile::new(&first.model, edits.clone()).write(&path).expect("a file");
    let file = EditsFile::read(&path).expect("a file");
    assert_eq!(file.edits, edits);
    assert_eq!(file.replay(&path, first.clone(), &mut no_sights).expect("a model"), one_by_one);

    // Another model, and an edit that fails: the message gives its number.
    let other = Document { model: first.model.filtered(|row| row != 3), table: None };
    let text = file.replay(&path, other, &mut no_sights).expect_err("another model").to_string();
    assert!(text.contains("edits.json") && text.contains("another model, with 12 Gaussians"), "{text}");
    let mut moved = first.clone();
    moved.model.means[5][1] += 0.001;
    assert!(file.replay(&path, moved, &mut no_sights).is_err());
    let bad = EditsFile::new(&first.model, vec![edits[0].clone(), Edit::Rename { label: 9, name: "x".into() }]);
    let text = bad.replay(&path, first.clone(), &mut no_sights).expect_err("no label 9").to_string();
    assert!(text.contains("edit 2") && text.contains("label 9"), "{text}");
    for text in ["{}", "[]", r#"{"schema_version":9,"gaussians":1,"checksum":1,"edits":[]}"#] {
        std::fs::write(&path, text).expect("a file");
        assert!(EditsFile::read(&path).is_err(), "{text}");
    }
    let error = EditsFile::read(Path::new("none.json")).expect_err("no file").to_string();
    assert!(error.contains("none.json"), "{error}");
}

#[test]
fn changes_that_cannot_be_made_are_refused() {
    let first = document();
    let cases = [
        (Edit::Rename { label: 1, name: " ".into() }, "letter"),
        (Edit::Rename { label: 1, name: "a\nb".into() }, "one line"),
        (Edit::Rename { label: 1, name: "box".into() }, "unique"),
        (Edit::Merge { labels: vec![1] }, "two labels"),
        (Edit::Remove { labels: vec![0, 1, 2, 3], fill: false }, "no Gaussian would be left"),
        (Edit::Remove { labels: vec![], fill: false }, "names no label"),
        (Edit::Recolour { labels: vec![1], colour: [f32::NAN, 0.0, 0.0], mix: 1.0 }, "from 0 to 1"),
        (Edit::Assign { rows: Rows::default(), label: None, name: None }, "no Gaussian is chosen"),
        (Edit::Assign { rows: rows(12, |row| row < 2), label: Some(9), name: None }, "label 9"),
        (Edit::Delete { rows: rows(12, |_| true) }, "no Gaussian would be left"),
        (Edit::Delete { rows: rows(13, |row| row == 12) }, "the model has 12"),
        (Edit::Duplicate { rows: rows(12, |row| row < 2), shift: [f64::INFINITY; 3], name: None }, "finite"),
    ];
    for (edit, word) in cases {
        let text = first.apply(&edit, &mut no_sights).expect_err("a refusal").to_string();
        assert!(text.contains(word), "{edit:?}: {text}");
    }
}

#[test]
fn rows_are_a_short_text() {
    let mask = [false, false, true, true, true, false, true, false];
    let rows = Rows::from_mask(&mask);
    let text = serde_json::to_string(&rows).expect("a text");
    assert_eq!(text, r#""2 3 1 1""#);
    assert_eq!(serde_json::from_str::<Rows>(&text).expect("rows"), rows);
    assert_eq!((rows.mask(8).expect("rows"), rows.count()), (mask.to_vec(), 4));
    assert!(serde_json::from_str::<Rows>(r#""2 x""#).is_err());
    assert!(serde_json::from_str::<Rows>(r#""4294967295 4294967295""#).expect("rows").mask(8).is_err());
    assert_eq!(Rows::from_mask(&[true; 3]).mask(3).expect("rows"), [true; 3]);
}
