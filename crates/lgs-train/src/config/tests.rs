use std::path::Path;

use super::*;

fn quick(overrides: &[&str]) -> Result<TrainConfig, ConfigError> {
    let overrides: Vec<String> = overrides.iter().map(|s| (*s).to_owned()).collect();
    TrainConfig::resolve(Preset::Quick, None, &overrides)
}

/// The configuration in a run's `config.toml`.
fn read(text: &str) -> TrainConfig {
    let table = crate::layers::parse(text, Path::new("config.toml")).expect("TOML");
    TrainConfig::from_table(Preset::Quick, table).expect("a configuration")
}

#[test]
fn presets_round_trip_through_toml() {
    let all = [Preset::Quick, Preset::Standard, Preset::Paper]
        .into_iter()
        .flat_map(|preset| SourceKind::ALL.map(|kind| (preset, kind)));
    for (preset, kind) in all {
        let mut config = TrainConfig::of(preset, kind, preset.dynamics());
        if kind == SourceKind::Frames {
            config.source.import = "frames".to_owned();
        }
        assert_eq!((config.preset, config.source.kind), (preset, kind));
        let back = read(&config.to_toml().expect("toml"));
        assert_eq!(back, config);
        assert_eq!(back.hash(), config.hash());
    }
    assert_ne!(TrainConfig::preset(Preset::Quick).hash(), TrainConfig::preset(Preset::Paper).hash());
}

#[test]
fn the_first_setting_that_would_change_is_named_with_both_values() {
    let own = quick(&["source.iterations=500", "data.train_before=0.1", "last_stage=2"]).expect("own");
    let changed = |overrides: &[&str]| {
        let overrides: Vec<String> = overrides.iter().map(|s| (*s).to_owned()).collect();
        own.changed_by(None, &overrides)
    };
    let same = ["source.iterations=500", "data.train_before=0.1", "last_stage=2", "checkpoint_secs=5"];
    assert_eq!(changed(&same).expect("settings"), None);
    let found = changed(&["seed=0", "source.iterations=400"]).expect("settings").expect("a difference");
    assert_eq!((&*found.key, &*found.own, &*found.other), ("source.iterations", "500", "400"));
    let found = changed(&["distill.dynamics=networks"]).expect("settings").expect("a difference");
    assert_eq!(found.key, "distill.dynamics");
    assert!(matches!(changed(&["source.iteration=4"]), Err(ConfigError::Unknown { .. })));
    let other = quick(&["seed=3"]).expect("other");
    let found = TrainConfig::preset(Preset::Quick).first_difference(&other).expect("tables");
    assert_eq!(found.map(|found| found.key).as_deref(), Some("seed"));
}

#[test]
fn dynamics_decide_the_defaults_of_stages_and_any_key_can_be_set_on_top() {
    let networks = quick(&["distill.dynamics=networks"]).expect("networks");
    assert_eq!(networks, TrainConfig::of(Preset::Quick, SourceKind::Defgs, DynamicsKind::Networks));
    assert_eq!(networks.source, TrainConfig::preset(Preset::Quick).source);
    assert_eq!((networks.distill.matching.steps, networks.fit_dynamics.steps), (0, 0));
    let matched = quick(&["distill.dynamics=networks", "distill.matching.steps=9"]).expect("matching");
    let mut expected = networks.clone();
    expected.distill.matching.steps = 9;
    assert_eq!(matched, expected);
    let error = quick(&["distill.dynamics=networks", "distill.coordinates=generalised"]).expect_err("mixed");
    assert!(error.to_string().contains("`coordinates` is `generalised`"), "{error}");
    let error = quick(&["distill.dynamics=magic"]).expect_err("unknown").to_string();
    assert!(error.contains("`terms` or `networks`"), "{error}");
    let long = TrainConfig::of(Preset::Paper, SourceKind::Defgs, DynamicsKind::Terms);
    assert_eq!((long.distill.dynamics, long.fit_dynamics.steps), (DynamicsKind::Terms, 3));
}

#[test]
fn overrides_reach_nested_values_of_every_type() {
    let config = quick(&[
        "seed=7",
        "source.iterations = 12",
        "source.learning_rates.sh=1",
        "source.deformation.scale_mode=additive",
        "data.white_background=false",
    ])
    .expect("config");
    assert_eq!((config.seed, config.source.iterations), (7, 12));
    assert_eq!(config.source.learning_rates.sh, 1.0);
    assert_eq!(config.source.deformation.scale_mode, lgs_model::source::ScaleMode::Additive);
    assert!(!config.data.white_background);
    assert_eq!(quick(&["preset=paper"]).expect("paper").source, SourceConfig::paper());
}

#[test]
fn every_mistake_names_its_key() {
    for (given, key) in [
        ("source.iteration=12", "source.iteration"),
        ("source.iterations=many", "source.iterations"),
        ("source.iterations=-3", "source.iterations"),
        ("source.iterations=0", "source.iterations"),
        ("source.ssim_weight=1.5", "source.ssim_weight"),
        ("source.deformation.depth=0", "source.deformation.depth"),
        ("source.deformation.depth.x=0", "source.deformation.depth"),
        ("source.deformation.scale_mode=big", "big"),
        ("preset=slow", "preset"),
        ("source.kind=magic", "source.kind"),
        ("source.velocity.width=8", "source.velocity"),
        ("source.deformation.code=8", "source.deformation.code"),
        ("last_stage=0", "last_stage"),
        ("last_stage=bake", "last_stage"),
        ("data.train_before=-0.5", "data.train_before"),
        ("partition.method=guess", "guess"),
        ("partition.clusters=0", "partition.clusters"),
        ("nothing", "nothing"),
    ] {
        let error = quick(&[given]).expect_err(given).to_string();
        assert!(error.contains(key), "{given}: {error}");
    }
}

#[test]
fn a_kind_of_source_brings_its_own_keys_and_defaults() {
    let config =
        quick(&["source.kind=freegave", "source.velocity.max_time=0.5", "preset=paper"]).expect("config");
    assert_eq!(config.source.velocity.as_ref().map(|v| (v.max_time, v.width)), Some((0.5, 128)));
    assert_eq!((config.source.densify.min_opacity, config.source.window_steps), (0.05, 8));
    for given in [
        "source.deformation.code=0",
        "source.velocity.fps=0",
        "source.velocity.max_time=-1",
        "source.advection.length=0",
        "source.advection.share=2",
    ] {
        let (key, _) = given.split_once('=').expect("a setting");
        let error = quick(&["source.kind=freegave", given]).expect_err(given).to_string();
        assert!(error.contains(key), "{given}: {error}");
    }
}

#[test]
fn the_published_scenes_have_their_settings() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../configs/freegave");
    for (scene, max_time, bases) in
        [("fan", 0.72, 16), ("bat", 0.75, 16), ("chessboard", 0.70, 32), ("factory", 0.70, 32)]
    {
        let config = TrainConfig::resolve(Preset::Quick, Some(&folder.join(format!("{scene}.toml"))), &[])
            .expect(scene);
        assert_eq!(config.preset, Preset::Paper);
        assert_eq!(config.source.velocity.map(|v| v.max_time), Some(max_time));
        assert_eq!(config.source.deformation.code, bases);
    }
    let files = std::fs::read_dir(folder)
        .expect("folder")
        .map(|entry| entry.expect("entry").path())
        .collect::<Vec<_>>();
    assert_eq!(files.len(), 10);
    files.iter().for_each(|path| {
        assert!(TrainConfig::resolve(Preset::Quick, Some(path), &[]).is_ok(), "{}", path.display())
    });
}

#[test]
fn files_that_are_absent_or_not_toml_are_named() {
    let folder = tempfile::tempdir().expect("folder");
    let path = folder.path().join("c.toml");
    let resolve = || TrainConfig::resolve(Preset::Quick, Some(&path), &["seed=3".to_owned()]);
    assert!(resolve().expect_err("absent").to_string().contains("c.toml"));
    std::fs::write(&path, "seed = = 1").expect("write");
    assert!(resolve().expect_err("syntax").to_string().contains("c.toml"));
    std::fs::write(&path, "seed = 1\n[source]\nsh_degree = 2").expect("write");
    let config = resolve().expect("file");
    assert_eq!((config.seed, config.source.sh_degree), (3, 2), "overrides win over the file");
}

#[test]
fn the_last_stage_has_a_name_and_a_number() {
    for (given, stage) in [
        ("last_stage=1", LastStage::Distill),
        ("last_stage=2", LastStage::TuneDynamics),
        ("last_stage=tune-dynamics", LastStage::TuneDynamics),
        ("last_stage=tune-gaussians", LastStage::TuneGaussians),
    ] {
        assert_eq!(quick(&[given]).expect(given).last_stage, stage);
    }
    assert!(!LastStage::TuneDynamics.includes(Stage::RefineGaussians));
    assert!(LastStage::TuneDynamics.includes(Stage::FitDynamics));
}
