//! Steps of Adam of several groups, taken together.

use burn::tensor::Tensor;

use super::AdamGroup;
#[cfg(feature = "gpu")]
use super::cube::{After, Before, stepped};

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
        let due = taken_on_devices(self.due);
        #[cfg(not(feature = "gpu"))]
        let due = self.due;
        for step in due {
            step.take_on_processor();
        }
    }
}

/// Takes the steps of groups on devices with kernels, and gives back the others.
#[cfg(feature = "gpu")]
fn taken_on_devices<'a>(due: Vec<Box<dyn DueStep + 'a>>) -> Vec<Box<dyn DueStep + 'a>> {
    let (mut due, others): (Vec<_>, Vec<_>) = due.into_iter().partition(|step| step.has_kernels());
    let after = stepped(due.iter_mut().map(|step| step.before()).collect());
    for (step, after) in due.into_iter().zip(after) {
        step.finish(after);
    }
    others
}

/// The step of a group with any number of dimensions.
trait DueStep {
    /// Takes it with the optimiser of the tensor library.
    fn take_on_processor(self: Box<Self>);

    /// Whether the device of the group has kernels.
    #[cfg(feature = "gpu")]
    fn has_kernels(&self) -> bool;

    /// What the kernel reads.
    #[cfg(feature = "gpu")]
    fn before(&mut self) -> Before;

    /// Takes over what the kernel wrote.
    #[cfg(feature = "gpu")]
    fn finish(self: Box<Self>, after: After);
}

/// The step of a group.
struct GroupStep<'a, const D: usize> {
    group: &'a mut AdamGroup<D>,
    learning_rate: f64,
    gradient: Tensor<D>,
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
    fn before(&mut self) -> Before {
        Before::of(self.group, self.learning_rate, self.gradient.clone())
    }

    #[cfg(feature = "gpu")]
    fn finish(self: Box<Self>, after: After) {
        after.written_to(self.group);
    }
}
