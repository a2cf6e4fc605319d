//! Tables of scores as text.

/// A column: title, width, digits, score of a row.
pub(crate) type Column<T> = (&'static str, usize, usize, fn(&T) -> Option<f64>);

/// Returns a score as text.
pub(crate) fn number(value: Option<f64>, digits: usize) -> String {
    value.map_or("-".to_owned(), |value| format!("{value:.digits$}"))
}

/// Returns the titles of a table whose rows have names of some width; without the end of the line.
pub(crate) fn titles<T>((first, width): (&str, usize), columns: &[Column<T>]) -> String {
    let title = |&(title, width, ..): &Column<T>| format!(" {title:>width$}");
    format!("{first:>width$}") + &columns.iter().map(title).collect::<String>()
}

/// Returns a row of a table; without the end of the line.
pub(crate) fn line<T>((name, width): (&str, usize), columns: &[Column<T>], row: &T) -> String {
    let cell = |&(_, width, digits, value): &Column<T>| format!(" {:>width$}", number(value(row), digits));
    format!("{name:>width$}") + &columns.iter().map(cell).collect::<String>()
}

/// Returns a table; `first` is the title and the width of the names.
pub(crate) fn table<'a, T: 'a>(
    first: (&str, usize),
    columns: &[Column<T>],
    rows: impl IntoIterator<Item = (String, &'a T)>,
) -> String {
    let rows = rows.into_iter().map(|(name, row)| line((&name, first.1), columns, row) + "\n");
    titles(first, columns) + "\n" + &rows.collect::<String>()
}
