//! Markdown of the documents to HTML: headings with anchors, links between pages, and the text of each section for the search.

use pulldown_cmark::{CowStr, Event, Options, Parser, Tag, TagEnd, html::push_html};

/// A page in HTML, and what the search finds in it.
pub(super) struct Rendered {
    /// The text of the first heading.
    pub title: String,
    pub html: String,
    pub sections: Vec<Section>,
}

/// The text between one heading and the next.
pub(super) struct Section {
    /// The text of the heading.
    pub heading: String,
    /// What a link to the heading ends with.
    pub anchor: String,
    /// The words below the heading, without markup.
    pub text: String,
}

/// Renders a page. `link` turns the target of a link or picture of the page into the address under which the service has it.
pub(super) fn render(markdown: &str, link: impl Fn(&str) -> String) -> Rendered {
    let mut events: Vec<Event<'_>> = Parser::new_ext(markdown, Options::ENABLE_TABLES).collect();
    let sections = name_headings(&mut events);
    for event in &mut events {
        if let Event::Start(Tag::Link { dest_url, .. } | Tag::Image { dest_url, .. }) = event {
            *dest_url = CowStr::from(link(dest_url));
        }
    }
    let mut html = String::with_capacity(markdown.len() * 2);
    push_html(&mut html, events.into_iter());
    let title = sections.first().map(|section| section.heading.clone()).unwrap_or_default();
    Rendered { title, html: scrolling_tables(&html), sections }
}

/// Gives every heading its anchor, and returns the sections that they begin.
fn name_headings(events: &mut [Event<'_>]) -> Vec<Section> {
    let mut sections: Vec<Section> = Vec::new();
    let mut heading_at: Option<usize> = None;
    for index in 0..events.len() {
        let words = match &events[index] {
            Event::Start(Tag::Heading { .. }) => {
                heading_at = Some(index);
                sections.push(Section { heading: String::new(), anchor: String::new(), text: String::new() });
                continue;
            }
            Event::Text(text) | Event::Code(text) => text.to_string(),
            Event::SoftBreak | Event::HardBreak | Event::End(TagEnd::TableCell | TagEnd::Paragraph) => " ".to_owned(),
            Event::End(TagEnd::Heading(_)) => String::new(),
            _ => continue,
        };
        let Some(section) = sections.last_mut() else { continue };
        match (heading_at, &events[index]) {
            (Some(start), Event::End(_)) => {
                section.anchor = anchor(&section.heading);
                if let Event::Start(Tag::Heading { id, .. }) = &mut events[start] {
                    *id = Some(CowStr::from(section.anchor.clone()));
                }
                heading_at = None;
            }
            (Some(_), _) => section.heading.push_str(&words),
            (None, _) => section.text.push_str(&words),
        }
    }
    sections
}

/// The anchor of a heading, as hosts of repositories make it: small letters, spaces as hyphens, no punctuation.
fn anchor(heading: &str) -> String {
    let keep = |letter: char| match letter {
        ' ' => Some('-'),
        _ if letter.is_alphanumeric() || letter == '-' || letter == '_' => Some(letter),
        _ => None,
    };
    heading.trim().to_lowercase().chars().filter_map(keep).collect()
}

/// Wide tables scroll by themselves instead of widening the page.
fn scrolling_tables(html: &str) -> String {
    html.replace("<table>", "<div class=\"table\"><table>").replace("</table>", "</table></div>")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn headings_get_anchors_and_links_are_translated() {
        let page = "# A page\n\nWords.\n\n## What `it` does: all\n\n| a | b |\n|---|---|\n| [c](d.md#e) | f |\n\n![g](h.png)\n";
        let rendered = render(page, |link| format!("/docs/{link}"));
        assert_eq!(rendered.title, "A page", "the first heading");
        assert!(rendered.html.contains("<h2 id=\"what-it-does-all\">"), "{}", rendered.html);
        assert!(rendered.html.contains("href=\"/docs/d.md#e\""), "{}", rendered.html);
        assert!(rendered.html.contains("src=\"/docs/h.png\""), "{}", rendered.html);
        let sections: Vec<(&str, &str)> =
            rendered.sections.iter().map(|section| (section.anchor.as_str(), section.text.trim())).collect();
        assert_eq!(sections, [("a-page", "Words."), ("what-it-does-all", "a b c f g")], "what the search finds");
    }

    #[test]
    fn markup_of_a_page_is_text_and_never_runs() {
        let rendered = render("`<script>` & more\n", str::to_owned);
        assert!(rendered.html.contains("&lt;script&gt;"), "{}", rendered.html);
    }
}
