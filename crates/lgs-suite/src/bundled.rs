//! Suites that the program brings along.

/// A suite file inside of the program.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BundledSuite {
    /// Name to call it by.
    pub name: &'static str,
    /// Contents of the file.
    pub text: &'static str,
}

/// All of them.
#[must_use]
pub fn bundled_suites() -> &'static [BundledSuite] {
    &[
        BundledSuite { name: "synthetic-objects", text: include_str!("../suites/synthetic-objects.toml") },
        BundledSuite { name: "synthetic-indoor", text: include_str!("../suites/synthetic-indoor.toml") },
        BundledSuite { name: "laws", text: include_str!("../suites/laws.toml") },
        BundledSuite { name: "nvfi-objects", text: include_str!("../suites/nvfi-objects.toml") },
        BundledSuite { name: "nvfi-indoor", text: include_str!("../suites/nvfi-indoor.toml") },
    ]
}
