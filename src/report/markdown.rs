//! A study as a page of Markdown, for a repository: the same sentences, table and figures as the HTML page, the latter as
//! files beside it.

use super::curve::Curve;
use super::page::{COLUMNS, EXPLANATION, cells, figures, sentences};
use super::results::Results;
use std::fmt::Write;

/// The page. `images`: names and files of pictures beside it.
pub fn markdown(results: &Results, curves: &[Curve], images: &[(String, String)]) -> String {
    let about = |name: &str| results.about.iter().find(|(n, _)| n == name).map_or("", |(_, v)| v.as_str());
    let mut s = format!("# What accuracy costs: {}\n\n", escape(about("scene")));
    for sentence in sentences(curves) {
        let _ = writeln!(s, "- {}", escape(&sentence));
    }
    let _ = writeln!(s, "\n{EXPLANATION}\n");
    let row = |cells: &[String]| {
        let cells: Vec<String> = cells.iter().map(|c| escape(c)).collect();
        format!("| {} |\n", cells.join(" | "))
    };
    s += &row(&COLUMNS.map(String::from));
    let _ = writeln!(s, "|---|{}", "---:|".repeat(COLUMNS.len() - 1));
    cells(curves).iter().for_each(|line| s += &row(line));
    for figure in figures(curves) {
        let _ = writeln!(s, "\n## {0}\n\n{1}\n\n![{0}]({2}.svg)", figure.title, figure.text, figure.name);
    }
    if !images.is_empty() {
        s += "\n## Images\n";
        for (name, file) in images {
            let _ = writeln!(s, "\n{0}\n\n![{0}]({file})", escape(name));
        }
    }
    s += "\n## How this was made\n\n";
    for (name, value) in &results.about {
        let _ = writeln!(s, "- {name}: {}", escape(value));
    }
    s + "\nAll numbers are in [results.csv](results.csv); `hrr cost --replot results.csv -o DIR` draws this page again.\n"
}

/// What Markdown would take for its own.
fn escape(text: &str) -> String {
    let mut s = String::new();
    for c in text.chars() {
        if matches!(c, '|' | '*' | '_' | '`' | '<' | '[' | ']' | '\\') {
            s.push('\\');
        }
        s.push(c);
    }
    s
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_markup_is_escaped() {
        assert_eq!(escape("a|b_c <d>"), "a\\|b\\_c \\<d>");
        let results = Results { about: vec![("scene".into(), "x_y".into())], rows: Vec::new() };
        let page = markdown(&results, &[], &[("reference".into(), "reference.png".into())]);
        assert!(page.starts_with("# What accuracy costs: x\\_y\n"), "{page}");
        assert!(page.contains("![reference](reference.png)") && page.contains("](curves.svg)"), "{page}");
    }
}
