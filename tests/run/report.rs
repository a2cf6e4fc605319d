//! `report.html`: made anew from the folder of a run, of several runs, of hostile names and of damaged files.

use crate::support::device;
use crate::support::runs::{Place, stderr, succeeded};
use std::path::Path;

const HOSTILE_TEXT: &str = "<img src=x onerror=alert(1)>\"'&";

fn read(path: &Path) -> String {
    std::fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// Checks that a page asks for nothing, and that nothing of a name became markup.
fn is_harmless(page: &str) {
    assert!(!page.contains("://"), "an address");
    for (attribute, allowed) in [("src=\"", "data:image/"), ("href=\"", "nothing"), ("url(", "nothing")] {
        for (at, _) in page.match_indices(attribute) {
            let target: String = page[at + attribute.len()..].chars().take(40).collect();
            assert!(target.starts_with(allowed), "{attribute}{target}");
        }
    }
    assert!(!page.contains("<img src=x") && !page.contains("<b>bold"), "a name became markup");
    assert_eq!(page.matches("<script").count(), 1);
}

#[test]
fn a_report_is_made_anew_and_compares_runs() {
    let Some(_turn) = device() else { return };
    let place = Place::new();
    let names = place.path("scene/masks/labels.json");
    let mut table: serde_json::Value = serde_json::from_str(&read(&names)).expect("names");
    table["labels"][0]["name"] = HOSTILE_TEXT.into();
    std::fs::write(&names, table.to_string()).expect("names");
    let out = "<b>bold out";
    let flags =
        ["--config", &place.settings(), "--iterations", "20", "--set", "label_rule=votes", "--set", "densify_until=15"];
    succeeded(&place.trained(out, &flags));
    let page = read(&place.path(out).join("report.html"));
    is_harmless(&page);
    assert!(page.contains("&lt;img src=x onerror=alert(1)&gt;&quot;'&amp;"), "the name of the object");
    assert!(page.contains("<h1>scene</h1>") && page.contains("20 of 20 steps"), "{}", &page[..2000]);
    assert!(page.contains("&lt;b&gt;bold out"), "the folder");
    for part in ["PSNR", "Photo loss", "Label IoU", "Step time", "densification ends", "labels start"] {
        assert!(page.contains(part), "{part}");
    }
    for part in ["--set label_rule=votes", "densify_interval", "Device memory", "planned at the end"] {
        assert!(page.contains(part), "{part}");
    }
    // A photo, render, label map, mask and difference of the one view that is held out.
    let objects = page.matches("<img class=\"thumb\"").count();
    assert_eq!(page.matches("src=\"data:image/jpeg;base64,").count(), 3 + objects);
    assert_eq!(page.matches("src=\"data:image/png;base64,").count(), 2);
    assert!(!page.contains("<h2>Warnings"), "there are none");

    // It depends on the folder alone.
    std::fs::rename(place.path("scene"), place.path("elsewhere")).expect("moved");
    let again = place.text("again.html");
    let output = place.labelgs(&["report", &place.text(out), "-o", &again]);
    succeeded(&output);
    assert_eq!(String::from_utf8_lossy(&output.stdout).trim(), again);
    assert!(read(Path::new(&again)) == page, "made anew, it is the same");
    std::fs::rename(place.path("elsewhere"), place.path("scene")).expect("moved back");

    succeeded(&place.trained("other", &["--iterations", "10", "--set", "label_rule=votes"]));
    succeeded(&place.labelgs(&["report", &place.text(out), &place.text("other"), "-o", &again]));
    let both = read(Path::new(&again));
    is_harmless(&both);
    assert!(both.contains("<h1>scene: 2 runs</h1>") && both.contains("other") && both.contains("&lt;b&gt;bold out"));
    // Each run has a curve in each chart, and a render of the view.
    for chart in ["Photo loss", "L1", "Gaussians", "Step time"] {
        let at = both.find(&format!("<strong>{chart}</strong>")).unwrap_or_else(|| panic!("{chart}"));
        let end = at + both[at..].find("</figure>").expect("an end");
        assert_eq!(both[at..end].matches("<polyline").count(), 2, "{chart}");
    }
    assert_eq!(both.matches("src=\"data:image/jpeg;base64,").count(), 3 + both.matches("<img class=\"thumb\"").count());
    damaged(&place, out);
}

/// Missing files leave gaps, and damaged files are refused by name. What a kill leaves of a last line is no damage.
fn damaged(place: &Place, out: &str) {
    let folder = place.path(out);
    let report = |expected: i32, part: &str| {
        let output = place.labelgs(&["report", &place.text(out)]);
        assert_eq!(output.status.code(), Some(expected), "{part}: {}", stderr(&output));
        let text = if expected == 0 { read(&folder.join("report.html")) } else { stderr(&output) };
        assert!(text.contains(part), "{part} is not in {}", &text[..text.len().min(3000)]);
    };
    let history = folder.join("history.jsonl");
    let whole = read(&history);
    let page = read(&folder.join("report.html"));
    std::fs::write(&history, whole.clone() + "{\"kind\":\"steps\",\"st").expect("cut short");
    report(0, "Curves");
    assert!(read(&folder.join("report.html")) == page, "a line without an end does not count");
    std::fs::write(&history, whole.replacen("\"kind\"", "\"kin\"", 1)).expect("damaged");
    report(3, "history.jsonl: line 1: is not a valid history line");
    let mut lines: Vec<&str> = whole.lines().collect();
    lines.reverse();
    std::fs::write(&history, lines.join("\n") + "\n").expect("damaged");
    report(3, "expected ascending steps");
    std::fs::remove_file(&history).expect("removed");
    report(0, "No history.jsonl");
    for file in ["run.json", "metrics.json"] {
        let path = folder.join(file);
        let text = read(&path);
        std::fs::write(&path, "[1,").expect("damaged");
        report(3, &format!("{file}: line 1: EOF while parsing a value; this is not a valid training record"));
        std::fs::write(&path, text).expect("as before");
    }
    std::fs::remove_file(folder.join("run.json")).expect("removed");
    report(0, "No scores");
    std::fs::remove_file(folder.join("config.toml")).expect("removed");
    report(3, "has no config.toml; name the output folder of a run");
    let output = place.labelgs(&["report", &place.text("nowhere")]);
    assert_eq!(output.status.code(), Some(3), "{}", stderr(&output));
    assert!(stderr(&output).contains("nowhere: is not a folder"), "{}", stderr(&output));
}

/// A run that goes on says so, with both commands and what has changed.
#[test]
fn warnings_are_in_the_report() {
    let Some(_turn) = device() else { return };
    let place = Place::new();
    let flags = ["--iterations", "6", "--checkpoint-every", "2"];
    succeeded(&place.trained("out", &flags));
    let info: serde_json::Value = serde_json::from_str(&read(&place.path("out/run.json"))).expect("JSON");
    for phase in ["steps", "compile", "checkpoint"] {
        assert!(info["phases"][phase].as_f64() > Some(0.0), "{phase}: {}", info["phases"]);
    }
    let said = succeeded(&place.trained("out", &["--resume", "--iterations", "12"]));
    assert!(said.contains("--iterations: 6 in the checkpoint, now 12"), "{said}");
    let page = read(&place.path("out/report.html"));
    assert!(
        page.contains("<li>--iterations: 6 in the checkpoint, now 12</li>"),
        "the warning, in words of the terminal"
    );
    assert!(page.contains("after step 6 on ") && page.matches("<pre class=\"command\">").count() == 2);
}
