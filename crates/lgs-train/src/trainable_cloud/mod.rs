//! A trainable Gaussian cloud: one Adam group per attribute, with a row per Gaussian. The source model, the
//! refinement and stage 3 all train one.

mod leaves;

use burn::tensor::{Device, Tensor, TensorData};
use lgs_core::{GaussianCloud, sh_coefficients};
use lgs_model::{TensorFile, TensorFileError};

use crate::adam::{AdamGroup, AdamSteps};
use crate::cloud_rates::CloudRates;
use crate::cloud_tensors::row_indices;

pub(crate) use leaves::{CloudGradients, CloudLeaves};

/// Name of the features in a checkpoint.
const FEATURES: &str = "features";
/// Name of the logarithms of factors of colours over time in a checkpoint.
const SHADING: &str = "shading";

/// Adam groups of a cloud. The constant and the direction-dependent part of the colours are apart, as their
/// learning rates differ.
pub(crate) struct TrainableCloud {
    pub(crate) means: AdamGroup<2>,
    pub(crate) rotations: AdamGroup<2>,
    pub(crate) log_scales: AdamGroup<2>,
    pub(crate) raw_opacities: AdamGroup<2>,
    sh_constant: AdamGroup<2>,
    /// Coefficients of colours above the constant one; none for colours of degree 0.
    sh_rest: Option<AdamGroup<2>>,
    /// Features for a motion; none where it has none.
    features: Option<AdamGroup<2>>,
    /// Logarithms of factors of colours at the times of a shading; none where colours are constant.
    shading: Option<AdamGroup<2>>,
    sh_degree: usize,
}

/// Gaussians to be trained from now on.
#[derive(Default)]
pub(crate) struct NewGaussians {
    pub(crate) cloud: GaussianCloud,
    /// Their features for the motion, row by row; none where it has none.
    pub(crate) features: Vec<f32>,
}

impl TrainableCloud {
    pub(crate) fn new(cloud: &GaussianCloud, device: &Device) -> Self {
        let (n, stride) = (cloud.len(), cloud.sh_stride());
        let columns = |from: usize, to: usize| {
            cloud.sh.chunks_exact(stride).flat_map(|row| &row[from..to]).copied().collect::<Vec<f32>>()
        };
        let group = |values: Vec<f32>, width: usize| AdamGroup::new(values, [n, width], device);
        Self {
            means: group(cloud.means.as_flattened().to_vec(), 3),
            rotations: group(cloud.rotations.as_flattened().to_vec(), 4),
            log_scales: group(cloud.log_scales.as_flattened().to_vec(), 3),
            raw_opacities: group(cloud.raw_opacities.clone(), 1),
            sh_constant: group(columns(0, 3), 3),
            sh_rest: (stride > 3).then(|| group(columns(3, stride), stride - 3)),
            features: None,
            shading: None,
            sh_degree: cloud.sh_degree,
        }
    }

    /// The same cloud with so many features per Gaussian, and at so many times a factor of its colour, whose
    /// logarithm is learned; all zero.
    pub(crate) fn with_columns(mut self, features: usize, times: usize) -> Self {
        let (n, device) = (self.len(), self.means.device());
        let zeros = |width: usize| AdamGroup::new(vec![0.0; n * width], [n, width], &device);
        self.features = (features > 0).then(|| zeros(features));
        self.shading = (times > 0).then(|| zeros(times));
        self
    }

    /// Logarithms of the factors of all Gaussians' colours, row by row.
    pub(crate) fn shading(&self) -> Vec<f32> {
        self.shading.as_ref().map(AdamGroup::values).unwrap_or_default()
    }

    /// Makes all factors of colours one, and forgets their moments.
    pub(crate) fn restart_shading(&mut self) {
        if let Some(group) = &mut self.shading {
            group.replace(group.value().zeros_like());
        }
    }

    /// Makes colours constant.
    pub(crate) fn forget_shading(&mut self) {
        self.shading = None;
    }

    /// The features of all Gaussians, row by row.
    pub(crate) fn features(&self) -> Vec<f32> {
        self.features.as_ref().map(AdamGroup::values).unwrap_or_default()
    }

    /// Replaces the features of all Gaussians and forgets their moments.
    pub(crate) fn replace_features(&mut self, values: Vec<f32>) {
        if let Some(group) = &mut self.features {
            group.replace(Tensor::from_data(TensorData::new(values, group.value().dims()), &group.device()));
        }
    }

    /// Number of Gaussians.
    pub(crate) fn len(&self) -> usize {
        self.means.rows()
    }

    pub(crate) fn leaves(&self) -> CloudLeaves {
        self.with_each(AdamGroup::leaf)
    }

    /// The Gaussians on the host.
    pub(crate) fn cloud(&self) -> GaussianCloud {
        self.with_each(AdamGroup::value).tensors().cloud(self.sh_degree)
    }

    fn with_each(&self, tensor: impl Fn(&AdamGroup<2>) -> Tensor<2>) -> CloudLeaves {
        CloudLeaves {
            means: tensor(&self.means),
            rotations: tensor(&self.rotations),
            log_scales: tensor(&self.log_scales),
            raw_opacities: tensor(&self.raw_opacities),
            sh_constant: tensor(&self.sh_constant),
            sh_rest: self.sh_rest.as_ref().map(&tensor),
            features: self.features.as_ref().map(&tensor),
            shading: self.shading.as_ref().map(&tensor),
        }
    }

    /// Adds the step of every attribute that has a gradient.
    pub(crate) fn add_steps<'a>(
        &'a mut self,
        gradients: CloudGradients,
        rates: &CloudRates,
        steps: &mut AdamSteps<'a>,
    ) {
        steps.add(&mut self.means, rates.means, gradients.means);
        steps.add(&mut self.rotations, rates.rotations, gradients.rotations);
        steps.add(&mut self.log_scales, rates.log_scales, gradients.log_scales);
        steps.add(&mut self.raw_opacities, rates.raw_opacities, gradients.raw_opacities);
        steps.add(&mut self.sh_constant, rates.sh_constant, gradients.sh_constant);
        if let Some(rest) = &mut self.sh_rest {
            steps.add(rest, rates.sh_rest, gradients.sh_rest);
        }
        if let Some(features) = &mut self.features {
            steps.add(features, rates.features, gradients.features);
        }
        if let Some(shading) = &mut self.shading {
            steps.add(shading, rates.shading, gradients.shading);
        }
    }

    /// Keeps the first rows of a list, and appends copies of the Gaussians at its other rows, which start
    /// without moments.
    pub(crate) fn reselect(&mut self, rows: &[usize], kept: usize) {
        let rows = row_indices(rows.iter().copied(), &self.means.device());
        for group in [
            Some(&mut self.means),
            Some(&mut self.rotations),
            Some(&mut self.log_scales),
            Some(&mut self.raw_opacities),
            Some(&mut self.sh_constant),
            self.sh_rest.as_mut(),
            self.features.as_mut(),
            self.shading.as_mut(),
        ]
        .into_iter()
        .flatten()
        {
            group.reselect(&rows, kept);
        }
    }

    /// Keeps the Gaussians at some rows, and appends others without moments.
    ///
    /// # Panics
    /// If the colours of the others have another degree (a bug).
    pub(crate) fn append(&mut self, kept: &[usize], others: &NewGaussians) {
        let NewGaussians { cloud: others, features } = others;
        assert_eq!(others.sh_degree, self.sh_degree, "degrees of colours");
        let n = others.len();
        let order: Vec<usize> = kept.iter().copied().chain(std::iter::repeat_n(kept[0], n)).collect();
        self.reselect(&order, kept.len());
        let others = Self::new(others, &self.means.device());
        self.means.set_last(others.means.value());
        self.rotations.set_last(others.rotations.value());
        self.log_scales.set_last(others.log_scales.value());
        self.raw_opacities.set_last(others.raw_opacities.value());
        self.sh_constant.set_last(others.sh_constant.value());
        if let (Some(rest), Some(others)) = (&mut self.sh_rest, others.sh_rest) {
            rest.set_last(others.value());
        }
        if let Some(group) = &mut self.features {
            let rows = TensorData::new(features.clone(), [n, features.len() / n.max(1)]);
            group.set_last(Tensor::from_data(rows, &group.device()));
        }
        if let Some(group) = &mut self.shading {
            let [_, times] = group.value().dims();
            group.set_last(Tensor::zeros([n, times], &group.device()));
        }
    }

    /// Lowers opacities to at most `opacity` and forgets their moments (method §3.4).
    pub(crate) fn cap_opacity(&mut self, opacity: f32) {
        let logit = (opacity / (1.0 - opacity)).ln();
        self.raw_opacities.replace(self.raw_opacities.value().clamp_max(logit));
    }

    fn named(&self) -> Vec<(&'static str, &AdamGroup<2>)> {
        let always = [
            ("means", &self.means),
            ("rotations", &self.rotations),
            ("log_scales", &self.log_scales),
            ("raw_opacities", &self.raw_opacities),
            ("sh_constant", &self.sh_constant),
        ];
        let rest = self.sh_rest.as_ref().map(|g| ("sh_rest", g));
        let features = self.features.as_ref().map(|g| (FEATURES, g));
        let shading = self.shading.as_ref().map(|g| (SHADING, g));
        always.into_iter().chain(rest).chain(features).chain(shading).collect()
    }

    /// Adds values and moments to a checkpoint under a name.
    pub(crate) fn insert_into(&self, file: &mut TensorFile, name: &str) {
        for (attribute, group) in self.named() {
            group.insert_into(file, &format!("{name}.{attribute}"));
        }
    }

    /// Reads what [`Self::insert_into`] wrote.
    ///
    /// # Errors
    /// If an attribute is absent, not finite or of another shape.
    pub(crate) fn read_from(
        file: &TensorFile,
        name: &str,
        sh_degree: usize,
        device: &Device,
    ) -> Result<Self, TensorFileError> {
        let read = |attribute: &str, n: Option<usize>, width: usize| {
            AdamGroup::read_from(file, &format!("{name}.{attribute}"), [n, Some(width)], device)
        };
        let means = read("means", None, 3)?;
        let n = Some(means.rows());
        let rest = 3 * (sh_coefficients(sh_degree) - 1);
        Ok(Self {
            rotations: read("rotations", n, 4)?,
            log_scales: read("log_scales", n, 3)?,
            raw_opacities: read("raw_opacities", n, 1)?,
            sh_constant: read("sh_constant", n, 3)?,
            sh_rest: if rest > 0 { Some(read("sh_rest", n, rest)?) } else { None },
            means,
            features: None,
            shading: None,
            sh_degree,
        })
    }

    /// The same cloud with the features and the factors of colours that [`Self::insert_into`] wrote, so many
    /// per Gaussian.
    ///
    /// # Errors
    /// If they are absent, not finite or of another shape.
    pub(crate) fn with_columns_of(
        self,
        (file, name): (&TensorFile, &str),
        features: usize,
        times: usize,
    ) -> Result<Self, TensorFileError> {
        let read = |columns: &str, width: usize| {
            let (name, shape) = (format!("{name}.{columns}"), [Some(self.len()), Some(width)]);
            let group = || AdamGroup::read_from(file, &name, shape, &self.means.device());
            (width > 0).then(group).transpose()
        };
        let (features, shading) = (read(FEATURES, features)?, read(SHADING, times)?);
        Ok(Self { features, shading, ..self })
    }
}
