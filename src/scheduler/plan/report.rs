//! Plans as text, for `labelgs plan`.

use super::buffers::Class;
use super::memory::MemoryReport;
use super::{Grid, Page, Plan, Touch, Work, name};
use std::fmt::Write;

/// Formats bytes in the unit that gives the shortest number.
fn human(bytes: u64) -> String {
    match bytes {
        0..10_240 => format!("{bytes} B"),
        10_240..10_485_760 => format!("{:.1} KiB", bytes as f64 / 1024.0),
        _ => format!("{:.1} MiB", bytes as f64 / 1_048_576.0),
    }
}

impl MemoryReport {
    /// Formats a table of all buffers with their sizes, and sums by class.
    pub fn report(&self) -> String {
        let mut text = String::new();
        let _ = writeln!(text, "{:<24} {:<10} {:>12} {:>5} {:>12}", "buffer", "class", "elements", "B/el", "bytes");
        for row in &self.rows {
            let (class, bytes) = (row.class.name(), human(row.bytes));
            let _ =
                writeln!(text, "{:<24} {class:<10} {:>12} {:>5} {bytes:>12}", row.name, row.count, row.element_bytes);
        }
        for class in [Class::Model, Class::Persistent, Class::PerFrame, Class::Report] {
            let sum = self.rows.iter().filter(|row| row.class == class).map(|row| row.bytes).sum();
            let _ = writeln!(text, "{:<56} {:>11}", format!("all of class {}", class.name()), human(sum));
        }
        let arena = self.step_pages.iter().sum();
        let alone = format!("scratch arena (largest list unaliased: {})", human(self.step_unaliased));
        let _ = writeln!(text, "{alone:<56} {:>11}", human(arena));
        let _ = writeln!(text, "{:<56} {:>11}", "staging", human(self.staging));
        let _ = writeln!(text, "{:<56} {:>11}", "total", human(self.total));
        text
    }
}

impl Plan {
    /// Formats the list of items with their reads and writes, and the barriers with their reasons.
    pub fn report(&self) -> String {
        let mut text = String::new();
        let (items, barriers) = (self.items.len(), self.barrier_count());
        let arena = human(self.step_bytes());
        let _ = writeln!(text, "{}: {items} items, {barriers} barriers, scratch {arena}", self.list.name);
        for (index, (item, work)) in self.items.iter().zip(&self.list.work).enumerate() {
            if let Some(barrier) = &item.barrier {
                let _ = writeln!(text, "     -- barrier: {}", barrier.reason);
            }
            let _ = writeln!(text, "{index:>4} {}{}", item.label, self.grid_text(work));
            let reads = self.names(item.touches.iter().filter(|touch| !touch.kind.writes()));
            let writes = self.names(item.touches.iter().filter(|touch| touch.kind.writes()));
            if !reads.is_empty() {
                let _ = writeln!(text, "       reads  {reads}");
            }
            if !writes.is_empty() {
                let _ = writeln!(text, "       writes {writes}");
            }
        }
        text
    }

    /// Formats the place and the lifetime of each scratch buffer of the list.
    pub fn arena_report(&self) -> String {
        let mut rows = (0..self.table.len())
            .filter_map(|index| Some((self.placements[index]?, self.lives[index]?, self.table[index].name)))
            .filter_map(|(place, life, name)| match place.page {
                Page::Step(page) => Some((page, place.offset, life, place.bound, name)),
                Page::Own(_) => None,
            })
            .collect::<Vec<_>>();
        rows.sort_by_key(|&(page, offset, life, _, name)| (page, offset, life.first, name));
        let mut text = format!("{:<24} {:>4} {:>12} {:>12} {:>11}\n", "scratch", "page", "offset", "bytes", "items");
        for (page, offset, life, bytes, name) in rows {
            let alive = format!("{}..={}", life.first, life.last);
            let _ = writeln!(text, "{name:<24} {page:>4} {offset:>12} {bytes:>12} {alive:>11}");
        }
        text
    }

    fn grid_text(&self, work: &Work) -> String {
        match work {
            Work::Pass(pass) => match pass.grid {
                Grid::Groups(x, y, z) => format!(" [{x} x {y} x {z}]"),
                Grid::Indirect(buf, offset) => format!(" [indirect {} + {offset}]", name(self.table, buf)),
            },
            Work::Fill { word, .. } => format!(" with {word:#x}"),
            Work::Copy { .. } => String::new(),
        }
    }

    fn names<'a>(&self, touches: impl Iterator<Item = &'a Touch>) -> String {
        let mut names: Vec<&str> = Vec::new();
        for touch in touches {
            let name = name(self.table, touch.buf);
            if !names.contains(&name) {
                names.push(name);
            }
        }
        names.join(", ")
    }
}
