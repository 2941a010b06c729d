//! The two feature networks, as torchvision numbers and shapes their layers.

/// A feature network.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Trunk {
    /// VGG-16, features after relu1_2, relu2_2, relu3_3, relu4_3, relu5_3.
    Vgg,
    /// AlexNet, features after each of its five convolutions.
    Alex,
}

/// A convolution, followed by a ReLU.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Convolution {
    /// Index in torchvision's `features`.
    pub index: usize,
    pub inputs: usize,
    pub outputs: usize,
    pub kernel: usize,
    pub stride: usize,
    pub padding: usize,
}

/// One step through a network.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Step {
    /// A convolution and a ReLU.
    Convolve(Convolution),
    /// The maximum over `kernel × kernel` pixels, every second one.
    Pool { kernel: usize },
    /// Here the features of two images are compared.
    Compare,
}

/// Pixels from one pooled value to the next.
pub(super) const POOL_STRIDE: usize = 2;

const fn square(index: usize, inputs: usize, outputs: usize) -> Step {
    Step::Convolve(Convolution { index, inputs, outputs, kernel: 3, stride: 1, padding: 1 })
}

/// The convolutions of VGG-16 between poolings: index, inputs, outputs.
const VGG_BLOCKS: [&[(usize, usize, usize)]; 5] = [
    &[(0, 3, 64), (2, 64, 64)],
    &[(5, 64, 128), (7, 128, 128)],
    &[(10, 128, 256), (12, 256, 256), (14, 256, 256)],
    &[(17, 256, 512), (19, 512, 512), (21, 512, 512)],
    &[(24, 512, 512), (26, 512, 512), (28, 512, 512)],
];

/// The steps of VGG-16: features are compared after every block, and blocks are joined by pooling.
fn vgg() -> Vec<Step> {
    let block = |convolutions: &&[(usize, usize, usize)]| {
        let convolutions =
            convolutions.iter().map(|&(index, inputs, outputs)| square(index, inputs, outputs));
        convolutions.chain([Step::Compare]).collect::<Vec<Step>>()
    };
    let blocks: Vec<Vec<Step>> = VGG_BLOCKS.iter().map(block).collect();
    blocks.join(&Step::Pool { kernel: 2 })
}

const ALEX: [Step; 12] = [
    Step::Convolve(Convolution { index: 0, inputs: 3, outputs: 64, kernel: 11, stride: 4, padding: 2 }),
    Step::Compare,
    Step::Pool { kernel: 3 },
    Step::Convolve(Convolution { index: 3, inputs: 64, outputs: 192, kernel: 5, stride: 1, padding: 2 }),
    Step::Compare,
    Step::Pool { kernel: 3 },
    square(6, 192, 384),
    Step::Compare,
    square(8, 384, 256),
    Step::Compare,
    square(10, 256, 256),
    Step::Compare,
];

impl Trunk {
    /// All of them.
    pub const ALL: [Self; 2] = [Self::Vgg, Self::Alex];

    pub(super) fn steps(self) -> Vec<Step> {
        match self {
            Self::Vgg => vgg(),
            Self::Alex => ALEX.to_vec(),
        }
    }

    pub(super) fn convolutions(self) -> impl Iterator<Item = Convolution> {
        self.steps().into_iter().filter_map(|step| match step {
            Step::Convolve(convolution) => Some(convolution),
            _ => None,
        })
    }

    /// Channels at each comparison.
    pub(super) fn compared_channels(self) -> Vec<usize> {
        let mut channels = Vec::new();
        let mut last = 0;
        for step in self.steps() {
            match step {
                Step::Convolve(convolution) => last = convolution.outputs,
                Step::Compare => channels.push(last),
                Step::Pool { .. } => {}
            }
        }
        channels
    }

    /// Whether an image of this size leaves a pixel at every depth.
    pub(super) fn accepts(self, width: u32, height: u32) -> bool {
        [width, height].into_iter().all(|side| {
            let mut side = side as usize;
            self.steps().iter().all(|step| {
                let (kernel, stride, padding) = match step {
                    Step::Convolve(c) => (c.kernel, c.stride, c.padding),
                    Step::Pool { kernel } => (*kernel, POOL_STRIDE, 0),
                    Step::Compare => return true,
                };
                let fits = side + 2 * padding >= kernel;
                side = if fits { (side + 2 * padding - kernel) / stride + 1 } else { 0 };
                fits
            })
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn channels_and_smallest_images_are_those_of_the_networks() {
        assert_eq!(Trunk::Vgg.compared_channels(), [64, 128, 256, 512, 512]);
        assert_eq!(Trunk::Alex.compared_channels(), [64, 192, 384, 256, 256]);
        assert_eq!((Trunk::Vgg.convolutions().count(), Trunk::Alex.convolutions().count()), (13, 5));
        assert!(Trunk::Vgg.accepts(16, 40) && !Trunk::Vgg.accepts(40, 15));
        assert!(Trunk::Alex.accepts(31, 31) && !Trunk::Alex.accepts(30, 31));
    }
}
