//! Settings of the segmentation into objects.

use serde::{Deserialize, Serialize};

/// How moving particles are grouped into objects.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum PartitionMethod {
    /// Connected components of the graph of neighbours that move together, refined by regrouping.
    #[default]
    Graph,
    /// k-means on displacements and first positions, into a given number of clusters (method §5.1).
    KMeans,
}

/// Static/moving split and objects (method §5.1).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct PartitionConfig {
    /// Graph or k-means.
    pub method: PartitionMethod,
    /// Objects that k-means looks for (as in FreeGave's published tool: 1, but 2 on `fan`, 3 on
    /// `bat`, 10, 6, 10, 6 indoors).
    pub clusters: usize,
    /// A particle that never gets farther than this from its first position is static, world units.
    pub static_displacement: f32,
    /// Neighbours per particle in the graph of moving ones.
    pub neighbors: usize,
    /// An edge may change its length by this part of it …
    pub length_tolerance: f32,
    /// … plus this, world units, plus three times the noise that smoothing leaves.
    pub length_slack: f32,
    /// Root mean square difference of two displacements, as a part of the larger one, up to which an edge
    /// holds.
    pub displacement_tolerance: f32,
    /// Smaller components join the nearest object.
    pub smallest_object: usize,
    /// Objects whose root mean square displacement is below this part of the largest that a tenth of all that
    /// moves has are static: a source's surroundings are never quite still.
    pub negligible_motion: f32,
    /// Where there are images: objects whose rest would raise the mean squared error of the source's images
    /// by less than this part in every quarter of the window are static, unless nothing else raises it much
    /// more (0: none are). Plain walls slide along themselves, which no image tells from rest.
    pub unseen_motion: f32,
    /// Rounds in which particles go to the motion that explains them best; 0 leaves the graph's objects as
    /// they are.
    pub regroup_rounds: usize,
    /// Degree of the polynomial that smooths each particle's path before the tests; 0 leaves it as it is.
    pub smoothing_degree: usize,
}

impl Default for PartitionConfig {
    fn default() -> Self {
        Self {
            method: PartitionMethod::Graph,
            clusters: 1,
            static_displacement: 0.01,
            neighbors: 16,
            length_tolerance: 0.1,
            length_slack: 0.002,
            displacement_tolerance: 0.25,
            smallest_object: 50,
            negligible_motion: 0.08,
            unseen_motion: 0.6,
            regroup_rounds: 4,
            smoothing_degree: 6,
        }
    }
}

impl PartitionConfig {
    /// Checks the counts.
    ///
    /// # Errors
    /// The key and the reason.
    pub fn validate(&self) -> Result<(), (&'static str, String)> {
        for (key, count) in [("clusters", self.clusters), ("neighbors", self.neighbors)] {
            if count == 0 {
                return Err((key, "0 is below 1".to_owned()));
            }
        }
        for (key, part) in
            [("negligible_motion", self.negligible_motion), ("unseen_motion", self.unseen_motion)]
        {
            if !(part.is_finite() && part >= 0.0) {
                return Err((key, format!("{part} is negative or not finite")));
            }
        }
        Ok(())
    }
}
