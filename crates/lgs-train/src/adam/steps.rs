//! Steps of Adam of several groups, taken together.

use burn::tensor::Tensor;

use super::AdamGroup;

/// The steps that are due at an iteration. Devices with kernels take all of them in one pass.
#[derive(Default)]
pub(crate) struct AdamSteps<'a> {
    due: Vec<Box<dyn DueStep + 'a>>,
}

impl<'a> AdamSteps<'a> {
    /// Adds the step of a group; none without a gradient.
    pub(crate) fn add<const D: usize>(
        &mut self,
        group: &'a mut AdamGroup<D>,
        learning_rate: f64,
        gradient: Option<Tensor<D>>,
    ) {
        if let Some(gradient) = gradient {
            self.due.push(Box::new(GroupStep { group, learning_rate, gradient }));
        }
    }

    /// Takes all steps.
    pub(crate) fn take(self) {
        let _span = tracing::trace_span!("Adam").entered();
        #[cfg(feature = "gpu")]
        let due = super::cube::take(self.due);
        #[cfg(not(feature = "gpu"))]
        let due = self.due;
        for step in due {
            step.take_on_processor();
        }
    }
}

/// The step of a group with any number of dimensions.
pub(super) trait DueStep {
    /// Takes it with the optimiser of the tensor library.
    fn take_on_processor(self: Box<Self>);

    /// Whether the device of the group has kernels.
    #[cfg(feature = "gpu")]
    fn has_kernels(&self) -> bool;

    /// What the kernel reads.
    #[cfg(feature = "gpu")]
    fn before(&mut self) -> super::cube::Before;

    /// Takes over what the kernel wrote.
    #[cfg(feature = "gpu")]
    fn finish(self: Box<Self>, after: super::cube::After);
}

/// The step of a group.
pub(super) struct GroupStep<'a, const D: usize> {
    pub(super) group: &'a mut AdamGroup<D>,
    pub(super) learning_rate: f64,
    pub(super) gradient: Tensor<D>,
}

impl<const D: usize> DueStep for GroupStep<'_, D> {
    fn take_on_processor(self: Box<Self>) {
        self.group.step_on_processor(self.learning_rate, self.gradient);
    }

    #[cfg(feature = "gpu")]
    fn has_kernels(&self) -> bool {
        crate::device::has_kernels(&self.group.device())
    }

    #[cfg(feature = "gpu")]
    fn before(&mut self) -> super::cube::Before {
        super::cube::Before::of(self)
    }

    #[cfg(feature = "gpu")]
    fn finish(self: Box<Self>, after: super::cube::After) {
        after.written_to(self.group);
    }
}
