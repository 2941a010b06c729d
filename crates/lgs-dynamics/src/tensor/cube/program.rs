//! What an evaluation of a system and its backward pass launch: chains of products, those of potential and
//! force side by side (method §4.1), and the sums of gradients.
//!
//! With z, φ and their layers as in [`lgs_nn`]: the gradient of the potential's network runs down from the
//! output's weights w as `e = φ′(z) g`, `g ← Wᵀe`, keeping `κ = φ″(z) g`. Its cotangent ḡ runs up as
//! `ē = W ḡ`, `ḡ ← φ′(z) ē`, `c = κ ē`, and c down as `z̄ = c + φ′(z) Wᵀz̄`.

use std::ops::Range;

use lgs_nn::{LinearRange, MlpLayout};

use super::outer::{NO_TERM, outer, tiles_of};
use super::tables::*;
use super::tiles::NARROW;
use crate::system::{Layout, SystemConfig};

/// Products that run one after the other, by their numbers.
pub(super) type Chain = Range<u32>;

/// Arrays of a hidden layer on the tape.
#[derive(Clone, Copy)]
struct Hidden {
    z: u32,
    /// φ(z).
    h: u32,
    /// e of the potential; z̄ of the force.
    e: u32,
    /// κ, then c and z̄, of the potential.
    k: u32,
    /// ḡ of the potential.
    g: u32,
}

/// The table and the launches.
pub(super) struct Program {
    /// Places, products, then sums.
    pub(super) table: Vec<u32>,
    /// Floats of the tape.
    pub(super) tape: usize,
    /// An evaluation of potential and force.
    pub(super) forward: [Chain; 2],
    /// Its backward pass, but for the sums.
    pub(super) backward: [Chain; 2],
    /// The number of the first of the sums among numbers of the table, their count and that of their tiles.
    pub(super) sums: (u32, u32, u32),
    /// Layers as weight, inputs and outputs: what is transposed.
    pub(super) layers: Vec<u32>,
    /// Parameters.
    pub(super) params: usize,
}

/// Builds a program.
struct Builder {
    rows: usize,
    tape: usize,
    places: [u32; PLACES],
    products: Vec<[u32; PRODUCT]>,
    sums: Vec<[u32; OUTER]>,
    params: u32,
}

/// Floats of the tape per particle.
pub(super) fn floats_per_particle(config: &SystemConfig) -> usize {
    Program::new(config, 1).tape
}

impl Program {
    /// For at most so many particles at a time.
    pub(super) fn new(config: &SystemConfig, rows: usize) -> Self {
        let layout = Layout::of(config);
        let params = layout.len as u32;
        let (products, sums) = (Vec::new(), Vec::new());
        let mut builder = Builder { rows, tape: 0, places: [0; PLACES], products, sums, params };
        builder.place();
        let up = builder.potential(&layout.potential);
        let force = layout.force.as_ref().map(|layout| builder.force(layout)).unwrap_or_default();
        if let Some(start) = layout.quadratic {
            builder.quadratic(start as u32);
        }
        let tiles = builder.number_tiles();
        let first = (PLACES + PRODUCT * builder.products.len()) as u32;
        let mut table = builder.places.to_vec();
        table.extend(builder.products.iter().flatten());
        table.extend(builder.sums.iter().flatten());
        let networks = [Some(&layout.potential), layout.force.as_ref()];
        let layers = networks.into_iter().flatten().flat_map(MlpLayout::linears);
        let layers = layers.flat_map(|l| [l.weight, l.inputs, l.outputs].map(|number| number as u32));
        Self {
            table,
            tape: builder.tape,
            forward: [up.0, force.0],
            backward: [up.1, force.1],
            sums: (first, builder.sums.len() as u32, tiles),
            layers: layers.collect(),
            params: layout.len,
        }
    }
}

impl Builder {
    fn array(&mut self, width: usize) -> u32 {
        let at = self.tape;
        self.tape += width * self.rows;
        at as u32
    }

    fn place(&mut self) {
        let widths = [STATE_INPUTS, 3, 3, 3, FORCE_OUTPUTS, FORCE_OUTPUTS, STATE_INPUTS, STATE_INPUTS];
        for (place, width) in widths.into_iter().enumerate() {
            self.places[place] = self.array(width);
        }
    }

    /// The first so many arrays of every hidden layer.
    fn hidden(&mut self, layout: &MlpLayout, count: usize) -> Vec<Hidden> {
        let mut of_layer = |l: &LinearRange| {
            let mut array = |number: usize| if number < count { self.array(l.outputs) } else { NONE };
            Hidden { z: array(0), h: array(1), e: array(2), k: array(3), g: array(4) }
        };
        layout.hidden.iter().map(&mut of_layer).collect()
    }

    /// The number of the next product.
    fn next(&self) -> u32 {
        self.products.len() as u32
    }

    /// Numbers the tiles of the sums, those of most work first; gives their count.
    fn number_tiles(&mut self) -> u32 {
        self.sums.sort_by_key(|sum| (sum[INPUTS] <= NARROW, sum[TERM + LEFT] == NONE));
        let mut tiles = 0;
        for sum in &mut self.sums {
            sum[BEGIN] = tiles;
            tiles += tiles_of(sum);
        }
        tiles
    }

    /// `W x`, by transposed weights, so that neighbouring units read neighbouring ones.
    fn up(&mut self, l: &LinearRange, end: u32, factors: (u32, usize)) -> [u32; PRODUCT] {
        let mut product = [NONE; PRODUCT];
        product[END] = end;
        product[INNER] = l.inputs as u32;
        product[COLUMNS] = l.outputs as u32;
        product[FACTORS] = factors.0;
        product[STRIDE] = factors.1 as u32;
        product[WEIGHTS] = self.params + l.weight as u32;
        product[WEIGHTS_STRIDE] = l.outputs as u32;
        product
    }

    /// `Wᵀ v`.
    fn down(&mut self, l: &LinearRange, end: u32, factors: u32) -> [u32; PRODUCT] {
        let mut product = [NONE; PRODUCT];
        product[END] = end;
        product[INNER] = l.outputs as u32;
        product[COLUMNS] = l.inputs as u32;
        product[FACTORS] = factors;
        product[STRIDE] = l.outputs as u32;
        product[WEIGHTS] = l.weight as u32;
        product[WEIGHTS_STRIDE] = l.inputs as u32;
        product
    }

    /// The products of the gradient of the potential's network, and of its backward pass.
    fn potential(&mut self, layout: &MlpLayout) -> (Chain, Chain) {
        let arrays = self.hidden(layout, 5);
        self.potential_sums(layout, &arrays);
        (self.potential_gradient(layout, &arrays), self.potential_gradient_vjp(layout, &arrays))
    }

    fn potential_gradient(&mut self, layout: &MlpLayout, arrays: &[Hidden]) -> Chain {
        let [states, gradient] = [STATES, GRADIENT].map(|place| self.places[place]);
        let (first, last) = (self.next(), layout.hidden.len() - 1);
        for (i, (l, own)) in layout.hidden.iter().zip(arrays).enumerate() {
            let below = if i == 0 { (states, STATE_INPUTS) } else { (arrays[i - 1].h, l.inputs) };
            let mut product = self.up(l, if i == last { TOP } else { HIDDEN }, below);
            product[BIASES] = l.bias as u32;
            product[ARGUMENTS] = own.z;
            product[FIRST] = if i == last { own.e } else { own.h };
            product[SECOND] = own.k;
            product[HEAD] = layout.head.weight as u32;
            self.products.push(product);
        }
        for (i, (l, own)) in layout.hidden.iter().zip(arrays).enumerate().rev() {
            let mut product = self.down(l, if i == 0 { PLAIN } else { CHAIN }, own.e);
            product[FIRST] = if i == 0 { gradient } else { arrays[i - 1].e };
            if i > 0 {
                (product[ARGUMENTS], product[SECOND]) = (arrays[i - 1].z, arrays[i - 1].k);
            }
            self.products.push(product);
        }
        first..self.next()
    }

    fn potential_gradient_vjp(&mut self, layout: &MlpLayout, arrays: &[Hidden]) -> Chain {
        let [v_gradient, v_out] = [V_GRADIENT, V_POTENTIAL].map(|place| self.places[place]);
        let first = self.next();
        for (i, (l, own)) in layout.hidden.iter().zip(arrays).enumerate() {
            let below = if i == 0 { (v_gradient, 3) } else { (arrays[i - 1].g, l.inputs) };
            let mut product = self.up(l, UP, below);
            (product[ARGUMENTS], product[FIRST], product[SECOND]) = (own.z, own.g, own.k);
            self.products.push(product);
        }
        for (i, (l, own)) in layout.hidden.iter().zip(arrays).enumerate().rev() {
            let mut product = self.down(l, if i == 0 { PLAIN } else { DOWN }, own.k);
            product[FIRST] = if i == 0 { v_out } else { arrays[i - 1].k };
            if i > 0 {
                product[ARGUMENTS] = arrays[i - 1].z;
            }
            self.products.push(product);
        }
        first..self.next()
    }

    fn potential_sums(&mut self, layout: &MlpLayout, arrays: &[Hidden]) {
        let [states, v_gradient] = [STATES, V_GRADIENT].map(|place| self.places[place]);
        for (i, (l, own)) in layout.hidden.iter().zip(arrays).enumerate() {
            let [one, other] = match i {
                0 => [(v_gradient, 3), (states, STATE_INPUTS)],
                _ => [arrays[i - 1].g, arrays[i - 1].h].map(|right| (right, l.inputs)),
            };
            let terms = [(own.k, other), (own.e, one)];
            self.sums.push(outer((l.outputs, l.inputs), l.outputs, terms, (l.weight, l.inputs, 1)));
            self.ones(own.k, l.outputs, l.bias);
        }
        // The weights of the output meet ḡ alone.
        self.ones(arrays[arrays.len() - 1].g, layout.head.inputs, layout.head.weight);
    }

    /// The sums of an array over particles.
    fn ones(&mut self, array: u32, width: usize, to: usize) {
        self.sums.push(outer((width, 1), width, [(array, (ONES, 0)), NO_TERM], (to, 1, 1)));
    }

    /// The sums of a layer of the force's network, given its cotangents and what goes into it. A layer of few
    /// outputs and more inputs goes by its transpose, of few columns.
    fn layer_sums(&mut self, l: &LinearRange, v: u32, below: (u32, usize)) {
        let (outputs, inputs) = (l.outputs, l.inputs);
        let sums = if outputs <= NARROW as usize && outputs < inputs {
            let terms = [(below.0, (v, outputs)), NO_TERM];
            outer((inputs, outputs), below.1, terms, (l.weight, 1, inputs))
        } else {
            outer((outputs, inputs), outputs, [(v, below), NO_TERM], (l.weight, inputs, 1))
        };
        self.sums.push(sums);
        self.ones(v, outputs, l.bias);
    }

    /// The products of the force's network, and of its backward pass.
    fn force(&mut self, layout: &MlpLayout) -> (Chain, Chain) {
        let arrays = self.hidden(layout, 3);
        (self.force_outputs(layout, &arrays), self.force_outputs_vjp(layout, &arrays))
    }

    fn force_outputs(&mut self, layout: &MlpLayout, arrays: &[Hidden]) -> Chain {
        let [states, out, v_out] = [FORCE_STATES, FORCE, V_FORCE].map(|place| self.places[place]);
        let first = self.next();
        for (i, l) in layout.linears().enumerate() {
            let below = if i == 0 { (states, STATE_INPUTS) } else { (arrays[i - 1].h, l.inputs) };
            let own = arrays.get(i);
            let mut product = self.up(l, if own.is_none() { PLAIN } else { HIDDEN }, below);
            product[BIASES] = l.bias as u32;
            product[FIRST] = own.map_or(out, |own| own.h);
            product[ARGUMENTS] = own.map_or(NONE, |own| own.z);
            self.products.push(product);
            let v = own.map_or(v_out, |own| own.e);
            self.layer_sums(l, v, below);
        }
        first..self.next()
    }

    fn force_outputs_vjp(&mut self, layout: &MlpLayout, arrays: &[Hidden]) -> Chain {
        let [v_out, v_inputs] = [V_FORCE, V_INPUTS].map(|place| self.places[place]);
        let (first, layers) = (self.next(), layout.linears().collect::<Vec<_>>());
        for (i, l) in layers.into_iter().enumerate().rev() {
            let v = arrays.get(i).map_or(v_out, |own| own.e);
            let mut product = self.down(l, if i == 0 { PLAIN } else { BACK }, v);
            product[FIRST] = if i == 0 { v_inputs } else { arrays[i - 1].e };
            if i > 0 {
                product[ARGUMENTS] = arrays[i - 1].z;
            }
            self.products.push(product);
        }
        first..self.next()
    }

    /// Linear coefficients, and second moments behind the parameters.
    fn quadratic(&mut self, start: u32) {
        self.places[QUADRATIC] = start;
        let [states, v_gradient] = [STATES, V_GRADIENT].map(|place| self.places[place]);
        let terms = [(v_gradient, (states, STATE_INPUTS)), NO_TERM];
        self.sums.push(outer((3, 3), 3, terms, (self.params as usize, 3, 1)));
        self.ones(v_gradient, 3, start as usize);
    }
}
