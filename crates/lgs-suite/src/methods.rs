//! Source models that a suite can compare.

/// A source model by name; every one gives a pair of rows, the source and its Lagrangian model.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Method {
    /// Name in suite files and folders.
    pub name: &'static str,
    /// Name in tables.
    pub title: &'static str,
    /// Settings that choose it.
    pub settings: &'static [&'static str],
}

/// All methods.
#[must_use]
pub fn methods() -> &'static [Method] {
    &[
        Method { name: "defgs", title: "DefGS", settings: &["source.kind=defgs"] },
        Method { name: "freegave", title: "FreeGave", settings: &["source.kind=freegave"] },
        Method { name: "nodes", title: "control nodes", settings: &["source.kind=nodes"] },
    ]
}

/// A method by name.
pub(crate) fn method(name: &str) -> Option<Method> {
    methods().iter().copied().find(|method| method.name == name)
}
