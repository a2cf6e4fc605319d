//! Images of one view: side by side, or one over the other with a border that is drawn over them.

use labelgs_scene::colour::{HEAT_COLOURS, HEAT_MAX};
use maud::{Markup, html};

/// An image: its name, and its address inside or beside the page.
#[derive(Clone, Debug)]
pub struct Panel {
    /// What it shows.
    pub name: String,
    /// `data:` or the name of a file beside the page.
    pub source: String,
    /// It is a map of errors, which needs a scale.
    pub is_heat: bool,
}

/// The images of one view.
#[derive(Clone, Debug, Default)]
pub struct Figure {
    /// Name of the view.
    pub view: String,
    /// Name of the object; none for the whole view.
    pub object: Option<String>,
    /// Scores with their names.
    pub numbers: Vec<(String, String)>,
    /// A note, such as the reason for a missing prediction.
    pub note: String,
    /// Images of one size. The page can lay the others over the first.
    pub panels: Vec<Panel>,
    /// Images that are shown on demand.
    pub more: Vec<Panel>,
    /// The first figure of a page is large.
    pub is_large: bool,
}

impl Figure {
    /// Returns the figure.
    pub fn markup(&self) -> Markup {
        html! {
            figure.view.hero[self.is_large] {
                figcaption {
                    strong { (self.view) }
                    @if let Some(object) = &self.object { " " b.tag { (object) } }
                    @for (name, value) in &self.numbers { " " span.score { (name) " " (value) } }
                    @if !self.note.is_empty() { p.note { (self.note) } }
                }
                div.panels { @for panel in &self.panels { (self.panel(panel)) } }
                @if !self.more.is_empty() {
                    details {
                        summary { "Show " (names(&self.more)) }
                        div.more { @for panel in &self.more { (self.panel(panel)) } }
                    }
                }
            }
        }
    }

    fn panel(&self, panel: &Panel) -> Markup {
        html! {
            div.panel data-name=(panel.name) {
                img loading="lazy" alt=(format!("{} of {}", panel.name, self.view)) src=(panel.source);
                span.name { (panel.name) @if panel.is_heat { " " (scale()) } }
            }
        }
    }
}

/// Returns the names of images as one text.
fn names(panels: &[Panel]) -> String {
    panels.iter().map(|panel| panel.name.as_str()).collect::<Vec<_>>().join(" and ")
}

/// Returns the scale of a map of errors: mean difference of the channels, which go from 0 to 1.
fn scale() -> Markup {
    let colours: Vec<String> = HEAT_COLOURS.iter().map(|[r, g, b]| format!("rgb({r},{g},{b})")).collect();
    html! {
        span.scale { "0 " i style=(format!("background:linear-gradient(90deg,{})", colours.join(","))) {} " " (HEAT_MAX) }
    }
}
