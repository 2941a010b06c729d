//! What is said of an object.

use std::fmt::Write;

use lgs_eval::laws::{ObjectLaw, parameter_rows, verdict_name};

/// What is said of an object.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ObjectNote {
    /// Colour of its marks, each channel from 0 to 1.
    pub color: [f32; 3],
    /// Its law and how far it is trusted, in Markdown.
    pub text: String,
}

impl ObjectNote {
    /// The note of an object with a law, if it has a record of one, and the times between which its motion is
    /// trusted.
    #[must_use]
    pub fn of(law: Option<&ObjectLaw>, [from, to]: [f64; 2], color: [f32; 3]) -> Self {
        let mut text = match law {
            Some(law) => format!("**{}**, {}", law.coordinates, verdict_name(law.verdict)),
            None => "**particles**, moved by networks".to_owned(),
        };
        let _ = write!(text, "; trusted from t = {from:.2} to {to:.2}\n\n");
        for (row, cells) in law.map(parameter_rows).unwrap_or_default().iter().enumerate() {
            let _ = writeln!(text, "| {} |", cells.join(" | "));
            if row == 0 {
                let _ = writeln!(text, "|{}", " --- |".repeat(cells.len()));
            }
        }
        Self { color, text }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_note_is_a_table_of_the_law_under_its_trust() {
        let law = ObjectLaw { coordinates: "point".to_owned(), ..ObjectLaw::default() };
        let note = ObjectNote::of(Some(&law), [-0.5, 2.0], [1.0; 3]);
        assert!(note.text.starts_with("**point**, outside; trusted from t = -0.50 to 2.00\n\n| term |"));
        assert!(note.text.contains("| --- |") && note.text.contains("| free motion |"), "{}", note.text);
        assert!(ObjectNote::of(None, [0.0, 0.75], [1.0; 3]).text.contains("particles"));
    }
}
