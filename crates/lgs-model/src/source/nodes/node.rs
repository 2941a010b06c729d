//! A control node as numbers.

/// Numbers by which nodes and Gaussians are near or far beside their place: those of unlike features do not
/// move together, however close they are. In units of a node's radius.
pub const FEATURES: usize = 3;

/// Numbers per node: position (3), logarithm of the radius, logit of the weight, features.
pub const NODE: usize = 5 + FEATURES;

/// A control node.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Node {
    /// Canonical position, world units.
    pub position: [f32; 3],
    /// Logarithm of the radius within which Gaussians follow it, world units.
    pub log_radius: f32,
    /// Logit of the weight that it has beside other nodes.
    pub logit: f32,
    /// Features.
    pub features: [f32; FEATURES],
}

impl Node {
    /// The node of a row.
    #[must_use]
    pub fn of(row: &[f32; NODE]) -> Self {
        let [x, y, z, log_radius, logit, features @ ..] = *row;
        Self { position: [x, y, z], log_radius, logit, features }
    }

    /// Its row.
    #[must_use]
    pub fn row(&self) -> [f32; NODE] {
        let ([x, y, z], [a, b, c]) = (self.position, self.features);
        [x, y, z, self.log_radius, self.logit, a, b, c]
    }

    /// Its weight beside other nodes, in (0, 1).
    #[must_use]
    pub fn share(&self) -> f32 {
        1.0 / (1.0 + (-self.logit).exp())
    }

    /// Squared distances, in radii, of a Gaussian in space and in features.
    #[must_use]
    pub fn squared_distances(&self, mean: [f32; 3], features: [f32; FEATURES]) -> [f32; 2] {
        let square = |a: [f32; 3], b: [f32; 3]| (0..3).map(|i| (a[i] - b[i]) * (a[i] - b[i])).sum::<f32>();
        let by_radius = (-2.0 * self.log_radius).exp();
        [by_radius * square(mean, self.position), square(features, self.features)]
    }
}
