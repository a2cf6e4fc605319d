//! Locations in GLSL text.

/// Returns the line (from 1) of the first occurrence of `name` as a word; 1 if there is none.
pub fn line_of(source: &str, name: &str) -> usize {
    let is_word = |line: &str| line.split(|c: char| !(c.is_alphanumeric() || c == '_')).any(|word| word == name);
    without_comments(source).lines().position(is_word).map_or(1, |index| index + 1)
}

/// The text with comments blanked out; line breaks stay.
pub fn without_comments(source: &str) -> String {
    let mut code = String::with_capacity(source.len());
    let mut rest = source;
    while let Some(start) = rest.find("//").into_iter().chain(rest.find("/*")).min() {
        code.push_str(&rest[..start]);
        let end = if rest[start..].starts_with("//") {
            rest[start..].find('\n').map_or(rest.len(), |end| start + end)
        } else {
            rest[start + 2..].find("*/").map_or(rest.len(), |end| start + end + 4)
        };
        code.extend(rest[start..end].chars().filter(|c| *c == '\n'));
        rest = &rest[end..];
    }
    code.push_str(rest);
    code
}
