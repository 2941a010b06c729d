//! Every constant that decides something when data are read, and the accuracy of synthetic scenes, with its
//! reason. The contents of a synthetic dataset are set in `synth/write.rs`, `synth/view.rs` and
//! `synth/tracks.rs`.

// Files

/// Longest header of a polygon file that is accepted, bytes; one of degree-3 Gaussians needs about 1,500.
pub(crate) const MAX_HEADER: usize = 1 << 16;
/// Hexadecimal digits of a short hash: 64 bits, enough to notice other data by mistake.
pub(crate) const SHORT_HASH: usize = 16;
/// Deviation of RᵀR from the identity up to which a matrix counts as a rotation: poses printed with three
/// digits pass.
pub(crate) const ROTATION_TOLERANCE: f32 = 2e-3;

// Splat files

/// Most bytes that a byte of a gzip stream can stand for: 258 for each two bits of the shortest code.
pub(crate) const MOST_GZIP_GAIN: u64 = 1032;
/// Most bits behind the point of a coordinate in a `.spz` file: a millionth of a unit, finer than the other
/// quantities deserve, for scenes of up to eight units from the origin.
pub(crate) const FINEST_SPZ_BITS: u8 = 20;

// Point tracks

/// Longest gap of a point track that is filled, as a fraction of the recording. The error of a cubic over a
/// gap g of a vibration of rate ω is (ωg)⁴/384 of its amplitude: below a hundredth for up to four periods in
/// the recording.
pub(crate) const LONGEST_FILLED_GAP: f64 = 0.05;
/// Standard deviation of the Gaussian of a bare point over its distance from its nearest neighbour:
/// neighbours touch and stay apart.
pub(crate) const POINT_SIZE: f32 = 0.25;
/// Opacity of the Gaussian of a bare point: it hides what is behind it.
pub(crate) const POINT_OPACITY: f32 = 0.9;

// Image sets

/// One image in so many is held out where a nerfstudio set does not list its splits, as is usual.
pub(crate) const VALIDATION_STEP: usize = 8;
/// Steps in which the radius is sought at which a lens's polynomial turns back: one part in 1024 of the
/// image's half diagonal is a pixel or less.
pub(crate) const LENS_SCAN: usize = 1024;
/// Largest size of a coefficient of a lens; calibrations of real ones stay below a hundred even in high
/// orders.
pub(crate) const MAX_LENS_COEFFICIENT: f64 = 1e3;
/// Largest part that pixels left out may have in a resized pixel that counts: less than half of one of 255
/// levels.
pub(crate) const MASK_TOLERANCE: f32 = 1e-3;
/// Fewest cameras, and fewest points, from which a pose can be told to be wrong: fewer have no majority.
pub(crate) const FEWEST_CAMERAS: usize = 6;
/// Part of the cameras that must see a common place before one that does not is called wrong.
pub(crate) const AGREEING_CAMERAS: f64 = 0.8;
/// Points of a set by which poses are checked: a thousand spread over it leave no part of it out.
pub(crate) const CHECKED_POINTS: usize = 1000;
/// Frames of a video that are written at the same time while as many are decoded: the cores of a usual
/// machine, and at 4K some 400 MB.
pub(crate) const FRAMES_AT_A_TIME: usize = 8;
/// Absent images that an error names; the others are counted.
pub(crate) const NAMED_ABSENT: usize = 3;
/// Factor of the cameras' radius that gives the scene's extent, as 3D Gaussian splatting has it.
pub(crate) const EXTENT_FACTOR: f32 = 1.1;
/// Largest half side of the scene's box, as a fraction of the median camera's distance: points should not sit
/// on the lenses.
pub(crate) const MAX_BOX_DISTANCE: f32 = 0.9;
/// Factor of the scene's box for a set of opaque images, whose surroundings reach beyond what the cameras aim
/// at.
pub(crate) const SURROUNDINGS: f32 = 1.3;
/// Weight of the pull of the box's centre to a point in front of the cameras, against 1 for the viewing axes:
/// it decides only where the axes are parallel.
pub(crate) const CENTER_PULL: f32 = 1e-3;
/// Difference of a channel below which an opaque pixel shows the background: ten of 255 levels, above the
/// noise of compression.
pub(crate) const BACKGROUND_TOLERANCE: f32 = 10.0 / 255.0;
/// Images whose borders are looked at for a colour behind everything: as many as there are viewpoints in a
/// usual set; more say the same.
pub(crate) const BORDER_IMAGES: usize = 12;
/// Part of the border pixels that must show one colour before that is the background: things may stand out of
/// the picture, but a floor that meets a sky takes half of a border.
pub(crate) const BORDER_SHARE: f64 = 0.75;
/// Candidates tried per point asked for before carving gives up: silhouettes that share less than a
/// two-hundredth of the box say too little.
pub(crate) const CARVING_TRIES: usize = 200;

/// Part of the images that show a point as something from which on it is inside the hull of all times: one in
/// ten may be wrong at its edge.
pub(crate) const HULL_SHARE: f32 = 0.9;
/// Most images that carve the hull of all times: more change it little.
pub(crate) const HULL_VIEWS: usize = 60;

// First points on surfaces

/// Most views whose patches are swept: more see the same again.
pub(crate) const SWEPT_VIEWS: usize = 64;
/// Width that images are reduced to before they are swept, pixels: a patch of five samples then covers a
/// thirtieth of it.
pub(crate) const SWEPT_WIDTH: u32 = 320;
/// Distance between samples of a patch, pixels of such an image: views that differ by tens of degrees agree
/// on what is two pixels large.
pub(crate) const PATCH_SPACING: f32 = 2.0;
/// Depths of a sweep, even in the inverse depth: at half a radian between cameras with a field of view of a
/// radian they are two pixels apart, as samples are.
pub(crate) const SWEPT_DEPTHS: usize = 192;
/// Least and largest depth of a sweep, in distances from what the cameras look at: of a room with cameras at
/// its walls the far side is at twice that distance.
pub(crate) const NEAREST_SWEPT: f32 = 0.25;
pub(crate) const FAREST_SWEPT: f32 = 4.0;
/// Least and largest angle between two views that are compared, radians: below two degrees a pixel is a
/// thirtieth of the depth, above sixty a patch is seen at half its width.
pub(crate) const PARALLAX: [f32; 2] = [0.035, 1.05];
/// Most views that a patch is compared with: what half of them do not see the others do.
pub(crate) const MOST_COMPANIONS: usize = 6;
/// Views that have to agree: two meet by chance where a texture repeats.
pub(crate) const FEWEST_AGREEING: usize = 3;
/// Least mean correlation of patches that agree: noise and the turn of the surface leave a quarter of the
/// variance at most.
pub(crate) const LEAST_CORRELATION: f32 = 0.75;
/// Least lead over any other depth: an edge along the parallax fits everywhere alike.
pub(crate) const LEAST_LEAD: f32 = 0.05;
/// Least deviation of a patch's brightness: five of 255 levels, above the noise of sensors and compression.
pub(crate) const LEAST_TEXTURE: f32 = 0.02;

// Near planes

/// Near plane over the distance from what all cameras look at: that of FreeGave as published, 0.8 for cameras
/// four units away. Cameras side by side, whose axes meet far behind the scene, are held to less by the depth
/// from which a neighbour sees the same.
pub(crate) const NEAR_SHARE: f32 = 0.2;

// Writing

/// How long an interrupted program waits for files under way: a disk that takes longer for one file is stuck,
/// and who interrupts does not wait for it.
pub(crate) const ABANDON_PATIENCE: std::time::Duration = std::time::Duration::from_secs(10);

// Synthetic scenes

/// Longest step of a simulated law; with rates of up to 10 per unit of time the local error is below 1e-12.
pub(crate) const SIMULATION_STEP: f64 = 5e-4;
/// Speed below which dry friction fades, world units or radians per unit of time: a thousandth of the speeds
/// of scenes, and large enough for the step of the simulation to be stable with a deceleration of ten.
pub(crate) const CREEPING_SPEED: f64 = 2e-3;
/// Step of the pendulum in closed form; the fourth-order error at time 2.25 is below 1e-9 rad.
pub(crate) const PENDULUM_STEP: f64 = 1e-3;
/// Time in which a grabbed body gives up the velocity of its free flight, units of time: no jump, and no law.
pub(crate) const GRAB_DURATION: f64 = 0.04;
/// Flights of a bouncing ball shorter than this are rest on the floor, units of time.
pub(crate) const REST_FLIGHT: f64 = 1e-6;
/// Distance below which a ray meets the surface that it starts on, in lengths of its direction.
pub(crate) const MIN_RAY_DISTANCE: f64 = 1e-6;
/// Depth below a surface, in units of the solid, from which a point is inside: above the rounding of doubles.
pub(crate) const INSIDE_MARGIN: f64 = 1e-9;
/// Largest difference of a channel between the four rays of a pixel that is not refined.
pub(crate) const SMOOTH_PIXEL: f64 = 0.10;

// Noise that `import` puts on cameras

/// Largest change of exposure that can be asked for: twice that is the whole range of brightness.
pub(crate) const MOST_NOISE: f32 = 0.5;
