//! Fused differentiable operations: a [`Kernel`] says how a backend runs an operation forwards and pulls a
//! cotangent back through it, and [`fused`] makes of it one node of an autodiff graph.
//!
//! A kernel chooses itself what its forward pass keeps for the backward pass, as tensors of its own backend
//! or as anything else: [`Kernel::Kept`] is an associated type, and nothing above a kernel names it.
//! [`flex`] holds the way between tensors of the CPU backend and slices; `cube` (feature `gpu`) the backend
//! of GPUs, and buffers for its kernels.
//!
//! Invariant: the crate knows no operation; it holds the glue that all of them share.

#[cfg(feature = "gpu")]
pub mod cube;
pub mod flex;

use burn::backend::autodiff::checkpoint::{base::Checkpointer, strategy::CheckpointStrategy};
use burn::backend::autodiff::grads::Gradients;
use burn::backend::autodiff::ops::{Backward, Ops, OpsKind};
use burn::backend::tensor::FloatTensor;
use burn::backend::{Autodiff, Backend};
use std::fmt::Debug;
use std::marker::PhantomData;
use tracing::Span;

/// A pass through an operation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pass {
    /// Forwards, where no gradient will be asked for.
    Forward,
    /// Forwards, with what the way back needs.
    ForwardKept,
    /// Back.
    Backward,
}

/// The constants of a call beside its differentiable tensors: sizes, times, a camera. [`calls`] makes types
/// such.
pub trait Call: Clone + Debug + Send + 'static {
    /// The span of a pass, by which a profile tells where the time went.
    fn span(pass: Pass) -> Span;
}

/// Makes types the constants of calls, and names the spans of their passes: by what stands behind the colon,
/// and by that with `, backward`.
#[macro_export]
macro_rules! calls {
    ($($call:ty: $name:literal;)+) => {
        $(impl $crate::Call for $call {
            fn span(pass: $crate::Pass) -> ::tracing::Span {
                match pass {
                    $crate::Pass::Backward => ::tracing::trace_span!(concat!($name, ", backward")),
                    _ => ::tracing::trace_span!($name),
                }
            }
        })+
    };
}

/// A backend that can run an operation of `N` differentiable tensors and one output forwards and backwards.
pub trait Kernel<C: Call, const N: usize>: Backend {
    /// Everything that [`Kernel::vjp`] needs of a forward pass, its inputs included.
    type Kept: Clone + Debug + Send + 'static;

    /// The output, where no gradient will be asked for.
    fn forward(call: &C, inputs: [FloatTensor<Self>; N]) -> FloatTensor<Self> {
        Self::forward_kept(call, inputs).0
    }

    /// The output, and what the backward pass needs.
    fn forward_kept(call: &C, inputs: [FloatTensor<Self>; N]) -> (FloatTensor<Self>, Self::Kept);

    /// The vector–Jacobian product: the cotangent of every input, of its shape, given that of the output.
    fn vjp(call: &C, kept: Self::Kept, v_output: FloatTensor<Self>) -> [FloatTensor<Self>; N];
}

/// [`Kernel::forward`] in its span.
pub fn forward<B, C, const N: usize>(call: &C, inputs: [FloatTensor<B>; N]) -> FloatTensor<B>
where
    B: Kernel<C, N>,
    C: Call,
{
    C::span(Pass::Forward).in_scope(|| B::forward(call, inputs))
}

/// [`Kernel::forward_kept`] in its span.
pub fn forward_kept<B, C, const N: usize>(call: &C, inputs: [FloatTensor<B>; N]) -> (FloatTensor<B>, B::Kept)
where
    B: Kernel<C, N>,
    C: Call,
{
    C::span(Pass::ForwardKept).in_scope(|| B::forward_kept(call, inputs))
}

/// The graph node of an operation.
#[derive(Debug)]
struct Node<C>(PhantomData<C>);

impl<C: Call, B: Kernel<C, N>, const N: usize> Backward<B, N> for Node<C> {
    type State = (C, B::Kept);

    fn backward(self, ops: Ops<Self::State, N>, grads: &mut Gradients, _checkpointer: &mut Checkpointer) {
        let v_output = grads.consume::<B>(&ops.node);
        let (call, kept) = ops.state;
        let v_inputs = C::span(Pass::Backward).in_scope(|| B::vjp(&call, kept, v_output));
        for (parent, v) in ops.parents.into_iter().zip(v_inputs) {
            if let Some(parent) = parent {
                grads.register::<B>(parent.id, v);
            }
        }
    }
}

/// Runs a kernel on an autodiff backend. Where no input carries a gradient, nothing is kept.
pub fn fused<B, S, C, const N: usize>(
    call: C,
    inputs: [FloatTensor<Autodiff<B, S>>; N],
) -> FloatTensor<Autodiff<B, S>>
where
    B: Kernel<C, N>,
    S: CheckpointStrategy,
    C: Call,
{
    let nodes = inputs.each_ref().map(|input| input.node());
    let inputs = inputs.map(|input| input.into_primitive());
    match Node::<C>(PhantomData).prepare::<S>(nodes).compute_bound().stateful() {
        OpsKind::Tracked(node) => {
            let (output, kept) = forward_kept::<B, C, N>(&call, inputs);
            node.finish((call, kept), output)
        }
        OpsKind::UnTracked(node) => node.finish(forward::<B, C, N>(&call, inputs)),
    }
}

/// Like [`fused`], and hands out what the forward pass kept, for results without a gradient.
pub fn fused_kept<B, S, C, const N: usize>(
    call: C,
    inputs: [FloatTensor<Autodiff<B, S>>; N],
) -> (FloatTensor<Autodiff<B, S>>, B::Kept)
where
    B: Kernel<C, N>,
    S: CheckpointStrategy,
    C: Call,
{
    let nodes = inputs.each_ref().map(|input| input.node());
    let (output, kept) = forward_kept::<B, C, N>(&call, inputs.map(|input| input.into_primitive()));
    let output = match Node::<C>(PhantomData).prepare::<S>(nodes).compute_bound().stateful() {
        OpsKind::Tracked(node) => node.finish((call, kept.clone()), output),
        OpsKind::UnTracked(node) => node.finish(output),
    };
    (output, kept)
}

/// Declares operations, and makes them of the kernels of every backend.
///
/// Two traits come first: that of backends which have all the kernels, and that of the operations, which
/// those backends, autodiff over them and [`burn::backend::Dispatch`] have. Each further line is an
/// operation: its differentiable tensors with their ranks, after the semicolon the constants of its call, and
/// the rank of the result. It becomes a method of the second trait and a function on tensors of any device.
#[macro_export]
macro_rules! operations {
    (
        $(#[$of_kernels:meta])*
        pub trait $kernels:ident;
        $(#[$of_ops:meta])*
        pub trait $ops:ident;
        $(
            $(#[$of_name:meta])*
            $public:vis fn $name:ident(
                $($input:ident: $rank:literal),+; $call:ident: $constants:ty
            ) -> $out:literal;
        )+
    ) => {
        $(#[$of_kernels])*
        pub trait $kernels: $($crate::Kernel<$constants, { [$(stringify!($input)),+].len() }> +)+ {}

        impl<B> $kernels for B where
            B: $($crate::Kernel<$constants, { [$(stringify!($input)),+].len() }> +)+
        {
        }

        $(#[$of_ops])*
        #[::burn::backend::backend_extension(Autodiff, Flex, Cube: cfg(feature = "gpu"))]
        pub trait $ops: ::burn::backend::Backend {
            $(
                $(#[$of_name])*
                fn $name(
                    $($input: ::burn::backend::tensor::FloatTensor<Self>,)+
                    $call: $constants,
                ) -> ::burn::backend::tensor::FloatTensor<Self>;
            )+
        }

        $crate::operations_of! {
            $ops for ::burn::backend::Flex; $($name($($input),+; $call: $constants);)+
        }
        $crate::operations_of_devices! { $ops; $($name($($input),+; $call: $constants);)+ }

        impl<B, C> $ops for ::burn::backend::Autodiff<B, C>
        where
            B: $kernels,
            C: ::burn::backend::autodiff::checkpoint::strategy::CheckpointStrategy,
        {
            $(fn $name(
                $($input: ::burn::backend::tensor::FloatTensor<Self>,)+
                $call: $constants,
            ) -> ::burn::backend::tensor::FloatTensor<Self> {
                $crate::fused::<B, C, _, _>($call, [$($input),+])
            })+
        }

        $(
            $(#[$of_name])*
            #[must_use]
            $public fn $name(
                $($input: ::burn::tensor::Tensor<$rank>,)+
                $call: $constants,
            ) -> ::burn::tensor::Tensor<$out> {
                let out = <::burn::backend::Dispatch as $ops>::$name($($input.into_dispatch(),)+ $call);
                ::burn::tensor::Tensor::from_dispatch(out)
            }
        )+
    };
}

/// The part of [`operations`] for one backend that runs its kernels directly.
#[doc(hidden)]
#[macro_export]
macro_rules! operations_of {
    ($ops:ident for $backend:ty; $($name:ident($($input:ident),+; $call:ident: $constants:ty);)+) => {
        impl $ops for $backend {
            $(fn $name(
                $($input: ::burn::backend::tensor::FloatTensor<Self>,)+
                $call: $constants,
            ) -> ::burn::backend::tensor::FloatTensor<Self> {
                $crate::forward::<Self, _, _>(&$call, [$($input),+])
            })+
        }
    };
}

/// The part of [`operations`] for devices of CubeCL.
#[cfg(feature = "gpu")]
#[doc(hidden)]
#[macro_export]
macro_rules! operations_of_devices {
    ($ops:ident; $($methods:tt)+) => {
        $crate::operations_of! { $ops for $crate::cube::CubeBackend; $($methods)+ }
    };
}

/// The part of [`operations`] for devices of CubeCL, which this build does not have.
#[cfg(not(feature = "gpu"))]
#[doc(hidden)]
#[macro_export]
macro_rules! operations_of_devices {
    ($ops:ident; $($methods:tt)+) => {};
}
