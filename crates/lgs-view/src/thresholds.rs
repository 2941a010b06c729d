//! Numbers of the viewer that are choices, in one place.

/// Steps by which a rollout grows while a picture waits for it: some ten milliseconds of most scenes.
pub(crate) const CHUNK_STEPS: usize = 25;
/// Largest scale of a velocity, potential or force, as on the command line.
pub(crate) const LARGEST_SCALE: f32 = 10.0;
/// Quality of JPEG pictures of a moving view, 0 to 100: artefacts show only when looked for.
pub(crate) const MOVING_QUALITY: u8 = 80;
/// Quality of JPEG pictures of a view at rest.
pub(crate) const STILL_QUALITY: u8 = 95;
/// Widest and highest picture, pixels.
pub(crate) const LARGEST_SIDE: u32 = 4096;
/// Most panes of a page.
pub(crate) const MOST_PANES: usize = 4;
/// Largest message of a page, bytes: a scene of a thousand edited objects takes less.
pub(crate) const LARGEST_MESSAGE: usize = 256 * 1024;
/// Paths drawn over a picture, and times of each.
pub(crate) const PATHS: usize = 160;
/// Times of each path.
pub(crate) const PATH_TIMES: usize = 65;
/// Radius of a point over the distance to the centre of the scene from its start camera.
pub(crate) const POINT_RADIUS: f32 = 0.0025;
/// Opacity logit of points and ellipsoids: 0.99.
pub(crate) const SOLID_LOGIT: f32 = 4.6;
/// Factor of the standard deviations of ellipsoids: their surface, where a solid Gaussian turns opaque,
/// lies near this multiple of the trained one.
pub(crate) const ELLIPSOID_SCALE: f32 = 0.7;
/// Share of a pixel's light that an object must give to be the one that is picked.
pub(crate) const PICKED_SHARE: f32 = 0.2;
/// Cosine of the angle, 45°, within which the mean upward direction of cameras is taken for an axis of the
/// world: cameras on a hemisphere lean inwards, all around the axis.
pub(crate) const NEARLY_UPRIGHT: f32 = 0.707;
/// Columns of the samples of a potential over a picture; rows follow from its sides.
pub(crate) const SLICE_COLUMNS: usize = 48;
/// Columns of force arrows over a picture.
pub(crate) const SLICE_ARROWS: usize = 15;
/// Length of the longest of them over that of a cell, so that heads and feet do not touch.
pub(crate) const SLICE_ARROW_LENGTH: f32 = 0.75;
/// Seconds for which a page counts as looking after it has asked how training goes; pages ask every second.
pub(crate) const LOOKING_SECS: u64 = 4;
/// Least seconds between two snapshots of models in training.
pub(crate) const LEAST_SNAPSHOT_SECS: f32 = 1.0;
/// Rest after a snapshot over the time that it took: snapshots take a twentieth of training at the most.
pub(crate) const SNAPSHOT_REST: u32 = 19;
/// Rest after a picture of a run in training over the time that it took: pictures take half of the time at
/// the most, however many pages look.
pub(crate) const PICTURE_REST: u32 = 1;
/// Seconds over which the share of serving is taken.
pub(crate) const SHARE_SECS: u64 = 10;
/// Most points of a training curve: more than a page has room for.
pub(crate) const CURVE_POINTS: usize = 400;
