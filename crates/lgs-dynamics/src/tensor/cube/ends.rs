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
    let before_at = select(kind == UP, second, first);
    let head = table[product + HEAD];
    let (z, before, factor) =
        read_row(weights, &*tape, kind, (arguments, before_at, head), last, columns_at, sums);
    #[unroll]
    for j in 0..UNIT_COLUMNS {
        if columns_at[j] <= last {
            let (value, other) = ended(kind, z[j], before[j], factor[j]);
            if kind == HIDDEN || kind == TOP {
                tape[(arguments + columns_at[j]) as usize] = z[j];
            }
            tape[(first + columns_at[j]) as usize] = value;
            if has_second {
                tape[(second + columns_at[j]) as usize] = other;
            }
        }
    }
}

/// Arguments of the activation, what lies where a result goes, and the factors of slopes: sums, or with which
/// a chain begins, weights of the output. The places are those of the first two, and of those weights.
#[cube]
fn read_row(
    weights: &[f32],
    tape: &[f32],
    kind: u32,
    places: (u32, u32, u32),
    last: u32,
    columns_at: &Array<u32>,
    sums: &Array<f32>,
) -> (Array<f32>, Array<f32>, Array<f32>) {
    let mut z = Array::<f32>::new(UNIT_COLUMNS);
    let mut before = Array::<f32>::new(UNIT_COLUMNS);
    let mut factor = Array::<f32>::new(UNIT_COLUMNS);
    #[unroll]
    for j in 0..UNIT_COLUMNS {
        let column = columns_at[j].min(last);
        z[j] = sums[j];
        before[j] = 0.0f32;
        factor[j] = sums[j];
        if kind != HIDDEN && kind != TOP {
            z[j] = tape[(places.0 + column) as usize];
        }
        if kind == UP || kind == DOWN {
            before[j] = tape[(places.1 + column) as usize];
        }
        if kind == TOP {
            factor[j] = weights[(places.2 + column) as usize];
        }
    }
    (z, before, factor)
}

/// The results of an end.
#[cube]
fn ended(kind: u32, z: f32, before: f32, factor: f32) -> (f32, f32) {
    let s = sigmoid(z);
    let sloped = s * (1.0f32 + z * (1.0f32 - s)) * factor;
    let curvature = s * (1.0f32 - s) * (2.0f32 + z * (1.0f32 - 2.0f32 * s));
    let plain = select(kind == DOWN, before + sloped, sloped);
    (select(kind == HIDDEN, z * s, plain), select(kind == UP, before * factor, curvature * factor))
}

/// `1 / (1 + exp(−z))`, by the exponential that does not overflow.
#[cube]
pub(super) fn sigmoid(z: f32) -> f32 {
    let e = (-z.abs()).exp();
    select(z >= 0.0f32, 1.0f32, e) / (1.0f32 + e)
}
