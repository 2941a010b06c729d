//! Pieces of a page that needs nothing but itself: no scripts, no network, readable on a phone and in the
//! dark.

use base64::Engine;
use base64::engine::general_purpose::STANDARD as BASE64;

use crate::canvas::Figure;

const STYLE: &str = "\
:root{color-scheme:light dark;--ink:#1f2328;--soft:#59636e;--line:#d1d9e0;--paper:#fff;--band:#f6f8fa}\
@media(prefers-color-scheme:dark){:root{--ink:#e6edf3;--soft:#9198a1;--line:#3d444d;\
--paper:#0d1117;--band:#151b23}}\
*{box-sizing:border-box}\
body{font:16px/1.55 system-ui,sans-serif;max-width:56rem;margin:0 auto;padding:1.5rem 1rem 4rem;\
color:var(--ink);background:var(--paper)}\
h1{font-size:1.5rem;overflow-wrap:anywhere}h2{font-size:1.2rem;margin:2.2rem 0 .6rem}\
h3{font-size:1rem;margin:1.6rem 0 .4rem}\
p{margin:.5rem 0}.soft{color:var(--soft);font-size:.875rem}.wide{overflow-x:auto}\
table{border-collapse:collapse;font-size:.875rem;font-variant-numeric:tabular-nums}\
td,th{padding:.3rem .7rem;text-align:right;border-bottom:1px solid var(--line);white-space:nowrap}\
td:first-child,th:first-child{text-align:left;padding-left:0}\
figure{margin:1.2rem 0}\
figure .wide{background:#fff;border:1px solid var(--line);border-radius:8px;padding:.4rem}\
figure svg,figure img{display:block;width:100%;min-width:36rem;height:auto}\
figcaption{color:var(--soft);font-size:.875rem;margin-top:.4rem}\
pre{background:var(--band);border:1px solid var(--line);border-radius:8px;padding:.8rem;\
overflow-x:auto;font-size:.8rem}summary{cursor:pointer}\
a{color:inherit}";

/// A whole page around a body.
pub(crate) fn page(title: &str, body: &str) -> String {
    let title = escaped(title);
    format!(
        "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<meta name=\"viewport\" \
            content=\"width=device-width,initial-scale=1\">\n<title>{title}</title>\n\
            <style>{STYLE}</style>\n</head>\n<body>\n<h1>{title}</h1>\n{body}</body>\n</html>\n"
    )
}

/// The first row of a table.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum FirstRow {
    /// The names of the columns.
    Names,
    /// Values like those of the other rows.
    Values,
}

/// A table with a caption; empty without rows.
pub(crate) fn table(caption: &str, rows: &[Vec<String>], first: FirstRow) -> String {
    if rows.is_empty() {
        return String::new();
    }
    let caption = if caption.is_empty() {
        String::new()
    } else {
        format!("<p class=\"soft\">{}</p>\n", escaped(caption))
    };
    let mut text = format!("{caption}<div class=\"wide\"><table>\n");
    for (index, row) in rows.iter().enumerate() {
        let tag = if first == FirstRow::Names && index == 0 { "th" } else { "td" };
        let cells: String = row.iter().map(|cell| format!("<{tag}>{}</{tag}>", escaped(cell))).collect();
        text.push_str(&format!("<tr>{cells}</tr>\n"));
    }
    text + "</table></div>\n"
}

/// A figure with its caption and links to its files.
pub(crate) fn figure(figure: &Figure) -> String {
    let (name, caption) = (escaped(&figure.name), escaped(&figure.caption));
    format!(
        "<figure id=\"{name}\">\n<div class=\"wide\">\n{}</div>\n<figcaption>{caption} <a \
            href=\"figures/{name}.svg\">svg</a> <a href=\"figures/{name}.png\">png</a></figcaption>\n\
            </figure>\n",
        figure.svg
    )
}

/// A PNG inside of the page.
pub(crate) fn picture(png: &[u8], caption: &str) -> String {
    let (data, caption) = (BASE64.encode(png), escaped(caption));
    format!(
        "<figure>\n<div class=\"wide\"><img alt=\"{caption}\" src=\"data:image/png;base64,{data}\"></div>\n\
            <figcaption>{caption}</figcaption>\n</figure>\n"
    )
}

/// Text as it appears in markup.
pub(crate) fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_from_outside_is_no_markup() {
        let rows = vec![vec!["<b>".to_owned(), "1".to_owned()]];
        let page = page("a <script> & b", &table("x < y", &rows, FirstRow::Values));
        assert!(
            page.contains("a &lt;script&gt; &amp; b")
                && page.contains("<td>&lt;b&gt;</td>")
                && page.contains("x &lt; y"),
            "{page}"
        );
        assert_eq!(table("nothing", &[], FirstRow::Names), "");
    }
}
