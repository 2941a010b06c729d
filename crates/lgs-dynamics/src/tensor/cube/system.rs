//! A system on a device: its weights, the tape of an evaluation, and the launches of both directions.

use burn::backend::TensorMetadata;
use burn::tensor::DType;
use cubecl::client::Client;
use cubecl::{CubeCount, CubeDim};
use lgs_tensor::cube::{CubeTensor, arguments, cubes, empty, numbers, units, zeros};

use super::field::{Kinds, NETWORK, RangeLaunch, STRUCTURED, ScalesLaunch, Use, accelerate};
use super::field_vjp::{Source, finish};
use super::products::{BACKWARD, BACKWARD_OF_STEP, ChainsLaunch, FORWARD, products, transpose};
use super::program::{Program, floats_per_particle};
use super::sums::{OuterLaunch, outer_sums, sum_groups};
use super::tables::{QUADRATIC, SECOND_MOMENTS};
use super::tiles::{ROWS, UNITS};
use crate::state::Edit;
use crate::system::{ForceKind, PotentialKind, SystemConfig};

/// Most floats of a tape: 128 MB, what every device binds at once.
const TAPE: usize = 1 << 25;
/// Most groups of particles whose gradients of parameters are summed by themselves, and the fewest particles
/// of one.
const GROUPS: usize = 32;
const LEAST_GROUP: usize = 16;

/// Units of a cube where each has a particle: few, so that some thousand particles reach all of a device.
const PARTICLES: u32 = 32;

/// Cubes and their size for so many particles, a unit each, which has to check that it is one of them.
pub(super) fn spread(client: &Client, count: usize) -> (CubeCount, CubeDim) {
    (cubes(client, count.div_ceil(PARTICLES as usize)), CubeDim::new_1d(PARTICLES))
}

/// A system with an edit, for some number of particles.
pub(super) struct DeviceSystem {
    config: SystemConfig,
    edit: Edit,
    kinds: Kinds,
    program: Program,
    /// Weights, and behind them their transposes.
    weights: CubeTensor,
    table: CubeTensor,
    tape: CubeTensor,
    /// Number of particles.
    pub(super) count: usize,
    /// Particles that are evaluated at a time.
    rows: usize,
}

/// Particles that are evaluated together, in a state.
#[derive(Clone, Copy)]
pub(super) struct Rows {
    first: usize,
    rows: usize,
    state: usize,
}

impl DeviceSystem {
    pub(super) fn new(config: &SystemConfig, edit: &Edit, params: &CubeTensor, count: usize) -> Self {
        let most = (TAPE / floats_per_particle(config)).max(1);
        // Parts of one size, as few as there can be.
        let rows = count.div_ceil(count.div_ceil(most).max(1)).max(1);
        let program = Program::new(config, rows);
        assert_eq!(params.shape().num_elements(), program.params, "parameters of the system");
        let weights = empty(params, [2 * program.params], DType::F32);
        let layers = numbers(program.layers.clone(), &params.device);
        let (cubes, dim) = units(&params.client, program.params);
        let [from, layers, to] = arguments([params, &layers, &weights]);
        transpose::launch(&params.client, cubes, dim, from, layers, to);
        let force = match config.force {
            ForceKind::None => 0,
            ForceKind::Mlp => NETWORK,
            ForceKind::Structured => STRUCTURED,
        };
        Self {
            config: *config,
            edit: *edit,
            kinds: Kinds { force, quadratic: config.potential == PotentialKind::QuadraticMlp },
            weights,
            table: numbers(program.table.clone(), &params.device),
            tape: empty(params, [program.tape], DType::F32),
            program,
            count,
            rows,
        }
    }

    /// All particles in a state, as many at a time as the tape holds.
    pub(super) fn ranges(&self, state: usize) -> impl Iterator<Item = Rows> + use<> {
        let (count, step) = (self.count, self.rows);
        (0..count).step_by(step).map(move |first| Rows { first, rows: step.min(count - first), state })
    }

    fn range(&self, rows: Rows) -> RangeLaunch {
        RangeLaunch::new(rows.first as u32, rows.rows as u32, self.count as u32, rows.state as u32)
    }

    fn scales(&self) -> ScalesLaunch {
        let n = &self.config.normalisation;
        let [x, y, z] = n.center;
        let per_time = if self.kinds.force == STRUCTURED { n.acceleration / n.speed } else { n.acceleration };
        ScalesLaunch::new(
            x,
            y,
            z,
            1.0 / n.length,
            1.0 / n.speed,
            -self.edit.potential_scale * n.acceleration,
            self.edit.force_scale * per_time,
        )
    }

    /// Runs the networks on particles of a state, which leaves everything on the tape.
    pub(super) fn evaluate(&self, states: &CubeTensor, rows: Rows) {
        self.run([states, states], rows, (FORWARD, 0.0));
    }

    fn run(&self, [states, carried]: [&CubeTensor; 2], rows: Rows, (pass, h): (u32, f32)) {
        let client = &self.tape.client;
        let [first, other] = if pass == FORWARD { &self.program.forward } else { &self.program.backward };
        let blocks = rows.rows.div_ceil(ROWS as usize) * if other.is_empty() { 1 } else { 2 };
        let [weights, table, tape, of, from] =
            arguments([&self.weights, &self.table, &self.tape, states, carried]);
        let (count, other_count) = (first.len() as u32, other.len() as u32);
        let chains = ChainsLaunch::new(first.start, count, other.start, other_count);
        let (all, dim) = (cubes(client, blocks), CubeDim::new_1d(UNITS));
        let (range, scales, force) = (self.range(rows), self.scales(), self.kinds.force);
        products::launch(
            client, all, dim, weights, table, tape, of, from, chains, range, scales, h, pass, force,
        );
    }

    /// Makes of an evaluation what it is for.
    pub(super) fn accelerate(
        &self,
        states: &CubeTensor,
        out: &CubeTensor,
        rows: Rows,
        (purpose, h): (Use, f32),
    ) {
        let (cubes, dim) = spread(&states.client, rows.rows);
        let [weights, table, tape, from, to] =
            arguments([&self.weights, &self.table, &self.tape, states, out]);
        let (range, scales, client) = (self.range(rows), self.scales(), &states.client);
        accelerate::launch(
            client, cubes, dim, weights, table, tape, from, to, range, scales, h, self.kinds, purpose,
        );
    }

    /// Pulls cotangents of what lies before an evaluated acceleration and of velocities after its kick of
    /// length `h` back to the state, into `adjoint`: the rows `carried`, or those that `adjoint` has of the
    /// state after the step. Cotangents that the states have by themselves (none: no step at all) are added.
    /// Adds to the gradients of parameters.
    pub(super) fn pull_back(
        &self,
        [states, adjoint]: [&CubeTensor; 2],
        [carried, own]: [Option<&CubeTensor>; 2],
        partials: &Partials,
        (rows, h): (Rows, f32),
    ) {
        let pass = if carried.is_some() { BACKWARD } else { BACKWARD_OF_STEP };
        let source = match (carried, own) {
            (None, _) => Source::State,
            (_, None) => Source::Acceleration,
            _ => Source::Carried,
        };
        self.run([states, carried.unwrap_or(adjoint)], rows, (pass, h));
        self.add_sums(partials, rows);
        let (client, kinds, carried) = (&states.client, self.kinds, carried.unwrap_or(states));
        let (cubes, dim) = spread(client, rows.rows);
        let [weights, table, tape, v, of_state, to] =
            arguments([&self.weights, &self.table, &self.tape, carried, own.unwrap_or(carried), adjoint]);
        let (range, scales) = (self.range(rows), self.scales());
        finish::launch(
            client, cubes, dim, weights, table, tape, v, of_state, to, range, scales, h, kinds, source,
        );
    }

    /// Gradients of parameters, none yet.
    pub(super) fn partials(&self) -> Partials {
        let group = self.rows.div_ceil(GROUPS).max(LEAST_GROUP);
        let groups = self.rows.div_ceil(group);
        let sums = zeros(&self.weights, [groups, self.width()], DType::F32);
        Partials { sums, group, groups }
    }

    /// Floats of a group's gradients.
    fn width(&self) -> usize {
        self.program.params + SECOND_MOMENTS
    }

    fn add_sums(&self, partials: &Partials, rows: Rows) {
        let (first, count, tiles) = self.program.sums;
        let groups = rows.rows.div_ceil(partials.group) as u32;
        let client = &self.tape.client;
        let [table, tape, sums] = arguments([&self.table, &self.tape, &partials.sums]);
        let (group, rows, width) = (partials.group as u32, rows.rows as u32, self.width() as u32);
        let outer = OuterLaunch::new(first, count, tiles, groups, group, rows, width);
        let (of, dim) = (cubes(client, (tiles * groups) as usize), CubeDim::new_1d(UNITS));
        outer_sums::launch(client, of, dim, table, tape, sums, outer);
    }

    /// The gradient of all parameters.
    pub(super) fn gradient(&self, partials: &Partials) -> CubeTensor {
        let out = empty(&self.weights, [self.program.params], DType::F32);
        let (cubes, dim) = units(&out.client, self.program.params);
        let [sums, to] = arguments([&partials.sums, &out]);
        let (width, groups) = (self.width() as u32, partials.groups as u32);
        let quadratic = self.program.table[QUADRATIC];
        let has_quadratic = self.kinds.quadratic;
        sum_groups::launch(&out.client, cubes, dim, sums, to, width, groups, quadratic, has_quadratic);
        out
    }
}

/// Sums of gradients of parameters over groups of particles.
pub(super) struct Partials {
    sums: CubeTensor,
    /// Particles of a group.
    group: usize,
    groups: usize,
}
