//! What becomes of the sums of a product: activations, their slopes and their curvatures.

use cubecl::prelude::*;

use super::tables::*;
use super::tiles::UNIT_COLUMNS;

/// Ends a unit's sums of one particle, whose numbers in the arrays of the layer begin at a place, in so many
/// columns, of which some may lie behind the last. All numbers are read before any is written, so that the
/// unit waits for them once.
#[cube]
pub(super) fn end_row(
    weights: &[f32],
    table: &[u32],
    tape: &mut [f32],
    product: usize,
    at: u32,
    columns_at: &Array<u32>,
    sums: &Array<f32>,
) {
    let (kind, last) = (table[product + END], table[product + COLUMNS] - 1u32);
    let (arguments, first) = (table[product + ARGUMENTS] + at, table[product + FIRST] + at);
    let has_second = kind == TOP || kind == CHAIN || kind == UP;
    let second = select(has_second, table[product + SECOND], 0u32) + at;
    let is_top = kind == TOP;
    let are_arguments = kind == HIDDEN || is_top;
    let is_added_to = kind == UP || kind == DOWN;
    let before_at = select(kind == UP, second, first);
    let head = select(is_top, table[product + HEAD], 0u32);
    let mut z = Array::<f32>::new(UNIT_COLUMNS);
    let mut before = Array::<f32>::new(UNIT_COLUMNS);
    let mut factor = Array::<f32>::new(UNIT_COLUMNS);
    #[unroll]
    for j in 0..UNIT_COLUMNS {
        let column = columns_at[j].min(last);
        z[j] = sums[j];
        before[j] = 0.0f32;
        factor[j] = sums[j];
        if !are_arguments {
            z[j] = tape[(arguments + column) as usize];
        }
        if is_added_to {
            before[j] = tape[(before_at + column) as usize];
        }
        if is_top {
            // A chain begins with the weights of the output.
            factor[j] = weights[(head + column) as usize];
        }
    }
    #[unroll]
    for j in 0..UNIT_COLUMNS {
        if columns_at[j] <= last {
            let s = sigmoid(z[j]);
            let slope = s * (1.0f32 + z[j] * (1.0f32 - s));
            let sloped = slope * factor[j];
            if are_arguments {
                tape[(arguments + columns_at[j]) as usize] = z[j];
            }
            let plain = select(kind == DOWN, before[j] + sloped, sloped);
            tape[(first + columns_at[j]) as usize] = select(kind == HIDDEN, z[j] * s, plain);
            if has_second {
                let curvature = s * (1.0f32 - s) * (2.0f32 + z[j] * (1.0f32 - 2.0f32 * s));
                let value = select(kind == UP, before[j] * factor[j], curvature * factor[j]);
                tape[(second + columns_at[j]) as usize] = value;
            }
        }
    }
}

/// `1 / (1 + exp(−z))`, by the exponential that does not overflow.
#[cube]
pub(super) fn sigmoid(z: f32) -> f32 {
    let e = (-z.abs()).exp();
    select(z >= 0.0f32, 1.0f32, e) / (1.0f32 + e)
}
