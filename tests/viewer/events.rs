//! Random events in the page.

use super::browser::WIDE;
use super::chromium::{Browser, Tab};
use super::server::Server;
use rand::rngs::SmallRng;
use rand::{Rng, SeedableRng};
use std::time::{Duration, Instant};

/// The largest window.
const LARGEST_SIZE: (u32, u32) = (1500, 1000);
/// Fewer seconds meet too little for a word on memory.
const SECONDS_LEAST: u64 = 120;

/// Some seconds of any events; `LABELGS_TEST_SECONDS` overrides how many. The memory of page and server, after a
/// warm-up of half of the time, grows by 5 % at most.
pub fn random_events(browser: &mut Browser, tab: &Tab, server: &Server) {
    let seconds = std::env::var("LABELGS_TEST_SECONDS").ok().and_then(|text| text.parse().ok()).unwrap_or(6);
    let mut dice = SmallRng::seed_from_u64(11);
    let memory = |browser: &mut Browser| {
        browser.resize(tab, WIDE);
        browser.js(tab, "document.querySelectorAll('dialog[open]').forEach((dialog) => dialog.close('no'))");
        browser.js(tab, "labelgs.labels.showAll()");
        browser.until(tab, "labelgs.labels.hidden.length === 0 && labelgs.labels.solo.length === 0");
        browser.until(tab, "labelgs.stage.asked === null && !labelgs.stage.isDirty && labelgs.stage.isStill");
        browser.call(Some(tab), "HeapProfiler.collectGarbage", serde_json::json!({}));
        let heap = browser.js(tab, "performance.memory.usedJSHeapSize").as_f64().expect("bytes");
        let dom = browser.call(Some(tab), "Memory.getDOMCounters", serde_json::json!({}));
        println!("nodes and listeners of the page: {} and {}", dom["nodes"], dom["jsEventListeners"]);
        [heap, resident(server.child.id())]
    };
    // The server's buffers grow with the largest picture.
    browser.resize(tab, LARGEST_SIZE);
    for layout in ["pair", "one"] {
        browser.click_on(tab, &format!("#layout-{layout}"));
        browser.until(tab, "labelgs.stage.asked === null && !labelgs.stage.isDirty && labelgs.stage.isStill");
    }
    any_events(browser, tab, &mut dice, Duration::from_secs(seconds) / 2);
    let before = memory(browser);
    any_events(browser, tab, &mut dice, Duration::from_secs(seconds) / 2);
    let after = memory(browser);
    println!(
        "{seconds} s of random events: heap of the page and memory of the server {before:.0?}, then {after:.0?} bytes"
    );
    for part in 0..if seconds < SECONDS_LEAST { 0 } else { 2 } {
        assert!(after[part] < 1.05 * before[part], "memory grew from {before:?} to {after:?} bytes");
    }
}

/// Resident memory of a process, bytes.
fn resident(process: u32) -> f64 {
    let text = std::fs::read_to_string(format!("/proc/{process}/status")).expect("Linux tells");
    let line = text.lines().find_map(|line| line.strip_prefix("VmRSS:")).expect("a line");
    line.trim().trim_end_matches("kB").trim().parse::<f64>().expect("a number") * 1024.0
}

fn any_events(browser: &mut Browser, tab: &Tab, dice: &mut SmallRng, time: Duration) {
    let end = Instant::now() + time;
    let keys = [
        ("Digit1", "1"),
        ("Digit2", "2"),
        ("Digit3", "3"),
        ("Digit4", "4"),
        ("Digit5", "5"),
        ("Digit6", "6"),
        ("Digit7", "7"),
        ("KeyV", "v"),
        ("KeyX", "x"),
        ("KeyP", "p"),
        ("KeyF", "f"),
        ("KeyH", "h"),
        ("KeyI", "i"),
        ("BracketLeft", "["),
        ("BracketRight", "]"),
        ("Escape", "Escape"),
        ("ArrowLeft", "ArrowLeft"),
        ("KeyW", "w"),
        ("Tab", "Tab"),
        ("KeyM", "m"),
    ];
    while Instant::now() < end {
        let at = (f64::from(dice.random_range(0..WIDE.0)), f64::from(dice.random_range(60..WIDE.1)));
        match dice.random_range(0..6) {
            0 => browser.click(tab, at, [0, 2, 8][dice.random_range(0..3)]),
            1 => browser.drag(
                tab,
                at,
                (at.0 + dice.random_range(-200.0..200.0), at.1 + dice.random_range(-200.0..200.0)),
            ),
            2 => {
                let event = serde_json::json!({ "type": "mouseWheel", "x": at.0, "y": at.1, "deltaX": 0, "deltaY": dice.random_range(-900..900) });
                drop(browser.call(Some(tab), "Input.dispatchMouseEvent", event));
            }
            3 => browser.resize(tab, (dice.random_range(200..LARGEST_SIZE.0), dice.random_range(200..LARGEST_SIZE.1))),
            _ => {
                let (code, key) = keys[dice.random_range(0..keys.len())];
                browser.key(tab, code, key, [0, 0, 0, 8][dice.random_range(0..4)]);
            }
        }
    }
}
