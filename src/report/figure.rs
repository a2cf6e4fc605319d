//! Pictures of one view: side by side, or one over the other with a slider between them.

use maud::{Markup, html};

/// A picture: its name, and its address inside or beside the page.
#[derive(Clone, Debug)]
pub struct Panel {
    /// What it shows.
    pub name: String,
    /// `data:` or the name of a file beside the page.
    pub source: String,
}

/// The pictures of one view.
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
    /// Pictures of one size. The slider lays the others over the first.
    pub panels: Vec<Panel>,
}

impl Figure {
    /// Returns the figure.
    pub fn markup(&self) -> Markup {
        html! {
            figure.view {
                figcaption {
                    strong { (self.view) }
                    @if let Some(object) = &self.object { " " b.tag { (object) } }
                    @for (name, value) in &self.numbers { " " span.score { (name) " " (value) } }
                    @if !self.note.is_empty() { p.note { (self.note) } }
                }
                div.panels {
                    @for panel in &self.panels {
                        div.panel data-name=(panel.name) {
                            img loading="lazy" alt=(format!("{} of {}", panel.name, self.view)) src=(panel.source);
                            span.name { (panel.name) }
                        }
                    }
                }
            }
        }
    }
}
