//! The pose of a camera in plain tensor operations.

use burn::tensor::Tensor;
use lgs_core::Camera;

/// The pose of the camera, to first order in the motion of the scene that the probe is: the way to camera
/// axes, and the centre in the world.
pub(super) struct Pose {
    /// Entries `[1, 1]` of the rotation from world to camera axes.
    pub(super) rotation: [[Tensor<2>; 3]; 3],
    /// Entries `[1, 1]`.
    translation: [Tensor<2>; 3],
    /// Entries `[1, 1]`, world units.
    pub(super) center: [Tensor<2>; 3],
}

impl Pose {
    pub(super) fn new(camera: &Camera, probe: &Tensor<1>) -> Self {
        let m = camera.camera_from_world.transpose().to_cols_array_2d();
        let [rx, ry, rz, tx, ty, tz]: [Tensor<2>; 6] =
            std::array::from_fn(|i| probe.clone().narrow(0, i, 1).reshape([1, 1]));
        // ω × p, for p a column of the matrix.
        let turned = |j: usize| {
            let times = |t: &Tensor<2>, i: usize| t.clone().mul_scalar(m[i][j]);
            [times(&ry, 2) - times(&rz, 1), times(&rz, 0) - times(&rx, 2), times(&rx, 1) - times(&ry, 0)]
        };
        let moved = [0, 1, 2, 3].map(|j| {
            let by = turned(j);
            std::array::from_fn::<_, 3, _>(|i| by[i].clone().add_scalar(m[i][j]))
        });
        let shift = [tx, ty, tz];
        let center = camera.center_in_world();
        // The scene's translation moves the centre by −Wᵀ τ, its rotation leaves it in place.
        let along = |k: usize| {
            (0..3).map(|i| shift[i].clone().mul_scalar(-m[i][k])).reduce(|s, t| s + t).expect("three terms")
        };
        Self {
            rotation: std::array::from_fn(|i| std::array::from_fn(|j| moved[j][i].clone())),
            translation: std::array::from_fn(|i| moved[3][i].clone() + shift[i].clone()),
            center: std::array::from_fn(|k| along(k).add_scalar(center[k])),
        }
    }

    /// Means in camera axes, columns `[n, 1]`, of means in the world.
    pub(super) fn camera_means(&self, world: &[Tensor<2>; 3]) -> [Tensor<2>; 3] {
        std::array::from_fn(|i| {
            let terms = (0..3).map(|j| world[j].clone() * self.rotation[i][j].clone());
            terms.fold(self.translation[i].clone(), |sum, term| term + sum)
        })
    }
}
