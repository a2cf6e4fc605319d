//! labels.json: round trips, and invalid tables refused.

use labelgs_files::label_table::FILE_NAME;
use labelgs_files::{LabelEntry, LabelTable};
use std::fs;

fn table() -> LabelTable {
    let named =
        LabelEntry { name: Some("Cup".into()), source: Some("17".into()), pixels: 5, views: 2, ..LabelEntry::new(2) };
    LabelTable::new(vec![named, LabelEntry::new(1)])
}

#[test]
fn a_table_comes_back_sorted_and_is_found_by_name() {
    let folder = tempfile::tempdir().expect("folder");
    let path = folder.path().join(FILE_NAME);
    table().write(&path).expect("written");
    let read = LabelTable::read(&path).expect("read");
    assert_eq!(read, table());
    assert_eq!(read.labels.iter().map(|entry| entry.id).collect::<Vec<_>>(), [1, 2]);
    assert_eq!(read.id_of("cup"), Some(2));
    assert_eq!(read.id_of("saucer"), None);
    assert_eq!(read.entry(2).and_then(|entry| entry.source.as_deref()), Some("17"));
}

#[test]
fn a_models_table_is_beside_it_or_in_the_folder_of_its_run() {
    let folder = tempfile::tempdir().expect("folder");
    let ply = folder.path().join("point_cloud/iteration_7/point_cloud.ply");
    fs::create_dir_all(ply.parent().expect("folder")).expect("folder");
    fs::write(&ply, "").expect("file");
    assert_eq!(LabelTable::find_for_model(&ply), None);
    table().write(&folder.path().join(FILE_NAME)).expect("written");
    assert_eq!(LabelTable::find_for_model(&ply), Some(folder.path().join(FILE_NAME)));
    assert_eq!(LabelTable::find_for_model(folder.path()), Some(folder.path().join(FILE_NAME)));
    table().write(&LabelTable::path_beside(&ply)).expect("written");
    assert_eq!(LabelTable::find_for_model(&ply), Some(ply.with_file_name("point_cloud.labels.json")));
}

#[test]
fn an_invalid_table_is_refused_with_its_place() {
    let folder = tempfile::tempdir().expect("folder");
    let path = folder.path().join(FILE_NAME);
    let entry = |id: u32, name: &str| format!(r#"{{"id": {id}, "name": "{name}", "colour": [1, 2, 3]}}"#);
    let cases = [
        (1, vec![entry(0, "a")], "labels are from 1"),
        (1, vec![entry(2_147_483_648, "a")], "labels are from 1"),
        (1, vec![entry(3, "a"), entry(3, "b")], "label 3"),
        (1, vec![entry(3, "a"), entry(4, "a")], "name of another label"),
        (2, vec![], "has version 2"),
    ];
    for (version, entries, expected) in cases {
        let text = format!(r#"{{"schema_version": {version}, "labels": [{}]}}"#, entries.join(","));
        fs::write(&path, text).expect("written");
        let message = LabelTable::read(&path).expect_err("refused").to_string();
        assert!(message.contains(expected) && message.contains(FILE_NAME), "{message}");
    }
    fs::write(&path, "{\"labels\": 3}").expect("written");
    assert!(LabelTable::read(&path).expect_err("refused").to_string().contains("line 1"));
}

#[test]
fn a_table_by_hand_needs_ids_and_names_only() {
    let folder = tempfile::tempdir().expect("folder");
    let path = folder.path().join(FILE_NAME);
    fs::write(&path, r#"{"labels": [{"id": 3, "name": "cup"}, {"id": 1, "color": [1, 2, 3], "score": 0.5}]}"#)
        .expect("ok");
    let table = LabelTable::read_in_folder(folder.path()).expect("read").expect("a table");
    assert_eq!(table.name(3), Some("cup"));
    let colour = |id| table.entry(id).expect("an entry").colour;
    assert_eq!((colour(3), colour(1)), (LabelEntry::new(3).colour, [1, 2, 3]));
    // Unknown keys survive.
    table.write(&path).expect("written");
    assert!(fs::read_to_string(&path).expect("text").contains(r#""score": 0.5"#));
    assert_eq!(LabelTable::read(&path).expect("read"), table);
}
