//! An aligned table, printed row by row as measurements come in.

/// A line of the table.
#[derive(Clone, Debug, Default)]
pub struct Row {
    /// Name of the operation.
    pub name: String,
    /// Median wall time, seconds.
    pub secs: Option<f64>,
    /// Rate of the operation, with its unit.
    pub rate: String,
    /// The rate as a fraction of the machine's, or what else it is compared with.
    pub ratio: String,
    /// A demand and whether it is met.
    pub asked: Option<(String, bool)>,
}

impl Row {
    /// A row with a time.
    #[must_use]
    pub fn timed(name: impl Into<String>, secs: f64) -> Self {
        Self { name: name.into(), secs: Some(secs), ..Self::default() }
    }

    /// A row without a time.
    #[must_use]
    pub fn figure(name: impl Into<String>, rate: impl Into<String>) -> Self {
        Self { name: name.into(), rate: rate.into(), ..Self::default() }
    }

    /// The row with a rate.
    #[must_use]
    pub fn with_rate(self, rate: impl Into<String>) -> Self {
        Self { rate: rate.into(), ..self }
    }

    /// The row with a comparison.
    #[must_use]
    pub fn with_ratio(self, ratio: impl Into<String>) -> Self {
        Self { ratio: ratio.into(), ..self }
    }

    /// The row with a demand.
    #[must_use]
    pub fn asked(self, demand: impl Into<String>, met: bool) -> Self {
        Self { asked: Some((demand.into(), met)), ..self }
    }

    /// Prints the row.
    pub fn print(&self) {
        let time = self.secs.map_or(String::new(), duration);
        let asked = self.asked.as_ref().map_or(String::new(), |(demand, met)| {
            format!("{demand:<22} {}", if *met { "met" } else { "MISSED" })
        });
        println!(
            "{}",
            format!("{:<58} {time:>10}  {:<20} {:<30} {asked}", self.name, self.rate, self.ratio).trim_end()
        );
    }
}

/// Prints the heading of a section.
pub fn section(title: &str) {
    println!("\n{title}");
    println!("{:<58} {:>10}  {:<20} {:<30} {:<22} result", "  operation", "median", "rate", "ratio", "asked");
}

/// Seconds in a unit that suits.
#[must_use]
pub fn duration(secs: f64) -> String {
    match secs {
        s if s >= 1.0 => format!("{s:.3} s"),
        s if s >= 1e-3 => format!("{:.3} ms", s * 1e3),
        s => format!("{:.3} µs", s * 1e6),
    }
}

/// A share in percent.
#[must_use]
pub fn percent(share: f64) -> String {
    format!("{:.1} %", 100.0 * share)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn durations_and_shares_are_readable() {
        assert_eq!(duration(2.5), "2.500 s");
        assert_eq!(duration(0.0125), "12.500 ms");
        assert_eq!(duration(3e-6), "3.000 µs");
        assert_eq!(percent(0.615), "61.5 %");
    }
}
