//! Tables of scores, for a terminal and for a page.

use crate::report::text;
use maud::{Markup, html};
use std::io::IsTerminal;

/// Columns between two columns of text.
const COLUMN_GAP: usize = 2;
/// Minimum length of a shortened name, characters.
const NAME_MIN: usize = 8;

/// A column of numbers.
pub(crate) struct Column<T> {
    /// Title on a terminal: short.
    pub short: &'static str,
    /// Title on a page.
    pub title: &'static str,
    /// Digits after the point.
    pub digits: usize,
    /// Score of a row.
    pub value: fn(&T) -> Option<f64>,
}

/// Makes a column of numbers.
pub(crate) const fn column<T>(
    short: &'static str,
    title: &'static str,
    digits: usize,
    value: fn(&T) -> Option<f64>,
) -> Column<T> {
    Column { short, title, digits, value }
}

/// A number as text with a fixed count of digits; `-` for none.
pub(crate) fn number(value: Option<f64>, digits: usize) -> String {
    value.map_or("-".to_owned(), |value| format!("{value:.digits$}"))
}

/// Cells of a column under its titles.
struct Cells {
    short: &'static str,
    title: &'static str,
    cells: Vec<String>,
    is_number: bool,
}

/// A table: a column of names, and others.
pub(crate) struct Table {
    first: &'static str,
    names: Vec<String>,
    columns: Vec<Cells>,
}

impl Table {
    /// Makes a table of rows with names. Columns without any value are left out.
    pub(crate) fn new<'a, T: 'a>(
        first: &'static str,
        columns: &[Column<T>],
        rows: impl IntoIterator<Item = (String, &'a T)>,
    ) -> Self {
        let (names, rows): (Vec<String>, Vec<&T>) = rows.into_iter().unzip();
        let of = |column: &Column<T>| {
            let values: Vec<Option<f64>> = rows.iter().map(|row| (column.value)(row)).collect();
            let cells = values.iter().map(|&value| number(value, column.digits)).collect();
            let Column { short, title, .. } = *column;
            values.iter().any(Option::is_some).then_some(Cells { short, title, cells, is_number: true })
        };
        Self { first, names, columns: columns.iter().filter_map(of).collect() }
    }

    /// Adds a column of text.
    pub(crate) fn with_text(mut self, title: &'static str, cells: Vec<String>) -> Self {
        self.columns.push(Cells { short: title, title, cells, is_number: false });
        self
    }

    /// Returns the table as lines of text. Names are shortened if lines were longer than `width` otherwise.
    pub(crate) fn text(&self, width: Option<usize>) -> String {
        let widths: Vec<usize> = self.columns.iter().map(|column| widest(column.short, &column.cells)).collect();
        let others: usize = widths.iter().map(|width| width + COLUMN_GAP).sum();
        let room = width.map_or(usize::MAX, |width| width.saturating_sub(others).max(NAME_MIN));
        let names: Vec<String> = self.names.iter().map(|name| shortened(name, room)).collect();
        let first = widest(self.first, &names);
        let mut lines = format!("{:first$}", self.first);
        for (column, width) in self.columns.iter().zip(&widths) {
            lines += &padded(column.short, *width, column.is_number);
        }
        for (row, name) in names.iter().enumerate() {
            lines = lines.trim_end().to_owned() + &format!("\n{name:first$}");
            for (column, width) in self.columns.iter().zip(&widths) {
                lines += &padded(column.cells.get(row).map_or("", String::as_str), *width, column.is_number);
            }
        }
        lines.trim_end().to_owned() + "\n"
    }

    /// Returns the table for a page.
    pub(crate) fn markup(&self) -> Markup {
        let side = |column: &Cells| column.is_number.then_some("right");
        let cell = |column: &Cells, row: usize| column.cells.get(row).cloned().unwrap_or_default();
        html! {
            div.scroll {
                table.sortable.cards {
                    thead {
                        tr {
                            th { (capital(self.first)) }
                            @for column in &self.columns { th class=[side(column)] { (column.title) } }
                        }
                    }
                    tbody {
                        @for (row, name) in self.names.iter().enumerate() {
                            tr {
                                td { (name) }
                                @for column in &self.columns {
                                    @let text = cell(column, row);
                                    @let key = (text == "-").then_some("");
                                    td class=[side(column)] data-title=(column.title) data-value=[key] { (text) }
                                }
                            }
                        }
                    }
                }
            }
        }
    }
}

/// A part of a report.
pub(crate) enum Part {
    /// A table.
    Table(Table),
    /// A title of what follows.
    Title(String),
    /// Sentences.
    Note(String),
}

/// Tables and notes below each other.
#[derive(Default)]
pub(crate) struct Parts(pub(crate) Vec<Part>);

impl Parts {
    /// Returns them as lines of text for standard output.
    pub(crate) fn text(&self) -> String {
        let width = screen_width();
        let mut text = String::new();
        for part in &self.0 {
            match part {
                Part::Table(table) => text += &table.text(width),
                Part::Title(title) => {
                    text += &format!("{}{}\n", if text.is_empty() { "" } else { "\n" }, wrapped(title, width))
                }
                Part::Note(note) => text += &format!("{}\n", wrapped(note, width)),
            }
        }
        text
    }

    /// Returns them for a page.
    pub(crate) fn markup(&self) -> Markup {
        html! {
            @for part in &self.0 {
                @match part {
                    Part::Table(table) => (table.markup()),
                    Part::Title(title) => h3 { (capital(title)) },
                    Part::Note(note) => p.quiet { (note) },
                }
            }
        }
    }
}

/// Columns of a terminal that does not report its width.
const TERMINAL_WIDTH_DEFAULT: usize = 80;

/// Returns the columns of the terminal on standard output, or `None` if it is not a terminal.
pub(crate) fn screen_width() -> Option<usize> {
    if !std::io::stdout().is_terminal() {
        return None;
    }
    Some(terminal_size::terminal_size().map_or(TERMINAL_WIDTH_DEFAULT, |(width, _)| usize::from(width.0)))
}

fn padded(text: &str, width: usize, is_number: bool) -> String {
    if is_number { format!("{:COLUMN_GAP$}{text:>width$}", "") } else { format!("{:COLUMN_GAP$}{text:width$}", "") }
}

fn widest(title: &str, cells: &[String]) -> usize {
    cells.iter().map(|cell| cell.chars().count()).chain([title.chars().count()]).max().unwrap_or(0)
}

/// Returns a name with its middle left out if it is longer than `room`: names often differ at the end.
fn shortened(name: &str, room: usize) -> String {
    let letters: Vec<char> = name.chars().collect();
    if letters.len() <= room {
        return name.to_owned();
    }
    let end = room / 2;
    let start = room - end - 1;
    letters[..start].iter().chain(&['…']).chain(&letters[letters.len() - end..]).collect()
}

/// Breaks text into lines of `width` columns at spaces.
fn wrapped(text: &str, width: Option<usize>) -> String {
    let width = width.unwrap_or(usize::MAX);
    let mut lines = vec![String::new()];
    for word in text.split(' ') {
        let last =
            lines.last_mut().filter(|line| line.is_empty() || line.chars().count() + 1 + word.chars().count() <= width);
        match last {
            Some(line) if line.is_empty() => line.push_str(word),
            Some(line) => *line += &format!(" {word}"),
            None => lines.push(word.to_owned()),
        }
    }
    lines.join("\n")
}

fn capital(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or(String::new(), |first| first.to_uppercase().chain(letters).collect())
}

/// Digits of decibels and of scores from 0 to 1, as on pages.
pub(crate) const DECIBEL_DIGITS: usize = text::DECIBEL_DIGITS;
pub(crate) const SCORE_DIGITS: usize = text::SCORE_DIGITS;

#[cfg(test)]
mod tests {
    use super::*;

    struct Row(Option<f64>);

    const COLUMNS: [Column<Row>; 2] = [column("PSNR", "PSNR, dB", 2, |row| row.0), column("none", "none", 2, |_| None)];

    fn table() -> Table {
        let rows = [("a long name of a view.png".to_owned(), &Row(Some(25.123))), ("b".to_owned(), &Row(None))];
        Table::new("view", &COLUMNS, rows)
    }

    #[test]
    fn lines_fit_and_empty_columns_are_left_out() {
        assert_eq!(
            table().text(None),
            "view                        PSNR\na long name of a view.png  25.12\nb                              -\n"
        );
        let narrow = table().text(Some(20));
        assert!(narrow.lines().all(|line| line.chars().count() <= 20), "{narrow}");
        assert!(narrow.contains("a long…ew.png"), "{narrow}");
        let labelled = table().with_text("labels", vec!["1,2".to_owned()]).text(None);
        assert!(labelled.contains("25.12  1,2\n") && labelled.ends_with("-\n"), "{labelled}");
    }

    #[test]
    fn notes_are_wrapped() {
        assert_eq!(wrapped("one two three", Some(8)), "one two\nthree");
        assert_eq!(wrapped("one two three", None), "one two three");
        assert_eq!(wrapped("unbreakable word", Some(4)), "unbreakable\nword");
    }

    #[test]
    fn a_page_has_the_same_cells() {
        let page = table().markup().into_string();
        assert!(page.contains("<th>View</th><th class=\"right\">PSNR, dB</th>"), "{page}");
        assert!(page.contains(">25.12</td>") && page.contains("data-value=\"\">-</td>"), "{page}");
    }
}
