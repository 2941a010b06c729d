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
        BundledSuite { name: "everyday", text: include_str!("../suites/everyday.toml") },
        BundledSuite { name: "machines", text: include_str!("../suites/machines.toml") },
        BundledSuite { name: "nvfi-objects", text: include_str!("../suites/nvfi-objects.toml") },
        BundledSuite { name: "nvfi-indoor", text: include_str!("../suites/nvfi-indoor.toml") },
        BundledSuite { name: "nerf-synthetic-400", text: include_str!("../suites/nerf-synthetic-400.toml") },
        BundledSuite { name: "nerf-synthetic-800", text: include_str!("../suites/nerf-synthetic-800.toml") },
        BundledSuite { name: "d-nerf-400", text: include_str!("../suites/d-nerf-400.toml") },
        BundledSuite { name: "d-nerf-800", text: include_str!("../suites/d-nerf-800.toml") },
    ]
}
