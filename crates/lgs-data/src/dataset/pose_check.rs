//! Cameras that plainly look elsewhere than all others do.
//!
//! A pose can be a proper rotation and still be wrong. What the others see decides: the points that the set
//! ships, else the point that is nearest to all viewing axes. Captures that look outwards have no such place,
//! so that a camera is only named where nearly all others agree.

use super::set::{Dataset, Frame};
use crate::thresholds::{AGREEING_CAMERAS, CHECKED_POINTS, FEWEST_CAMERAS};
use lgs_core::Camera;

impl Dataset {
    /// One sentence for each camera whose pose cannot be right if those of the others are; it names the
    /// image. The sentences are about one frame of each camera.
    #[must_use]
    pub fn suspicious_poses(&self) -> Vec<String> {
        let mut cameras: Vec<&Frame> = Vec::new();
        for split in self.splits.keys() {
            for frame in self.cameras(split) {
                if !cameras.iter().any(|other| other.camera_id == frame.camera_id) {
                    cameras.push(frame);
                }
            }
        }
        if cameras.len() < FEWEST_CAMERAS {
            return Vec::new();
        }
        let points = self.init_points.as_ref().filter(|points| points.positions.len() >= FEWEST_CAMERAS);
        let (places, what) = match points {
            Some(points) => {
                let step = points.positions.len().div_ceil(CHECKED_POINTS);
                (points.positions.iter().step_by(step).copied().collect(), "the points of the set")
            }
            None => (vec![self.scene_box().center], "the place that the others look at"),
        };
        let sees = |frame: &&Frame| places.iter().any(|&place| is_in_view(&frame.camera, place));
        let blind: Vec<&Frame> = cameras.iter().filter(|frame| !sees(frame)).copied().collect();
        if blind.len() as f64 > (1.0 - AGREEING_CAMERAS) * cameras.len() as f64 {
            return Vec::new();
        }
        let sentence = |frame: &Frame| {
            format!("the pose of `{}` is likely wrong: nothing of {what} lies in its view", frame.name)
        };
        blind.into_iter().map(sentence).collect()
    }
}

fn is_in_view(camera: &Camera, place: [f32; 3]) -> bool {
    let ([x, y], depth) = camera.pixel_from_world(place);
    let inside = |v: f32, size: u32| (0.0..=size as f32).contains(&v);
    depth > 0.0 && inside(x, camera.width) && inside(y, camera.height)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ply::Points;
    use lgs_core::Exposure;

    /// Eight cameras in a circle that look at the middle, the third of which looks as `turn` says.
    fn rig(turn: impl Fn(Camera) -> Camera) -> Dataset {
        let frame = |i: usize| {
            let angle = 0.7 * i as f32;
            let camera = Camera::look_at([4.0 * angle.cos(), 4.0 * angle.sin(), 1.0], [0.0; 3], 0.8, 4, 3);
            let camera = if i == 2 { turn(camera) } else { camera };
            let (name, exposure) = (format!("{i}.png"), Exposure::IDENTITY);
            Frame { name, camera_id: i, camera, time: 0.0, exposure, pixels: vec![0; 48].into() }
        };
        let mut set = Dataset::none([1.0; 3]);
        set.splits.insert("train".into(), (0..8).map(frame).collect());
        set
    }

    /// A camera that looks the other way.
    fn away(camera: Camera) -> Camera {
        let [x, y, z] = camera.center_in_world();
        Camera::look_at([x, y, z], [2.0 * x, 2.0 * y, 2.0 * z], 0.8, 4, 3)
    }

    #[test]
    fn a_camera_that_looks_away_is_named() {
        assert_eq!(rig(|camera| camera).suspicious_poses(), [""; 0]);
        let found = rig(away).suspicious_poses();
        assert!(found.len() == 1 && found[0].contains("`2.png`"), "{found:?}");
        let mut set = rig(away);
        let positions: Vec<[f32; 3]> = (0..40).map(|i| [0.01 * i as f32, 0.0, 0.1]).collect();
        set.init_points = Some(Points { colors: vec![[0.5; 3]; 40], positions });
        assert!(set.suspicious_poses()[0].contains("points of the set"));
    }

    #[test]
    fn a_rig_that_looks_outwards_is_left_alone() {
        let mut set = rig(|camera| camera);
        set.splits.values_mut().flatten().for_each(|frame| frame.camera = away(frame.camera));
        assert_eq!(set.suspicious_poses(), [""; 0]);
    }
}
