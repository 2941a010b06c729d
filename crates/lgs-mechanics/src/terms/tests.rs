//! Every kind in the registry keeps what the interface promises.

use super::*;

/// Spaces in which kinds are tested.
fn spaces() -> Vec<Space> {
    let space = |dimension, quantity| Space { dimension, quantity };
    vec![
        Space::PLACE,
        space(3, Quantity::Separation),
        space(1, Quantity::Separation),
        space(1, Quantity::Angle),
        space(2, Quantity::Amplitude),
        space(4, Quantity::Amplitude),
        space(3, Quantity::Rate),
    ]
}

/// Deterministic numbers between −1 and 1 (a linear congruential generator).
struct Numbers(u64);

impl Numbers {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }

    fn many(&mut self, count: usize) -> Vec<f64> {
        (0..count).map(|_| self.next()).collect()
    }

    /// Values within the bounds of the parameters at unit scales, away from zero.
    fn within(&mut self, parameters: &[Parameter]) -> Vec<f64> {
        let value = |parameter: &Parameter| {
            let value = self.next();
            (value + 0.3 * value.signum()).clamp(parameter.bounds[0].max(-2.0), parameter.bounds[1].min(2.0))
        };
        parameters.iter().map(value).collect()
    }
}

/// Calls a check for each kind and space that suit each other, several times, with `p`, `y` and `w`.
fn each(check: impl Fn(&dyn TermKind, Space, [&[f64]; 3])) {
    let mut numbers = Numbers(7);
    for kind in kinds() {
        for space in spaces().into_iter().filter(|&space| kind.suits(space)) {
            for _ in 0..3 {
                let p = numbers.within(&kind.parameters(space));
                let [y, w] = [0, 1].map(|_| numbers.many(space.dimension));
                check(*kind, space, [&p, &y, &w]);
            }
        }
    }
}

fn force(kind: &dyn TermKind, [p, y, w]: [&[f64]; 3]) -> Vec<f64> {
    let mut force = vec![f64::NAN; y.len()];
    kind.force(p, At { y, w }, &mut force);
    force
}

fn assert_close(found: f64, expected: f64, what: &str) {
    assert!((found - expected).abs() < 1e-6 * (1.0 + expected.abs()), "{what}: {found}, not {expected}");
}

/// The central difference of a function of one argument of three.
fn difference(arguments: [&[f64]; 3], which: usize, index: usize, f: impl Fn([&[f64]; 3]) -> f64) -> f64 {
    const STEP: f64 = 1e-5;
    let shifted = |step: f64| {
        let mut moved = arguments[which].to_vec();
        moved[index] += step;
        let mut changed = arguments;
        changed[which] = &moved;
        f(changed)
    };
    (shifted(STEP) - shifted(-STEP)) / (2.0 * STEP)
}

#[test]
fn names_are_unique_and_found() {
    for (index, kind) in kinds().iter().enumerate() {
        assert!(kinds()[..index].iter().all(|other| other.name() != kind.name()), "{}", kind.name());
        assert_eq!(super::kind(kind.name()).map(TermKind::name), Some(kind.name()));
    }
    assert!(super::kind("perpetual-motion").is_none());
}

#[test]
fn derivatives_are_those_of_the_force() {
    each(|kind, space, arguments| {
        let mut out = Derivatives::default();
        out.reset(space.dimension, arguments[0].len());
        kind.derivatives(arguments[0], At { y: arguments[1], w: arguments[2] }, &mut out);
        for row in 0..space.dimension {
            for (which, block) in [&out.p, &out.y, &out.w].into_iter().enumerate() {
                for column in 0..arguments[which].len() {
                    let slope = difference(arguments, which, column, |a| force(kind, a)[row]);
                    let what = format!("{} in {space:?}, {which}, row {row}, {column}", kind.name());
                    assert_close(block[(row, column)], slope, &what);
                }
            }
        }
    });
}

#[test]
fn a_conservative_force_is_the_slope_of_its_energy() {
    each(|kind, space, arguments| {
        for axis in (0..space.dimension).filter(|_| kind.role() == Role::Conserves) {
            let slope = difference(arguments, 1, axis, |[p, y, _]| kind.energy(p, y));
            assert_close(force(kind, arguments)[axis], -slope, kind.name());
        }
    });
}

#[test]
fn the_power_of_a_force_is_what_its_role_says() {
    each(|kind, _, arguments| {
        let power: f64 = force(kind, arguments).iter().zip(arguments[2]).map(|(f, w)| f * w).sum();
        match kind.role() {
            Role::Dissipates => assert!(power <= 0.0, "{} adds {power}", kind.name()),
            Role::Gyroscopic => assert!(power.abs() < 1e-12, "{} changes {power}", kind.name()),
            Role::Conserves | Role::Drives => {}
        }
    });
}

#[test]
fn a_force_that_ignores_the_velocity_says_so() {
    each(|kind, _, [p, y, w]| {
        let still = vec![0.0; w.len()];
        if !kind.depends_on_velocity() {
            assert_eq!(force(kind, [p, y, w]), force(kind, [p, y, &still]), "{}", kind.name());
        }
    });
}

#[test]
fn parameters_give_back_themselves_from_the_coefficients_of_their_force() {
    each(|kind, space, arguments| {
        let columns = kind.columns(space);
        let linear: Vec<usize> = linear_entries(&kind.parameters(space)).collect();
        let mut numbers = Numbers(11);
        let samples: Vec<[Vec<f64>; 2]> =
            (0..8 * (columns + 1)).map(|_| [0, 1].map(|_| numbers.many(space.dimension))).collect();
        let d = space.dimension;
        let mut design = nalgebra::DMatrix::zeros(samples.len() * d, columns);
        let mut forces = nalgebra::DVector::zeros(samples.len() * d);
        for (index, [y, w]) in samples.iter().enumerate() {
            let mut block = Block::zeros(d, columns);
            kind.design(arguments[0], At { y, w }, &linear, &mut block);
            for (row, f) in force(kind, [arguments[0], y, w]).into_iter().enumerate() {
                forces[index * d + row] = f;
                (0..columns).for_each(|c| design[(index * d + row, c)] = block[(row, c)]);
            }
        }
        let coefficients = if columns == 0 {
            nalgebra::DVector::zeros(0)
        } else {
            design.svd(true, true).solve(&forces, 1e-10).unwrap()
        };
        let found = kind.regressed(arguments[0], coefficients.as_slice(), space);
        for [y, w] in &samples {
            let pair = [force(kind, [&found, y, w]), force(kind, [arguments[0], y, w])];
            pair[0].iter().zip(&pair[1]).for_each(|(a, b)| {
                assert!((a - b).abs() < 1e-5 * (1.0 + b.abs()), "{} in {space:?}: {a}, not {b}", kind.name());
            });
        }
    });
}

#[test]
fn scaled_parameters_scale_the_force() {
    each(|kind, space, [p, y, w]| {
        let scale = |(parameter, value): (Parameter, &f64)| parameter.scaled(*value, 0.3);
        let scaled: Vec<f64> = kind.parameters(space).into_iter().zip(p).map(scale).collect();
        let pair = [force(kind, [&scaled, y, w]), force(kind, [p, y, w])];
        pair[0].iter().zip(&pair[1]).for_each(|(a, b)| assert_close(*a, 0.3 * b, kind.name()));
    });
}

#[test]
fn starts_lie_within_the_bounds() {
    let scales = Scales { length: 0.3, time: 0.8, origin: [4.0, -1.0, 2.0], ..Scales::UNIT };
    for kind in kinds() {
        for space in spaces().into_iter().filter(|&space| kind.suits(space)) {
            let parameters = kind.parameters(space);
            for start in kind.starts(space, &scales) {
                assert_eq!(start.len(), parameters.len(), "{}", kind.name());
                let places = scales.origin_of(space);
                let mut places = places.iter().cycle();
                for (parameter, value) in parameters.iter().zip(start) {
                    let from = if parameter.entry == Entry::Place { places.next().unwrap() } else { &0.0 };
                    let scaled = (value - from) / scales.of(parameter, space);
                    let [lower, upper] = parameter.bounds;
                    assert!(
                        (lower..=upper).contains(&scaled),
                        "{}: {} {scaled}",
                        kind.name(),
                        parameter.name
                    );
                }
            }
        }
    }
}
