//! Variants of the method: named settings. Those of the paper's tables are known by name; a suite file may
//! define more.

use serde::{Deserialize, Serialize};

/// Which table a variant is a row of.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum VariantTable {
    /// Truncated training windows (the paper's Table 2): source and Lagrangian model.
    Windows,
    /// Parts left out or changed (the paper's Table 3): the Lagrangian model.
    #[default]
    Ablations,
}

/// Named settings.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Variant {
    /// Name in suite files and folders.
    pub name: String,
    /// Name in tables.
    pub title: String,
    /// Where it is shown.
    pub table: VariantTable,
    /// What it changes.
    pub settings: Vec<String>,
    /// What it changes besides with some methods: method, setting.
    pub of_method: Vec<(&'static str, &'static str)>,
    /// Why the part may be without effect, for the note below the table; empty if there is nothing to say.
    pub remark: String,
}

/// Name of the variant that changes nothing; every suite has it first.
pub(crate) const FULL: &str = "full";

/// The variants that suite files can name without defining them.
#[must_use]
pub fn known_variants() -> Vec<Variant> {
    use VariantTable::{Ablations, Windows};
    let variant = |name: &str, title: &str, table, settings: &[&str], remark: &str| Variant {
        name: name.to_owned(),
        title: title.to_owned(),
        table,
        settings: settings.iter().map(|s| (*s).to_owned()).collect(),
        of_method: Vec::new(),
        remark: remark.to_owned(),
    };
    vec![
        variant(FULL, "full", Ablations, &[], ""),
        // The velocity field is supervised beyond the deformation's end (G53).
        Variant {
            of_method: vec![("freegave", "source.velocity.max_time=0.45")],
            ..variant("before-0.5", "t < 0.5", Windows, &["data.train_before=0.5"], "")
        },
        Variant {
            of_method: vec![("freegave", "source.velocity.max_time=0.25")],
            ..variant("before-0.3", "t < 0.3", Windows, &["data.train_before=0.3"], "")
        },
        variant(
            "without-stage-3",
            "without stage 3",
            Ablations,
            &["last_stage=2"],
            "the source's Gaussians already fit the images; left out are both refinements, before and \
                after the dynamics are tuned",
        ),
        variant(
            "without-stages-2-3",
            "without stages 2, 3",
            Ablations,
            &["last_stage=1"],
            "a law that distillation has found exactly leaves the images nothing to correct",
        ),
        variant(
            "without-alignment",
            "without alignment",
            Ablations,
            &["motion.alignment=false"],
            "particles that follow one exact law stay together by themselves; without alignment Gaussians \
                keep their orientation (G60)",
        ),
        variant(
            "without-force",
            "without force Q",
            Ablations,
            &["distill.force=none"],
            "the motion is conservative: distillation gives what a potential explains to the potential \
                anyway",
        ),
        variant(
            "without-matching",
            "without acceleration matching",
            Ablations,
            &["distill.matching.steps=0"],
            "matching trains networks, and objects that a linear law explains have none",
        ),
        variant(
            "velocity-from-positions",
            "velocities from positions",
            Ablations,
            &["motion.velocity_policy=from-positions"],
            POLICY,
        ),
        variant(
            "velocity-rigid",
            "velocities of the rigid motion",
            Ablations,
            &["motion.velocity_policy=rigid"],
            POLICY,
        ),
        variant(
            "k-means",
            "objects by k-means",
            Ablations,
            &["partition.method=k-means"],
            "with the right number of clusters both partitions find the same bodies",
        ),
        variant(
            "networks",
            "the paper's networks, no linear law",
            Ablations,
            &["distill.potential=mlp", "distill.force=mlp", "distill.hidden=128"],
            "free-form networks can express every law that the linear one can",
        ),
    ]
}

const POLICY: &str = "objects held rigid as a whole have a policy of their own; the choice concerns \
    aligned neighbourhoods only";
