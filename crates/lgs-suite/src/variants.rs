//! Variants of the method: named settings. Those of the paper's tables are known by name; a suite file may
//! define more.

use serde::{Deserialize, Serialize};

/// The table that a variant is a row of.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum VariantTable {
    /// Truncated training windows (the paper's Table 2): source and Lagrangian model.
    Windows,
    /// Parts left out or changed (the paper's Table 3): the Lagrangian model.
    #[default]
    Ablations,
    /// Other systems than the full method's, such as networks in place of terms: side by side with the
    /// source.
    Systems,
    /// Parts left out of the paper's networks (the paper's Table 3 to the letter), beside the row `networks`.
    Networks,
}

/// Named settings.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Variant {
    /// Name in suite files and folders.
    pub name: String,
    /// Name in tables.
    pub title: String,
    /// The table that it is a row of.
    pub table: VariantTable,
    /// Its settings.
    pub settings: Vec<String>,
    /// Further settings with some methods: method, setting.
    pub of_method: Vec<(&'static str, &'static str)>,
    /// Why the part may be without effect, for the note below the table; empty if there is nothing to say.
    pub remark: String,
}

/// Name of the variant that changes nothing; every suite has it first.
pub(crate) const FULL: &str = "full";
/// Name of the variant that is the paper's system.
pub(crate) const PUBLISHED: &str = "networks";

/// A variant as it is listed here: name, title, settings, remark.
type Listed = (&'static str, &'static str, &'static [&'static str], &'static str);

/// Truncated training windows, each with the end of the window up to which a velocity field is supervised,
/// which for FreeGave lies beyond the deformation's end.
const WINDOWS: [(&str, &str, &str, &str); 2] = [
    ("before-0.5", "t < 0.5", "data.train_before=0.5", "source.velocity.max_time=0.45"),
    ("before-0.3", "t < 0.3", "data.train_before=0.3", "source.velocity.max_time=0.25"),
];

const ABLATIONS: [Listed; 8] = [
    (
        "without-stage-3",
        "without stage 3",
        &["last_stage=2"],
        "the source's Gaussians already fit the images; left out are both refinements, before and after the \
        dynamics are tuned",
    ),
    (
        "without-stages-2-3",
        "without stages 2, 3",
        &["last_stage=1"],
        "a law that distillation has found exactly leaves the images nothing to correct",
    ),
    (
        "without-alignment",
        "without alignment",
        &["motion.alignment=false"],
        "particles that follow one exact law stay together by themselves; without alignment Gaussians keep \
        their orientation",
    ),
    (
        "without-force",
        "without force Q",
        &["distill.force=none"],
        "the motion is conservative: distillation gives what a potential explains to the potential anyway",
    ),
    (
        "without-matching",
        "without acceleration matching",
        &["distill.matching.steps=0"],
        "matching trains networks, and objects that a linear law explains have none",
    ),
    (
        "velocity-from-positions",
        "velocities from positions",
        &["motion.velocity_policy=from-positions"],
        POLICY,
    ),
    ("velocity-rigid", "velocities of the rigid motion", &["motion.velocity_policy=rigid"], POLICY),
    (
        "k-means",
        "objects by k-means",
        &["partition.method=k-means"],
        "with the right number of clusters both partitions find the same bodies",
    ),
];

/// The settings of the paper's system.
const NETWORKS: &str = "distill.dynamics=networks";
/// The settings that the variants of the paper's system add.
const MATCHING: &str = "distill.matching.steps=600";
const DENOISED: [&str; 2] = ["distill.rollout.targets=denoised", "distill.shared_motion=auto"];
const STRUCTURED: &str = "distill.force=structured";

const SYSTEMS: [Listed; 6] = [
    (PUBLISHED, "networks as published", &[NETWORKS], ""),
    ("networks-matching", "networks, accelerations matched first", &[NETWORKS, MATCHING], ""),
    ("networks-denoised", "networks, trajectories denoised", &[NETWORKS, DENOISED[0], DENOISED[1]], ""),
    ("networks-structured", "networks, structured force", &[NETWORKS, STRUCTURED], ""),
    (
        "networks-improved",
        "networks improved (all three)",
        &[NETWORKS, MATCHING, DENOISED[0], DENOISED[1], STRUCTURED],
        "",
    ),
    ("terms", "terms", &["distill.dynamics=terms", "distill.neural_remainder=false"], ""),
];

/// The rows of the paper's Table 3 to the letter; without alignment is without Eq. 6, and nothing else.
const PARTS: [Listed; 4] = [
    ("networks-without-stage-3", "without stage 3", &[NETWORKS, "last_stage=2"], ""),
    ("networks-without-stages-2-3", "without stages 2, 3", &[NETWORKS, "last_stage=1"], ""),
    ("networks-without-alignment", "without alignment (Eq. 6)", &[NETWORKS, "motion.alignment=false"], ""),
    ("networks-without-force", "without force Q", &[NETWORKS, "distill.force=none"], ""),
];

const POLICY: &str = "objects under the rigid constraint have a policy of their own; the choice concerns \
    aligned neighbourhoods only";

/// The variants that suite files can name without defining them.
#[must_use]
pub fn known_variants() -> Vec<Variant> {
    let listed = |table| {
        move |(name, title, settings, remark): Listed| Variant {
            name: name.to_owned(),
            title: title.to_owned(),
            table,
            settings: settings.iter().map(|s| (*s).to_owned()).collect(),
            of_method: Vec::new(),
            remark: remark.to_owned(),
        }
    };
    let ablation = listed(VariantTable::Ablations);
    let window = |(name, title, setting, of_freegave)| Variant {
        settings: vec![String::from(setting)],
        of_method: vec![("freegave", of_freegave)],
        ..listed(VariantTable::Windows)((name, title, &[], ""))
    };
    let full = ablation((FULL, "full", &[], ""));
    let others = WINDOWS.map(window).into_iter().chain(ABLATIONS.map(ablation));
    let systems = SYSTEMS.map(listed(VariantTable::Systems));
    let parts = PARTS.map(listed(VariantTable::Networks));
    std::iter::once(full).chain(others).chain(systems).chain(parts).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use lgs_train::{Preset, TrainConfig};

    #[test]
    fn every_variant_is_a_configuration_of_its_own() {
        for preset in [Preset::Quick, Preset::Paper] {
            let of = |variant: &Variant| TrainConfig::resolve(preset, None, &variant.settings);
            let all: Vec<TrainConfig> =
                known_variants().iter().map(|variant| of(variant).expect(&variant.name)).collect();
            let quick = preset == Preset::Quick;
            let twins = (0..all.len()).filter(|&i| all[..i].contains(&all[i])).count();
            assert!(twins == 0 || !quick, "{twins} variants change nothing");
        }
    }
}
