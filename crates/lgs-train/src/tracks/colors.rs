//! The colours of a thing against those around it, and how well images of a moment show a ball of these
//! colours at a place.

use lgs_core::{Camera, Image};

use super::thresholds::{COLOR_LEVELS, INNER_RADII, OUTER_RADII};

/// A view of a moment: a reduced image and its camera.
pub(super) struct Look {
    pub(super) camera: Camera,
    pub(super) image: Image,
}

/// The disc in which a view shows a ball.
#[derive(Clone, Copy)]
struct Disc {
    center: [f32; 2],
    radius: f32,
}

impl Disc {
    /// The disc of a ball that lies wholly in the view; none otherwise.
    fn of(camera: &Camera, position: [f32; 3], radius: f32) -> Option<Self> {
        let ([x, y], depth) = camera.pixel_from_world(position);
        let radius = (camera.fx * camera.fy).sqrt() * radius / depth.max(f32::MIN_POSITIVE);
        let is_inside = depth > camera.near
            && x >= radius
            && y >= radius
            && x + radius <= camera.width as f32
            && y + radius <= camera.height as f32;
        (is_inside && radius > 1.0).then_some(Self { center: [x, y], radius })
    }

    /// Squared distance of a pixel's centre from the disc's, in radii.
    fn squared(&self, x: u32, y: u32) -> f32 {
        let [dx, dy] = [x as f32 + 0.5 - self.center[0], y as f32 + 0.5 - self.center[1]];
        (dx * dx + dy * dy) / (self.radius * self.radius)
    }

    /// Columns and rows within some radii of the centre.
    fn window(&self, camera: &Camera, radii: f32) -> [std::ops::Range<u32>; 2] {
        let of = |center: f32, end: u32| {
            let reach = radii * self.radius;
            ((center - reach).max(0.0) as u32)..((center + reach).max(0.0) as u32 + 2).min(end)
        };
        [of(self.center[0], camera.width), of(self.center[1], camera.height)]
    }
}

/// How much likelier each colour is on the thing than elsewhere: a share in [0, 1] for each of the levels of
/// the three channels.
pub(super) struct Colors {
    shares: Vec<f32>,
}

fn level(color: [f32; 3]) -> usize {
    let of = |channel: f32| ((channel * COLOR_LEVELS as f32) as usize).min(COLOR_LEVELS - 1);
    (of(color[0]) * COLOR_LEVELS + of(color[1])) * COLOR_LEVELS + of(color[2])
}

impl Colors {
    /// The colours of a ball where it is known to be, in looks at several moments.
    pub(super) fn of<'a>(looks: impl Iterator<Item = (&'a Look, [f32; 3])>, radius: f32) -> Self {
        let count = COLOR_LEVELS.pow(3);
        let (mut own, mut others) = (vec![0.0_f64; count], vec![0.0_f64; count]);
        for (Look { camera, image }, position) in looks {
            let Some(disc) = Disc::of(camera, position, radius) else { continue };
            for (pixel, &color) in image.pixels.iter().enumerate() {
                let squared = disc.squared(pixel as u32 % image.width, pixel as u32 / image.width);
                if squared < INNER_RADII * INNER_RADII {
                    own[level(color)] += 1.0;
                } else if squared > OUTER_RADII * OUTER_RADII {
                    others[level(color)] += 1.0;
                }
            }
        }
        let [all_own, all_others] = [&own, &others].map(|all| all.iter().sum::<f64>().max(1.0));
        let share = |(a, b): (&f64, &f64)| {
            let (a, b) = (a / all_own, b / all_others);
            (a / (a + b).max(f64::MIN_POSITIVE)) as f32
        };
        Self { shares: own.iter().zip(&others).map(share).collect() }
    }

    /// How well looks of a moment show the ball at a place: the mean share of its colours on its discs less
    /// that on rings of the same area around them, the mean over the views that have it in sight.
    pub(super) fn score(&self, looks: &[Look], position: [f32; 3], radius: f32) -> f32 {
        let (mut sum, mut views) = (0.0, 0.0_f32);
        for Look { camera, image } in looks {
            let Some(disc) = Disc::of(camera, position, radius) else { continue };
            let [columns, rows] = disc.window(camera, std::f32::consts::SQRT_2);
            let [mut inner, mut outer] = [[0.0_f32; 2]; 2];
            for y in rows {
                for x in columns.clone() {
                    let squared = disc.squared(x, y);
                    let part = if squared < 1.0 { &mut inner } else { &mut outer };
                    if squared < 2.0 {
                        part[0] += self.shares[level(image.pixels[(y * image.width + x) as usize])];
                        part[1] += 1.0;
                    }
                }
            }
            sum += inner[0] / inner[1].max(1.0) - outer[0] / outer[1].max(1.0);
            views += 1.0;
        }
        sum / views.max(1.0)
    }
}
