use super::*;
use crate::source::SourceModel;
use lgs_core::GaussianCloud;
use lgs_core::testing::{assert_values_close, pseudo_random_within};
use lgs_data::ply::write_ply;
use lgs_data::testing::{CheckpointEntry, checkpoint, checkpoint_archive};

type Tensors = Vec<(String, Vec<usize>, Vec<f32>)>;

/// A model of ours and the state dictionary that the authors' program would have written of it.
fn model(config: DeformationConfig) -> (DefGs, Tensors) {
    let means: Vec<[f32; 3]> =
        (0..30).map(|i| [(i as f32).sin(), (i as f32).cos(), 0.1 * i as f32]).collect();
    let deformation = Deformation::init(config, InputFrame::IDENTITY, 3);
    let mut tensors = Vec::new();
    for param in deformation.config.layout().params() {
        let values = &deformation.params[param.range.clone()];
        let (layer, part) = param.name.rsplit_once('.').expect("a layer's part");
        if layer == "head" {
            let (mut rest, per_output) = (values, values.len() / DELTAS);
            for (name, outputs) in HEADS {
                let (own, after) = rest.split_at(outputs * per_output);
                tensors.push((
                    format!("{name}.{part}"),
                    [&[outputs], &param.shape[1..]].concat(),
                    own.to_vec(),
                ));
                rest = after;
            }
        } else {
            let name = layer
                .replace("layer.", "linear.")
                .replace("time.1", "timenet.2")
                .replace("time.0", "timenet.0");
            tensors.push((format!("{name}.{part}"), param.shape, values.to_vec()));
        }
    }
    (DefGs { canonical: GaussianCloud::isotropic(means, 0.05, [0.3, 0.5, 0.7], 0.6), deformation }, tensors)
}

fn write(folder: &Path, model: &DefGs, tensors: &Tensors) -> PathBuf {
    for (iteration, part) in
        [(7, "point_cloud"), (7, "deform"), (20, "point_cloud"), (20, "deform"), (100, "point_cloud")]
    {
        std::fs::create_dir_all(folder.join(part).join(format!("iteration_{iteration}"))).expect("folder");
    }
    write_ply(&folder.join("point_cloud/iteration_20/point_cloud.ply"), &model.canonical).expect("ply");
    let entries: Vec<_> =
        tensors.iter().map(|(name, shape, v)| (name.as_str(), CheckpointEntry::Tensor(shape, v))).collect();
    let path = folder.join("deform/iteration_20/deform.pth");
    std::fs::write(&path, checkpoint(&entries)).expect("pth");
    path
}

#[test]
fn both_of_the_authors_networks_move_gaussians_as_ours_does() {
    let real = DeformationConfig { time_features: 0, time_frequencies: 10, ..DeformationConfig::paper() };
    for config in [DeformationConfig::paper(), real] {
        let folder = tempfile::tempdir().expect("folder");
        let (model, tensors) = model(config);
        write(folder.path(), &model, &tensors);
        assert!(is_official_defgs(folder.path()));
        let OfficialDefGs { model: read, iteration, settings } =
            read_official_defgs(folder.path()).expect("read");
        assert_eq!((iteration, settings), (20, None));
        assert_eq!(read.deformation, model.deformation);
        assert_eq!(read.cloud_at(0.4), model.cloud_at(0.4));
    }
}

/// The two forms of the authors' network.
#[derive(Clone, Copy, PartialEq)]
enum Scenes {
    Synthetic,
    Real,
}

/// A state dictionary as the authors' program shapes it, filled with pseudo-random numbers in ±1/√fan-in
/// by layer seed.
fn pseudo_random_dictionary(scenes: Scenes) -> Tensors {
    let input = 63 + if scenes == Scenes::Synthetic { 30 } else { 21 };
    let mut layers =
        vec![("gaussian_warp".to_owned(), 3, 256, 30), ("gaussian_rotation".to_owned(), 4, 256, 31)];
    layers.push(("gaussian_scaling".to_owned(), 3, 256, 32));
    for i in 0..8 {
        let inputs = [input, 256, 256, 256, 256, 256 + input, 256, 256][i];
        layers.push((format!("linear.{i}"), 256, inputs, i as u32));
    }
    if scenes == Scenes::Synthetic {
        layers.extend([("timenet.0".to_owned(), 256, 13, 20), ("timenet.2".to_owned(), 30, 256, 22)]);
    }
    let both = |(name, outputs, inputs, seed): (String, usize, usize, u32)| {
        let values = |count, seed| pseudo_random_within(1.0 / (inputs as f64).sqrt(), count, seed);
        let weight =
            (format!("{name}.weight"), vec![outputs, inputs], values(outputs * inputs, 2 * seed + 1));
        [weight, (format!("{name}.bias"), vec![outputs], values(outputs, 2 * seed + 2))]
    };
    layers.into_iter().flat_map(both).collect()
}

/// Rows of centre, quaternion and scales at t = 0.4 with the time network of synthetic scenes.
const SYNTHETIC: [[f32; 10]; 2] = [
    [
        0.333_739_93,
        -0.203_551_24,
        0.478_764_06,
        0.927_090_2,
        0.214_190_04,
        -0.073_433_29,
        0.298_720_55,
        -1.177_055_2,
        -1.152_16,
        -0.889_162_1,
    ],
    [
        -0.664_595_4,
        0.406_478_04,
        0.079_098_93,
        0.522_329_4,
        0.502_250_2,
        -0.456_025_5,
        0.516_679_3,
        -1.128_452,
        -1.216_038,
        -0.856_291_5,
    ],
];

/// The same rows with the network of real scenes, which reads the encoded time itself.
const REAL: [[f32; 10]; 2] = [
    [
        0.323_899_7,
        -0.190_575_1,
        0.500_625_2,
        0.923_407_2,
        0.213_134_11,
        -0.078_616_72,
        0.309_374_25,
        -1.213_048,
        -1.168_416_4,
        -0.840_693_5,
    ],
    [
        -0.660_312_6,
        0.398_558_3,
        0.083_508_94,
        0.496_363_38,
        0.509_882_4,
        -0.483_721_08,
        0.509_565_7,
        -1.241_997,
        -1.148_415,
        -0.872_900_6,
    ],
];

/// Expected values: the published network written down in numpy, float64, fed the same pseudo-random
/// numbers.
#[test]
fn both_networks_agree_with_an_independent_implementation() {
    let canonical = GaussianCloud {
        rotations: vec![[1.0, 0.2, -0.1, 0.4], [0.5, 0.5, -0.5, 0.6]],
        log_scales: vec![[-1.0; 3]; 2],
        ..GaussianCloud::isotropic(vec![[0.3, -0.2, 0.5], [-0.7, 0.4, 0.1]], 0.1, [0.5; 3], 0.6)
    };
    for (scenes, expected) in [(Scenes::Synthetic, SYNTHETIC), (Scenes::Real, REAL)] {
        let folder = tempfile::tempdir().expect("folder");
        let (mut model, _) = model(DeformationConfig::paper());
        model.canonical = canonical.clone();
        write(folder.path(), &model, &pseudo_random_dictionary(scenes));
        let cloud = read_official_defgs(folder.path()).expect("read").model.cloud_at(0.4);
        let rows = (0..2)
            .flat_map(|i| [cloud.means[i].as_slice(), &cloud.rotations[i], &cloud.log_scales[i]].concat());
        assert_values_close("Gaussians", &rows.collect::<Vec<f32>>(), expected.as_flattened(), 2e-5, 1e-5);
    }
}

#[test]
fn what_is_wrong_with_a_folder_is_named() {
    let folder = tempfile::tempdir().expect("folder");
    let (model, mut tensors) = model(DeformationConfig::paper());
    let path = write(folder.path(), &model, &tensors);
    let refused = |word: &str| {
        let text = read_official_defgs(folder.path()).expect_err(word).to_string();
        assert!(text.contains(word) && text.contains(&folder.path().display().to_string()), "{text}");
    };
    let whole = std::fs::read(&path).expect("bytes");
    std::fs::write(&path, &whole[..whole.len() - 5]).expect("cut");
    refused("deform.pth");
    let at =
        tensors.iter().position(|(name, ..)| name == "linear.5.weight").expect("the layer after the skip");
    let skip = std::mem::replace(
        &mut tensors[at],
        ("linear.5.weight".to_owned(), vec![256, 256], vec![0.0; 256 * 256]),
    );
    write(folder.path(), &model, &tensors);
    refused("`linear.5.weight`");
    tensors[at] = skip;
    tensors.push(("branch_w.weight".to_owned(), vec![3, 256], vec![0.0; 768]));
    write(folder.path(), &model, &tensors);
    refused("six-degrees-of-freedom");
    tensors.pop();
    tensors.retain(|(name, ..)| name != "gaussian_scaling.bias");
    write(folder.path(), &model, &tensors);
    refused("`gaussian_scaling.bias`");
    std::fs::remove_dir_all(folder.path().join("deform/iteration_20")).expect("remove");
    std::fs::remove_dir_all(folder.path().join("deform/iteration_7")).expect("remove");
    refused("found N of 7, 20, 100 and of none");
    std::fs::remove_dir_all(folder.path().join("point_cloud")).expect("remove");
    refused("the folder `point_cloud` (the Gaussians");
    std::fs::remove_dir_all(folder.path().join("deform")).expect("remove");
    assert!(!is_official_defgs(folder.path()));
    std::fs::write(folder.path().join("cfg_args"), "Namespace(").expect("settings");
    assert!(is_official_defgs(folder.path()), "what is left of an output is one");
}

/// Every file of an output folder, in the forms that the program writes: the network as an archive from a
/// graphics card, of the sizes that its options give.
#[test]
fn whole_folders_of_every_size_are_read() {
    let paper = DeformationConfig::paper();
    // Inputs: 21 numbers of 3 frequencies and 21 of time; 63 and 21; 63 and 30 of the time network.
    let real = DeformationConfig { time_features: 0, time_frequencies: 10, ..paper.clone() };
    let small = DeformationConfig { position_frequencies: 3, ..real.clone() };
    for (config, inputs) in [(small, 42), (real, 84), (paper, 93)] {
        for width in [16, 128, 512] {
            let config = DeformationConfig { width, depth: 8, ..config.clone() };
            assert_eq!(config.position_width() + config.time_width(), inputs);
            let folder = tempfile::tempdir().expect("folder");
            let (model, tensors) = model(config);
            let path = write(folder.path(), &model, &tensors);
            let entries: Vec<_> = tensors
                .iter()
                .map(|(name, shape, v)| (name.as_str(), shape.as_slice(), v.as_slice()))
                .collect();
            std::fs::write(path, checkpoint_archive("deform", &entries)).expect("pth");
            let settings = "Namespace(sh_degree=3, source_path='/data/cut-lemon', white_background=False)";
            std::fs::write(folder.path().join("cfg_args"), settings).expect("cfg_args");
            std::fs::write(folder.path().join("cameras.json"), "[]").expect("cameras");
            let read = read_official_defgs(folder.path()).expect("read");
            assert_eq!(read.model, model, "{inputs} inputs, width {width}");
            assert_eq!(read.settings.and_then(|settings| settings.white_background), Some(false));
        }
    }
}
