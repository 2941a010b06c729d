//! The files of weights that LPIPS needs, and how each is recognised by its contents.

use lgs_data::pth::StateDict;
use serde::{Deserialize, Serialize};

use super::trunk::{Convolution, Trunk};

/// The network, and the part of it, that a file of weights is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum WeightKind {
    /// Convolutions of VGG-16.
    VggTrunk,
    /// LPIPS weights of its channels.
    VggLinear,
    /// Convolutions of AlexNet.
    AlexTrunk,
    /// LPIPS weights of its channels.
    AlexLinear,
}

impl WeightKind {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::VggTrunk, Self::VggLinear, Self::AlexTrunk, Self::AlexLinear];

    /// Its name, also of the stored file.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::VggTrunk => "vgg-trunk",
            Self::VggLinear => "vgg-linear",
            Self::AlexTrunk => "alex-trunk",
            Self::AlexLinear => "alex-linear",
        }
    }

    /// Published files: the start of their SHA-256 hash, and where they come from.
    #[must_use]
    pub fn published(self) -> &'static [(&'static str, &'static str)] {
        match self {
            Self::VggTrunk => &[("397923af", "torchvision vgg16-397923af.pth")],
            Self::VggLinear => &[(
                "a78928a0af1e5f0fcb1f3b9e8f8c3a2a5a3de244d830ad5c1feddc79b8432868",
                "lpips 0.1.4 weights/v0.1/vgg.pth",
            )],
            Self::AlexTrunk => &[
                ("7be5be79", "torchvision alexnet-owt-7be5be79.pth"),
                ("4df8aa71", "torchvision alexnet-owt-4df8aa71.pth"),
            ],
            Self::AlexLinear => &[(
                "df73285e35b22355a2df87cdb6b70b343713b667eddbda73e1977e0c860835c0",
                "lpips 0.1.4 weights/v0.1/alex.pth",
            )],
        }
    }

    pub(super) fn is_linear(self) -> bool {
        matches!(self, Self::VggLinear | Self::AlexLinear)
    }

    /// Names and shapes of its tensors, as in the published files.
    pub(super) fn tensors(self) -> Vec<(String, Vec<usize>)> {
        let trunk = if matches!(self, Self::VggTrunk | Self::VggLinear) { Trunk::Vgg } else { Trunk::Alex };
        if self.is_linear() {
            let linear = |(i, n)| (format!("lin{i}.model.1.weight"), vec![1, n, 1, 1]);
            return trunk.compared_channels().into_iter().enumerate().map(linear).collect();
        }
        let both = |c: Convolution| {
            let name = |part: &str| format!("features.{}.{part}", c.index);
            [(name("weight"), vec![c.outputs, c.inputs, c.kernel, c.kernel]), (name("bias"), vec![c.outputs])]
        };
        trunk.convolutions().flat_map(both).collect()
    }

    /// The kind of weights in a checkpoint, told by the tensors in which the networks differ.
    pub(super) fn of(dict: &StateDict) -> Option<Self> {
        if let Some(shape) = dict.shape("features.0.weight") {
            // The first convolution's kernel: 11 × 11 or 3 × 3.
            return Some(if shape.last() == Some(&11) { Self::AlexTrunk } else { Self::VggTrunk });
        }
        let shape = dict.shape("lin1.model.1.weight")?;
        Some(if shape.get(1) == Some(&192) { Self::AlexLinear } else { Self::VggLinear })
    }
}

impl Trunk {
    /// The files that make this network.
    pub(super) fn files(self) -> [WeightKind; 2] {
        match self {
            Self::Vgg => [WeightKind::VggTrunk, WeightKind::VggLinear],
            Self::Alex => [WeightKind::AlexTrunk, WeightKind::AlexLinear],
        }
    }
}
