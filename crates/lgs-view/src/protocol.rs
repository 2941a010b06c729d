//! Messages between page and server: JSON text from the page, JSON text and frames from the server.

use lgs_dynamics::Edit;
use lgs_eval::laws::ObjectLaw;
use serde::{Deserialize, Serialize};

use crate::curve::{CurvePoint, StepSheet};

/// What a page asks for.
#[derive(Clone, Debug, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub(crate) enum Ask {
    /// A picture; a newer one for the same pane takes its place.
    Frame(FrameRequest),
    /// The object at a pixel of a picture.
    Pick { view: FrameRequest, pixel: [f32; 2] },
    /// Paths of some Gaussians over all times, for overlays.
    Paths { serial: u64, edits: Vec<ObjectEdit> },
    /// The potential of an object on the plane through its centre that faces the camera of a view.
    Slice { view: FrameRequest, object: usize },
    /// What there is to see, again.
    Hello,
    /// How training goes.
    Training,
    /// Pauses training, or lets it go on; it goes on by itself when the last page has left.
    Pause { paused: bool },
}

/// A picture of a scene.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct FrameRequest {
    /// Place of the picture in the page.
    pub(crate) pane: usize,
    /// Number that comes back with the picture.
    pub(crate) serial: u64,
    pub(crate) camera: ViewCamera,
    /// Width and height, pixels.
    pub(crate) size: [u32; 2],
    pub(crate) time: f32,
    pub(crate) model: Model,
    /// One for each object; none: no edit.
    #[serde(default)]
    pub(crate) edits: Vec<ObjectEdit>,
    #[serde(default)]
    pub(crate) quality: Quality,
    #[serde(default)]
    pub(crate) style: Style,
    /// Quality of the JPEG of a moving view, 1 to 100, as the link bears; none: that of a good one.
    #[serde(default)]
    pub(crate) jpeg: Option<u8>,
}

/// A camera of the page.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(untagged, deny_unknown_fields)]
pub(crate) enum ViewCamera {
    /// A camera of the dataset by its number, at its own proportions.
    Dataset { dataset: usize },
    /// A free camera with axes x right, y down, z forward.
    Free {
        /// World units.
        position: [f32; 3],
        /// World from camera, `[w, x, y, z]`.
        rotation: [f32; 4],
        /// Vertical field of view, radians.
        fov_y: f32,
    },
}

/// Which of a run's models is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Model {
    /// The Lagrangian scene.
    Lagrangian,
    /// The source model that it was distilled from.
    Source,
    /// The image of the dataset that is nearest in time, of a dataset camera.
    Truth,
}

/// How carefully a picture is encoded.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Quality {
    /// JPEG for a moving view.
    #[default]
    Moving,
    /// JPEG for a view at rest.
    Still,
    /// PNG: the very pixels that `render` writes.
    Exact,
}

/// How Gaussians are drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Style {
    /// As trained.
    #[default]
    Color,
    /// Each object in a colour of its own, static Gaussians in grey.
    Objects,
    /// Small opaque spheres at the centres.
    Points,
    /// Nearly opaque ellipsoids of two standard deviations.
    Ellipsoids,
}

/// The edit of one object's physics.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub(crate) struct ObjectEdit {
    /// α.
    pub(crate) velocity: f32,
    /// β.
    pub(crate) potential: f32,
    /// γ.
    pub(crate) force: f32,
    /// A factor of each term of the law, in order; none: all 1.
    pub(crate) terms: Vec<f64>,
}

impl Default for ObjectEdit {
    fn default() -> Self {
        Self { velocity: 1.0, potential: 1.0, force: 1.0, terms: Vec::new() }
    }
}

impl ObjectEdit {
    /// The edit of velocity, potential and force.
    pub(crate) fn scales(&self) -> Edit {
        Edit { velocity_scale: self.velocity, potential_scale: self.potential, force_scale: self.force }
    }

    /// Whether nothing is edited.
    pub(crate) fn is_none(&self) -> bool {
        self.scales() == Edit::default() && self.terms.iter().all(|factor| *factor == 1.0)
    }
}

/// What a page is told first.
#[derive(Debug, Serialize)]
pub(crate) struct Hello {
    pub(crate) kind: &'static str,
    pub(crate) title: String,
    /// The run's folder, as a command line names it.
    pub(crate) run: String,
    /// First and last time that can be asked for.
    pub(crate) times: [f32; 2],
    /// End of the captured window.
    pub(crate) window: f32,
    pub(crate) background: [f32; 3],
    pub(crate) models: Vec<Model>,
    pub(crate) objects: Vec<ObjectSheet>,
    pub(crate) cameras: Vec<CameraSheet>,
    /// A free camera to begin with.
    pub(crate) start: StartCamera,
    /// Parts of the run that are missing, in words.
    pub(crate) missing: Vec<String>,
    /// Whether the run is being trained.
    pub(crate) training: bool,
}

/// A potential over a picture.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct Slice {
    /// Columns and rows of the samples.
    pub(crate) size: [usize; 2],
    /// The potential at the middles of cells, row by row, 0 to 1 over `range`.
    pub(crate) values: Vec<f32>,
    /// Least and largest potential, per mass.
    pub(crate) range: [f64; 2],
    /// Forces −∇U as arrows, both ends in parts of the picture's sides.
    pub(crate) arrows: Vec<[f32; 4]>,
}

/// How training goes.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct TrainingSheet {
    /// Number of the subject on view: pictures of an older one are out of date.
    pub(crate) subject: u64,
    pub(crate) step: Option<StepSheet>,
    /// Seconds that the stage takes yet.
    pub(crate) eta_secs: Option<f32>,
    /// Part of the last seconds that serving took.
    pub(crate) share: f32,
    pub(crate) paused: bool,
    pub(crate) curve: Vec<CurvePoint>,
}

/// An object, as the physics panel shows it.
#[derive(Debug, Serialize)]
pub(crate) struct ObjectSheet {
    pub(crate) gaussians: usize,
    pub(crate) color: [f32; 3],
    pub(crate) law: Option<ObjectLaw>,
}

/// A camera of the dataset, as a free camera.
#[derive(Debug, Serialize)]
pub(crate) struct CameraSheet {
    pub(crate) name: String,
    pub(crate) position: [f32; 3],
    pub(crate) rotation: [f32; 4],
    pub(crate) fov_y: f32,
    pub(crate) size: [u32; 2],
}

/// A camera and the point that it looks at.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct StartCamera {
    pub(crate) position: [f32; 3],
    pub(crate) target: [f32; 3],
    /// Direction that the page holds upwards, unit length.
    pub(crate) up: [f32; 3],
    pub(crate) fov_y: f32,
}

/// Header of a frame; the bytes of the picture follow it.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct FrameHeader {
    pub(crate) pane: usize,
    pub(crate) serial: u64,
    /// Time that the picture shows: nearer to 0 than asked for while the motion is still being rolled out.
    pub(crate) time: f32,
    /// Whether a later picture of the same request follows.
    pub(crate) rolling: bool,
    /// Numbers of the objects whose motion is not trusted at that time.
    pub(crate) untrusted: Vec<usize>,
    /// First and last time at which all is trusted under the edits; nothing where there is nothing to trust.
    pub(crate) trusted: Option<[f64; 2]>,
    pub(crate) size: [u32; 2],
    pub(crate) mime: &'static str,
    /// Time that drawing and encoding took, milliseconds.
    pub(crate) milliseconds: f32,
    /// Memory of kept rollouts and its bound, bytes.
    pub(crate) kept: [usize; 2],
}

/// An answer in JSON.
#[derive(Clone, Debug, Serialize)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub(crate) enum Answer {
    /// The object at a pixel: its number, or none where the background or static Gaussians cover it.
    Picked { serial: u64, object: Option<usize> },
    /// Paths `[gaussian][time]` at common times.
    Paths { serial: u64, times: Vec<f32>, objects: Vec<usize>, points: Vec<Vec<[f32; 3]>> },
    /// A potential over a picture.
    Slice { serial: u64, object: usize, slice: Slice },
    /// How training goes.
    Training(TrainingSheet),
    /// Why a request has no answer.
    Refused { pane: usize, serial: u64, reason: String },
}
