//! Clocks, medians, tables, files.

use labelgs::files::atomic;
use labelgs::{Error, Result};
use serde::Serialize;
use std::fmt::Write as _;
use std::path::Path;
use std::time::{Duration, Instant};

/// Time of a piece of work.
#[derive(Clone, Copy, Debug, Default)]
pub struct Cost {
    /// Wall clock, ms.
    pub wall: f64,
    /// CPU time of all threads of this process, ms; 0 if the system does not report it.
    pub cpu: f64,
}

/// Runs `work` and returns its result and time.
pub fn timed<T>(work: impl FnOnce() -> Result<T>) -> Result<(T, Cost)> {
    let (wall, cpu) = (Instant::now(), cpu_time());
    let done = work()?;
    let ms = |duration: Duration| duration.as_secs_f64() * 1e3;
    Ok((done, Cost { wall: ms(wall.elapsed()), cpu: ms(cpu_time().saturating_sub(cpu)) }))
}

/// CPU time of this process, all threads; 0 if the system does not report it.
#[cfg(unix)]
fn cpu_time() -> Duration {
    let time = rustix::time::clock_gettime(rustix::time::ClockId::ProcessCPUTime);
    Duration::new(time.tv_sec.try_into().unwrap_or(0), time.tv_nsec.try_into().unwrap_or(0))
}

/// Without a source of CPU time.
#[cfg(not(unix))]
fn cpu_time() -> Duration {
    Duration::ZERO
}

/// Median; NaN for no values.
pub fn median(values: impl IntoIterator<Item = f64>) -> f64 {
    let mut sorted: Vec<f64> = values.into_iter().collect();
    sorted.sort_by(f64::total_cmp);
    match sorted.len() {
        0 => f64::NAN,
        n if n % 2 == 1 => sorted[n / 2],
        n => f64::midpoint(sorted[n / 2 - 1], sorted[n / 2]),
    }
}

/// Returns a quantile, 0 without values. Reorders them.
pub fn quantile(values: &mut [f64], share: f64) -> f64 {
    if values.is_empty() {
        return 0.0;
    }
    let place = ((values.len() - 1) as f64 * share).ceil() as usize;
    *values.select_nth_unstable_by(place, f64::total_cmp).1
}

/// Load average of the last minute, if the system reports it.
pub fn load() -> Option<f64> {
    std::fs::read_to_string("/proc/loadavg").ok()?.split(' ').next()?.parse().ok()
}

/// Formats a table: the first row is the head; the first column is left-aligned, the others right-aligned.
pub fn table(rows: &[Vec<String>]) -> String {
    let columns = rows.iter().map(Vec::len).max().unwrap_or(0);
    let width = |column: usize| rows.iter().filter_map(|row| row.get(column)).map(|cell| cell.chars().count()).max();
    let widths: Vec<usize> = (0..columns).map(|column| width(column).unwrap_or(0)).collect();
    let mut text = String::new();
    for row in rows {
        let mut line = String::new();
        for (column, cell) in row.iter().enumerate() {
            let width = widths[column];
            // Writing to a string cannot fail.
            let _ = if column == 0 { write!(line, "{cell:width$}") } else { write!(line, "  {cell:>width$}") };
        }
        text.push_str(line.trim_end());
        text.push('\n');
    }
    text
}

/// Writes a value as JSON and creates the folder.
pub fn write_json(path: &Path, value: &impl Serialize) -> Result<()> {
    let text = serde_json::to_string_pretty(value).map_err(|error| Error::Bug(format!("JSON: {error}")))?;
    atomic::write(path, |file| writeln!(file, "{text}"))?;
    println!("wrote {}", path.display());
    Ok(())
}
