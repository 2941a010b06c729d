//! One scene and seed.

use super::AnyError;
use super::constants::{Constant, constants};
use super::contact::{Impacts, impacts};
use super::edits::{EditedForecasts, edited_forecasts};
use glam::DVec3;
use lgs_core::geometry::{inverse, outer, wide};
use lgs_data::synth::{self, GroundTruth};
use lgs_distill::{
    DistillConfig, Distilled, DistilledLaw, Partition, SceneDistillation, Trajectories, distill_objects,
};
use lgs_mechanics::Edit;
use lgs_mechanics::bands::Verdict;
use rand::RngExt;
use std::fmt;

use super::thresholds::{COMPARED, RECORDED, WINDOW, WRONG};

pub(super) const PARTICLES: usize = 400;
pub(super) const STEPS: usize = 225;
pub(super) const DT: f64 = 0.01;

/// What came of one scene and seed.
pub(super) struct Row {
    pub(super) scene: String,
    seed: u64,
    /// Errors over the path at t = 1 and t = 2.25.
    pub(super) errors: [f64; 2],
    /// Whether the scene has a law.
    pub(super) is_explained: bool,
    /// Verdict of each object of the scene.
    pub(super) verdicts: Vec<Verdict>,
    /// Whether an object is wrong within the times that it is trusted to.
    pub(super) is_wrongly_trusted: bool,
    /// Share of the true positions in the 90 % band.
    pub(super) coverage: Option<f64>,
    pub(super) constants: Vec<Constant>,
    /// Forecasts of edited motions, of a scene whose objects are explained.
    pub(super) edited: Option<EditedForecasts>,
    /// Impacts, if a body collides with a plane.
    pub(super) impacts: Option<Impacts>,
    seconds: f64,
    laws: String,
    /// Laws with their parameters, and their rivals.
    pub(super) details: Vec<String>,
}

/// Stage 1 of a scene from its truth with noise.
pub(super) fn measured(scene: &str, seed: u64, noise: f32) -> Result<Row, AnyError> {
    let times: Vec<f64> = (0..=STEPS).map(|i| DT * i as f64).collect();
    let truth = synth::ground_truth(scene, &times, PARTICLES, seed)?;
    let clock = std::time::Instant::now();
    let objects = truth.object.iter().max().map_or(0, |last| (last + 1) as usize);
    let partition = Partition { object: truth.object.clone(), objects };
    let seen = window(&truth.points, noise, seed);
    let found = distill_objects(&seen, partition, &DistillConfig::default(), 1, &mut ())?;
    let seconds = clock.elapsed().as_secs_f64();
    let own = |object: &Distilled| object.report().generalised.as_ref().map(|law| law.known.clone());
    let known: Vec<_> = found.objects.iter().map(|(_, object)| own(object).unwrap_or_default()).collect();
    let verdicts: Vec<Verdict> = known.iter().map(|known| known.verdict).collect();
    let is_explained = truth.law["expected"] == "explained";
    let is_trusted = verdicts.iter().all(|verdict| *verdict == Verdict::Explained);
    let laws: Vec<String> = found.objects.iter().map(|(_, object)| describe(object)).collect();
    Ok(Row {
        scene: scene.to_owned(),
        seed,
        errors: [RECORDED, STEPS].map(|step| relative_error(&found, &truth, step)),
        is_explained,
        is_wrongly_trusted: found.objects.iter().any(|object| is_wrongly_trusted(object, &truth)),
        coverage: coverage(&found, &truth),
        constants: if is_explained { constants(&found, &truth) } else { Vec::new() },
        edited: if is_trusted { edited_forecasts(&found, (scene, seed), &truth, &times)? } else { None },
        verdicts,
        impacts: impacts(&found, &truth),
        seconds,
        laws: laws.join(" | "),
        details: found.objects.iter().filter_map(|(_, object)| details(object)).collect(),
    })
}

/// The samples of the window with independent normal noise, another one for each seed.
fn window(points: &[Vec<[f32; 3]>], noise: f32, seed: u64) -> Trajectories {
    let mut rng = lgs_core::stream(seed, "noise", 0);
    let mut normal = || -> f32 { rng.sample(rand_distr::StandardNormal) };
    let times = (0..WINDOW).map(|i| (DT * i as f64) as f32).collect();
    let positions = points[..WINDOW]
        .iter()
        .map(|row| row.iter().map(|p| p.map(|x| x + noise * normal())).collect())
        .collect();
    Trajectories::unweighted(times, positions)
}

/// True positions of an object's particles at a step.
pub(super) fn at(truth: &GroundTruth, members: &[usize], step: usize) -> Vec<[f32; 3]> {
    members.iter().map(|&i| truth.points[step][i]).collect()
}

/// Mean distance of true positions over a number of steps, added up.
pub(super) fn path(truth: &GroundTruth, members: &[usize], steps: usize) -> f64 {
    (0..steps).map(|k| distance(&at(truth, members, k), &at(truth, members, k + 1))).sum()
}

/// Mean position error at a step of the rollout over the mean path until then, over all objects.
fn relative_error(found: &SceneDistillation, truth: &GroundTruth, step: usize) -> f64 {
    let (mut error, mut way) = (0.0, 0.0);
    for (members, object) in &found.objects {
        way += path(truth, members, step);
        let rolled = object.rolled(DT as f32, step);
        error += rolled.get(step).map_or(f64::NAN, |last| distance(last, &at(truth, members, step)));
    }
    error / way
}

/// Whether an object errs by more than is promised at a time after the window to which it is trusted.
fn is_wrongly_trusted((members, object): &(Vec<usize>, Distilled), truth: &GroundTruth) -> bool {
    let Distilled::Generalised(law) = object else { return false };
    let rolled = object.rolled(DT as f32, STEPS);
    let until = ((law.known.trusted[1] / DT).round() as usize).min(STEPS);
    (WINDOW..=until).any(|step| {
        let error = rolled.get(step).map_or(f64::NAN, |last| distance(last, &at(truth, members, step)));
        // What cannot be followed is wrong as well.
        error.is_nan() || error > WRONG * path(truth, members, step)
    })
}

/// Share of the true positions of all particles within the bands of their objects, at times to three windows.
/// Particles are where the motion's pose has them, without the noise of their own places in the body.
fn coverage(found: &SceneDistillation, truth: &GroundTruth) -> Option<f64> {
    let (mut inside, mut count) = (0_usize, 0_usize);
    for (members, object) in &found.objects {
        let Distilled::Generalised(law) = object else { continue };
        let denoised = placed_like(law, &at(truth, members, 0));
        let times: Vec<f64> = (0..=STEPS).map(|step| DT * step as f64).collect();
        let moved = denoised.edited(Edit::NONE, &times);
        for step in (COMPARED..=STEPS).step_by(COMPARED) {
            let Some(radius) = radius_at(law, times[step]) else { continue };
            let expected = at(truth, members, step);
            count += expected.len();
            let near = |(p, q): (&[f32; 3], &[f32; 3])| wide(*p).distance(wide(*q)) <= radius;
            inside += moved
                .get(step)
                .map_or(0, |moved| moved.iter().zip(&expected).filter(|&pair| near(pair)).count());
        }
    }
    (count > 0).then(|| inside as f64 / count as f64)
}

/// Radius of the band at a time, between the times that it is known at.
fn radius_at(law: &DistilledLaw, time: f64) -> Option<f64> {
    let band = &law.known.band;
    let after = band.times.partition_point(|t| *t < time);
    let (&end, &until) = (band.radius.get(after)?, band.times.get(after)?);
    let before = after.checked_sub(1)?;
    let open = f64::INFINITY;
    let part = (time - band.times[before]) / (until - band.times[before]);
    Some(band.radius[before].unwrap_or(open) * (1.0 - part) + end.unwrap_or(open) * part)
}

/// The law with its particles at the places of the truth, moved by the affine map that takes these nearest to
/// the particles' own.
fn placed_like(law: &DistilledLaw, truth: &[[f32; 3]]) -> DistilledLaw {
    let mut q0 = law.q0.clone();
    for rows in law.bodies.ranges(q0.len()) {
        let count = rows.len() as f64;
        let mean = |list: &[[f32; 3]]| list.iter().map(|p| wide(*p)).sum::<DVec3>() / count;
        let (from, to) = (mean(&truth[rows.clone()]), mean(&law.q0[rows.clone()]));
        let pairs = || truth[rows.clone()].iter().zip(&law.q0[rows.clone()]);
        let own: glam::DMat3 = pairs().map(|(p, _)| outer(wide(*p) - from, wide(*p) - from)).sum();
        let mixed: glam::DMat3 = pairs().map(|(p, q)| outer(wide(*q) - to, wide(*p) - from)).sum();
        let linear = inverse(&own).map_or(glam::DMat3::IDENTITY, |back| mixed * back);
        for row in rows {
            q0[row] = (to + linear * (wide(truth[row]) - from)).as_vec3().to_array();
        }
    }
    DistilledLaw { q0, ..law.clone() }
}

/// Sum of distances.
pub(super) fn distance(a: &[[f32; 3]], b: &[[f32; 3]]) -> f64 {
    a.iter().zip(b).map(|(p, q)| wide(*p).distance(wide(*q))).sum()
}

/// The terms found.
fn describe(found: &Distilled) -> String {
    let report = found.report();
    if let Some(found) = &report.generalised {
        let terms: Vec<&str> = found.law.terms.iter().map(|term| term.kind.name()).collect();
        let (name, known) = (found.law.coordinates.name(), &found.known);
        let (terms, verdict, until) = (terms.join(" + "), known.verdict, known.trusted[1]);
        return format!("{name}: {terms}; {verdict:?} until {until:.2}, χ² {:.2}", known.chi_square);
    }
    let Some(terms) = report.terms else { return "networks".into() };
    let mut words = vec![format!("{:?}", report.paths)];
    words.extend(terms.gravity.then(|| "field".into()));
    words.push(format!("stiffness {:?}", terms.stiffness));
    words.extend(terms.damping.then(|| "damping".into()));
    words.extend(terms.gyration.then(|| "gyration".into()));
    words.extend(report.rigid_constraint.then(|| "rigid constraint".into()));
    words.extend(report.networks.then(|| "networks".into()));
    words.join(", ")
}

/// Parameters with their deviations, rivals with their weights, and the band.
fn details(found: &Distilled) -> Option<String> {
    let Distilled::Generalised(found) = found else { return None };
    let law = serde_json::to_string(&found.law).ok()?;
    let rivals: Vec<String> =
        found.known.rivals.iter().map(|rival| format!("{} {:.2}", rival.terms, rival.weight)).collect();
    let radius = |radius: &Option<f64>| radius.map_or("open".to_owned(), |radius| format!("{radius:.4}"));
    let band: Vec<String> = found.known.band.radius.iter().step_by(8).map(radius).collect();
    Some(format!("{law}; rivals: {}; band: {}", rivals.join(", "), band.join(" ")))
}

impl Row {
    pub(super) const HEADER: &str = "scene            seed    t = 1  t = 2.25  in band  worst constant  \
                                              edits  trusted  seconds  law";

    /// The constant that is farthest from the truth.
    fn worst_constant(&self) -> Option<&Constant> {
        self.constants.iter().max_by(|a, b| a.off().total_cmp(&b.off()))
    }
}

impl fmt::Display for Row {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let percent = |value: Option<f64>| value.map_or("-".to_owned(), |v| format!("{:.2}%", 100.0 * v));
        let [recorded, last] = self.errors.map(|error| percent(Some(error)));
        let band = self.coverage.map_or("-".to_owned(), |c| format!("{:.0}%", 100.0 * c));
        let constant = self.worst_constant().map_or("-".to_owned(), ToString::to_string);
        let wrong = if self.is_wrongly_trusted { "WRONGLY TRUSTED; " } else { "" };
        let worst = percent(self.edited.as_ref().map(|edited| edited.worst));
        let (trusted, wrong_edits) = self.edited.as_ref().map_or_else(Default::default, |e| e.told());
        write!(
            f,
            "{:<16} {:>4} {recorded:>8} {last:>9} {band:>8}  {constant:<22} {worst:>8} {trusted:>8} {:>8.1}",
            self.scene, self.seed, self.seconds
        )?;
        write!(f, "  {wrong}{wrong_edits}{}", self.laws)?;
        self.impacts.iter().try_for_each(|impacts| write!(f, "; {impacts}"))
    }
}
