//! The paper's own numbers (its Tables 1 to 3 and its text), to stand beside ours where the suite is the
//! published one.

use serde::{Deserialize, Serialize};

use crate::figures::Model;

/// The column of the paper's tables that a suite repeats.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Published {
    /// Dynamic Object.
    Objects,
    /// Dynamic Indoor Scene.
    Indoor,
}

/// PSNR (of the mean squared error), SSIM and LPIPS (VGG) on the test split.
pub(crate) type Scores = [f64; 3];

/// A row of a table with both columns.
struct Published2 {
    name: &'static str,
    objects: Option<Scores>,
    indoor: Option<Scores>,
}

impl Published2 {
    const fn new(name: &'static str, objects: Scores, indoor: Scores) -> Self {
        Self { name, objects: Some(objects), indoor: Some(indoor) }
    }

    fn of(&self, column: Published) -> Option<Scores> {
        match column {
            Published::Objects => self.objects,
            Published::Indoor => self.indoor,
        }
    }
}

/// Table 1, methods that are not implemented here.
const OTHERS: [Published2; 6] = [
    Published2::new("T-NeRF", [13.818, 0.739, 0.324], [22.242, 0.700, 0.363]),
    Published2::new("D-NeRF", [14.660, 0.737, 0.312], [20.791, 0.692, 0.349]),
    Published2 { name: "NSFF", objects: None, indoor: Some([24.163, 0.795, 0.289]) },
    Published2::new("TiNeuVox", [19.612, 0.940, 0.073], [21.029, 0.770, 0.281]),
    Published2::new("NVFi", [27.594, 0.972, 0.036], [29.745, 0.876, 0.204]),
    Published2::new("TRACE", [31.597, 0.987, 0.009], [34.824, 0.965, 0.054]),
];

/// Tables 1 and 2 by method, variant and model: `method/variant/model`.
const RUNS: [Published2; 8] = [
    Published2::new("defgs/full/source", [19.849, 0.949, 0.045], [21.380, 0.819, 0.188]),
    Published2::new("defgs/full/lagrangian", [24.900, 0.965, 0.037], [31.370, 0.930, 0.103]),
    Published2::new("freegave/full/source", [31.987, 0.990, 0.007], [35.019, 0.966, 0.051]),
    Published2::new("freegave/full/lagrangian", [28.940, 0.977, 0.020], [33.097, 0.955, 0.059]),
    Published2::new("freegave/before-0.5/source", [24.874, 0.970, 0.027], [25.757, 0.823, 0.214]),
    Published2::new("freegave/before-0.5/lagrangian", [24.601, 0.962, 0.032], [24.713, 0.821, 0.218]),
    Published2::new("freegave/before-0.3/source", [21.341, 0.960, 0.038], [23.677, 0.789, 0.246]),
    Published2::new("freegave/before-0.3/lagrangian", [22.272, 0.949, 0.042], [22.975, 0.786, 0.246]),
];

/// Table 3.
const ABLATIONS: [Published2; 4] = [
    Published2::new("freegave/without-stage-3/lagrangian", [27.608, 0.975, 0.018], [27.804, 0.934, 0.079]),
    Published2::new("freegave/without-stages-2-3/lagrangian", [27.471, 0.974, 0.021], [29.011, 0.938, 0.077]),
    Published2::new("freegave/without-alignment/lagrangian", [26.964, 0.974, 0.022], [34.261, 0.957, 0.057]),
    Published2::new("freegave/without-force/lagrangian", [24.971, 0.965, 0.032], [33.303, 0.956, 0.054]),
];

/// Names and scores of the methods of Table 1 that are not implemented here.
pub(crate) fn others(column: Published) -> impl Iterator<Item = (&'static str, Scores)> {
    OTHERS.iter().filter_map(move |row| row.of(column).map(|scores| (row.name, scores)))
}

/// The scores of a method's variant.
pub(crate) fn scores(column: Published, method: &str, variant: &str, model: Model) -> Option<Scores> {
    let name = format!("{method}/{variant}/{}", model.name());
    RUNS.iter().chain(&ABLATIONS).find(|row| row.name == name)?.of(column)
}

/// A number of the paper's text, by the name of the figure; they are about FreeGave.
pub(crate) fn text_figure(column: Published, method: &str, figure: &str, model: Model) -> Option<f64> {
    use Model::{Lagrangian, Source};
    if method != "freegave" {
        return None;
    }
    let [objects, indoor] = match (figure, model) {
        ("extent_ratio_largest", Lagrangian) => [Some(1.1), None],
        ("extent_ratio_largest", Source) => [Some(1.9), None],
        ("cycle_error_negated_step", Lagrangian) => [Some(0.013), Some(0.0019)],
        ("fall_time_exponent", Lagrangian) => [Some(-0.489), None],
        ("fall_time_correlation", Lagrangian) => [Some(0.999), None],
        ("psnr_gap", Lagrangian) => [Some(-3.2), Some(-2.5)],
        ("silhouette_gap", Lagrangian) => [Some(-3.2), Some(-0.6)],
        ("training_time", Lagrangian) => [Some(3.5 * HOUR), Some(3.5 * HOUR)],
        ("training_time", Source) => [Some(2.5 * HOUR), Some(2.5 * HOUR)],
        ("training_memory", Lagrangian) => [Some(9.6 * GIGABYTE), Some(9.6 * GIGABYTE)],
        ("training_memory", Source) => [Some(4.7 * GIGABYTE), Some(4.7 * GIGABYTE)],
        _ => [None, None],
    };
    match column {
        Published::Objects => objects,
        Published::Indoor => indoor,
    }
}

/// Seconds.
const HOUR: f64 = 3600.0;
/// Bytes.
const GIGABYTE: f64 = 1e9;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_papers_differences_come_out() {
        let psnr = |column, method, model| scores(column, method, "full", model).expect("row")[0];
        let gain =
            |column, method| psnr(column, method, Model::Lagrangian) - psnr(column, method, Model::Source);
        for (column, method, printed) in [
            (Published::Objects, "defgs", 5.051),
            (Published::Indoor, "defgs", 9.990),
            (Published::Objects, "freegave", -3.047),
            (Published::Indoor, "freegave", -1.922),
        ] {
            assert!((gain(column, method) - printed).abs() < 1e-9, "{method}");
        }
        assert_eq!(others(Published::Objects).count(), 5, "NSFF has no figure on objects");
        assert_eq!(text_figure(Published::Objects, "defgs", "training_time", Model::Source), None);
    }
}
