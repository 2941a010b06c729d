//! `lagrangian.safetensors`: a Lagrangian scene as one file.

use std::path::Path;

use super::dynamics_file::{insert_dynamics, json, read_dynamics};
use super::recording_file::{insert_recording, read_recording};
use super::{LagrangianScene, MotionConfig, ObjectContact, ObjectModel};
use crate::light::Light;
use crate::shading::Shading;
use crate::tensor_file::{TensorFile, TensorFileError};
use lgs_core::{CloudError, GaussianCloud};

/// Format name and version of the file.
const FORMAT: &str = "lagrangegs-scene/2";
/// The version before, whose objects all have the dynamics of particles.
const FORMAT_OF_PARTICLES: &str = "lagrangegs-scene/1";

/// Name under which objects that hit each other are kept.
const CONTACT: &str = "contact";
/// Name under which shadows are kept.
const SHADOWS: &str = "shadows";

/// Why a scene could not be written or read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SceneError {
    /// The file itself.
    #[error(transparent)]
    File(#[from] TensorFileError),
    /// The Gaussians do not fit together.
    #[error("{part} Gaussians: {source}: {path}")]
    Cloud {
        /// File.
        path: std::path::PathBuf,
        /// Static or moving.
        part: &'static str,
        /// Defect.
        source: CloudError,
    },
}

impl SceneError {
    /// The file that the error is about.
    #[must_use]
    pub fn path(&self) -> &Path {
        match self {
            Self::File(error) => error.path(),
            Self::Cloud { path, .. } => path,
        }
    }
}

/// Adds a cloud's arrays under a prefix.
pub fn insert_cloud(file: &mut TensorFile, prefix: &str, cloud: &GaussianCloud) {
    let n = cloud.len();
    file.insert(format!("{prefix}.means"), &[n, 3], cloud.means.as_flattened());
    file.insert(format!("{prefix}.rotations"), &[n, 4], cloud.rotations.as_flattened());
    file.insert(format!("{prefix}.log_scales"), &[n, 3], cloud.log_scales.as_flattened());
    file.insert(format!("{prefix}.raw_opacities"), &[n, 1], &cloud.raw_opacities);
    file.insert(format!("{prefix}.sh"), &[n, cloud.sh_stride() / 3, 3], &cloud.sh);
}

/// Reads the arrays that [`insert_cloud`] wrote.
///
/// # Errors
/// If an array is absent or has another shape.
pub fn read_cloud(file: &TensorFile, prefix: &str) -> Result<GaussianCloud, TensorFileError> {
    let name = format!("{prefix}.sh");
    let (shape, sh) = file.values(&name)?;
    let degree =
        (0..=3).find(|&d| shape.len() == 3 && shape[1] == lgs_core::sh_coefficients(d) && shape[2] == 3);
    let Some(sh_degree) = degree else {
        return Err(file.field(&name, "shape [n, 1 | 4 | 9 | 16, 3]", format!("{shape:?}")));
    };
    Ok(GaussianCloud {
        means: file.rows(&format!("{prefix}.means"))?,
        rotations: file.rows(&format!("{prefix}.rotations"))?,
        log_scales: file.rows(&format!("{prefix}.log_scales"))?,
        raw_opacities: file.rows::<1>(&format!("{prefix}.raw_opacities"))?.into_iter().map(|[o]| o).collect(),
        sh: sh.to_vec(),
        sh_degree,
    })
}

/// Writes a scene, atomically.
///
/// # Errors
/// If the file cannot be written.
pub fn save_scene(scene: &LagrangianScene, path: &Path) -> Result<(), SceneError> {
    Ok(scene_to_tensors(scene, FORMAT).save(path)?)
}

/// Reads a scene.
///
/// # Errors
/// If the file cannot be read, is damaged, of another version, or its arrays do not fit together.
pub fn load_scene(path: &Path) -> Result<LagrangianScene, SceneError> {
    let file = TensorFile::load_one_of(path, &[FORMAT, FORMAT_OF_PARTICLES])?;
    scene_from_tensors(&file, path)
}

/// A scene as named tensors; also the body of a checkpoint.
#[must_use]
pub fn scene_to_tensors(scene: &LagrangianScene, format: &str) -> TensorFile {
    let mut file = TensorFile::new(format);
    insert_cloud(&mut file, "static", &scene.static_gaussians);
    insert_cloud(&mut file, "dynamic", &scene.dynamic_gaussians);
    file.insert("dynamic.velocities", &[scene.dynamic_gaussians.len(), 3], scene.velocities.as_flattened());
    file.insert("background", &[1, 3], &scene.background);
    if let Some(shading) = &scene.shading {
        shading.insert_into(&mut file);
    }
    if let Some(light) = &scene.light {
        light.insert_into(&mut file);
    }
    file.set_metadata("motion", json(&scene.motion));
    file.set_metadata("objects", scene.objects.len().to_string());
    if let Some(contact) = &scene.contact {
        file.set_metadata(CONTACT, json(contact));
    }
    if !scene.shadows.is_empty() {
        file.set_metadata(SHADOWS, json(&scene.shadows));
    }
    for (index, object) in scene.objects.iter().enumerate() {
        let rows = [object.members.start as u32, object.members.end as u32];
        file.insert_indices(format!("object.{index}.rows"), &[2], &rows);
        insert_dynamics(&mut file, &format!("object.{index}"), &object.dynamics, object.members.len());
        if let Some(recording) = &object.recording {
            insert_recording(&mut file, &format!("object.{index}.recording"), recording);
        }
    }
    file
}

/// The scene that [`scene_to_tensors`] stored.
///
/// # Errors
/// If a part is absent or does not fit.
pub fn scene_from_tensors(file: &TensorFile, path: &Path) -> Result<LagrangianScene, SceneError> {
    let static_gaussians = read_cloud(file, "static")?;
    let dynamic_gaussians = read_cloud(file, "dynamic")?;
    for (part, cloud) in [("static", &static_gaussians), ("moving", &dynamic_gaussians)] {
        cloud.validate().map_err(|source| SceneError::Cloud { path: path.to_owned(), part, source })?;
    }
    let velocities = file.rows("dynamic.velocities")?;
    if velocities.len() != dynamic_gaussians.len() {
        let expected = format!("{} rows", dynamic_gaussians.len());
        return Err(file.field("dynamic.velocities", &expected, velocities.len().to_string()).into());
    }
    let background = file.rows::<3>("background")?.first().copied().unwrap_or([1.0; 3]);
    let motion = read_motion(file)?;
    let objects = read_objects(file, dynamic_gaussians.len())?;
    let shading = Shading::read_from(file, static_gaussians.len() + dynamic_gaussians.len())?;
    let light = Light::read_from(file, dynamic_gaussians.len())?;
    let mut scene = LagrangianScene {
        dynamic_gaussians,
        velocities,
        objects,
        shading,
        light,
        ..LagrangianScene::still(static_gaussians, motion, background)
    };
    if file.metadata(CONTACT).is_ok() {
        scene.contact = Some(read_contact(file, &scene)?);
    }
    if file.metadata(SHADOWS).is_ok() {
        scene.shadows = file.metadata_json(SHADOWS)?;
        check_shadows(file, &scene)?;
    }
    Ok(scene)
}

fn check_shadows(file: &TensorFile, scene: &LagrangianScene) -> Result<(), TensorFileError> {
    match scene.shadows.iter().find_map(|shadow| shadow.misfit(scene)) {
        Some(found) => Err(file.field(SHADOWS, "objects of the scene, each cast by another", found)),
        None => Ok(()),
    }
}

fn read_contact(file: &TensorFile, scene: &LagrangianScene) -> Result<ObjectContact, TensorFileError> {
    let contact: ObjectContact = file.metadata_json(CONTACT)?;
    match contact.misfit(scene) {
        Some(found) => Err(file.field(CONTACT, "bodies that objects of the scene are", found)),
        None => Ok(contact),
    }
}

fn read_motion(file: &TensorFile) -> Result<MotionConfig, TensorFileError> {
    let motion: MotionConfig = file.metadata_json("motion")?;
    let sane = motion.dt > 0.0
        && motion.dt.is_finite()
        && motion.time_window > 0.0
        && motion.time_window / motion.dt < 1e6;
    if sane {
        Ok(motion)
    } else {
        Err(file.field("motion", "a positive step and window", format!("{motion:?}")))
    }
}

/// All objects, whose rows follow each other and end with those of the dynamic Gaussians.
fn read_objects(file: &TensorFile, dynamic_gaussians: usize) -> Result<Vec<ObjectModel>, TensorFileError> {
    let count: usize = file.metadata_json("objects")?;
    let mut objects = Vec::new();
    let mut next_row = 0;
    for index in 0..count {
        let object = read_object(file, index, next_row, dynamic_gaussians)?;
        next_row = object.members.end;
        objects.push(object);
    }
    if next_row != dynamic_gaussians {
        let expected = format!("rows up to {dynamic_gaussians}");
        return Err(file.field("objects", &expected, next_row.to_string()));
    }
    Ok(objects)
}

fn read_object(
    file: &TensorFile,
    index: usize,
    first_row: usize,
    dynamic_gaussians: usize,
) -> Result<ObjectModel, TensorFileError> {
    let prefix = format!("object.{index}");
    let rows_name = format!("{prefix}.rows");
    let (_, rows) = file.indices(&rows_name)?;
    if let &[start, _] = rows
        && (start as usize) < first_row
    {
        let expected = format!("Gaussians of its own, from row {first_row} on");
        let found = format!("row {start}, which object {} has already", index.saturating_sub(1));
        return Err(file.field(&rows_name, &expected, found));
    }
    let members = match rows {
        &[start, end] if start as usize == first_row && start <= end && end as usize <= dynamic_gaussians => {
            start as usize..end as usize
        }
        _ => {
            return Err(file.field(
                &rows_name,
                &format!("a range from {first_row} within {dynamic_gaussians}"),
                format!("{rows:?}"),
            ));
        }
    };
    let dynamics = read_dynamics(file, &prefix, members.len())?;
    let recording = read_recording(file, &format!("{prefix}.recording"), members.len())?;
    Ok(ObjectModel { members, dynamics, recording })
}
