//! Pages with a title and parts below each other.

use labelgs_web as web;
use maud::{Markup, html};

/// Returns a whole page; `lead` stands below the title.
pub fn page(title: &str, lead: &Markup, body: &Markup) -> String {
    let body = html! { header { h1 { (title) } (lead) } main { (body) } };
    web::page(title, include_str!("style.css"), &body, include_str!("script.js"))
}

/// Returns a part of a page with a heading.
pub fn section(title: &str, body: &Markup) -> Markup {
    html! { section { h2 { (title) } (body) } }
}
