//! Fits through impacts: a law from the flights, then start, law and contact together.

use super::body::{Body, Observed};
use super::bounced::{Bounced, likeliest};
use super::bouncing::Bouncing;
use super::flights::flights;
use super::freedom::{Freedom, Hypothesis};
use super::grounds::touching;
use super::laws::{FlightLaw, FlightLaws};
use super::samples::Samples;
use super::struck::told;
use super::thresholds::{FILLED, HOPELESS, NEAR_PLANE};
use crate::candidate::Candidate;
use crate::contact::{Contact, Origin, Surface, impacts};
use crate::coordinates::{Ball, Coordinates, Port};
use crate::edit::Edit;
use crate::error::MechanicsError;
use crate::explain::check_track;
use crate::law::Law;
use crate::system::System;
use crate::terms::Term;
use crate::thresholds::{EXACT, FEWEST_TIMES};
use std::ops::Range;

/// Fits a candidate with a contact, whose restitution and friction are to be found, to configurations at
/// ascending times.
///
/// Errors: fewer than five samples before the first impact, faults of the track or of the contact, and a
/// candidate that cannot be fitted.
pub fn fit(
    candidate: &Candidate,
    times: &[f64],
    x: &[Vec<f64>],
    contact: &Contact,
) -> Result<Bounced, MechanicsError> {
    contact.check(&candidate.coordinates)?;
    let x = check_track(std::slice::from_ref(candidate), times, x)?;
    let body = body_of(candidate, contact)?;
    let seen = Observed { times, x: &x, deviations: &[], least: [0.0; 2] };
    let touching = touching(&body, &seen, contact);
    let flights = flights(times, &impacts(times, &seen.centers()), &touching);
    let first = flights.first().filter(|flight| flight.start == 0).map_or(0, Range::len);
    if first < FEWEST_TIMES {
        let what = "times before the first impact".to_owned();
        return Err(MechanicsError::Size { what, expected: FEWEST_TIMES, found: first });
    }
    let extent = body.surface.extent();
    let freedom = Freedom { about: [0.0; 3], tilt: EXACT, shift: EXACT * extent, least: 0.0 };
    let freedoms = vec![freedom; contact.planes().count()];
    let given = Hypothesis { contact: contact.clone(), freedoms, impulses: Vec::new() };
    let known = |_: &FlightLaw| vec![given.clone()];
    through((&body, &seen), &FlightLaws::new(&body, &seen, f64::INFINITY), flights, &known)
        .ok_or(MechanicsError::NoFit { candidates: 1 })
}

/// Hypotheses of the contact, from the law of the flights.
pub(super) type Planes<'a> = dyn Fn(&FlightLaw) -> Vec<Hypothesis> + 'a;

/// The likeliest motion through the ends of flights on one of several planes; `None` where the flights have
/// no law.
pub(super) fn through(
    (body, seen): (&Body, &Observed),
    laws: &FlightLaws<'_>,
    mut flights: Vec<Range<usize>>,
    planes: &Planes<'_>,
) -> Option<Bounced> {
    let since = seen.since();
    let law = loop {
        let law = laws.of(&flights)?;
        // A flight that goes through the plane holds samples of its impact.
        let options = planes(&law);
        let contact = &options.first()?.contact;
        let kept = first_impact(&law, contact, since[flights[0].end - 1])?
            .map_or(flights[0].end, |time| since.partition_point(|other| *other <= time));
        let is_late = contact.origin != Origin::Fitted && (FEWEST_TIMES..flights[0].end).contains(&kept);
        if !is_late {
            break law;
        }
        flights[0].end = kept;
    };
    let on_planes = |hypothesis: Hypothesis| on_planes((body, seen), (&law, &flights), &hypothesis);
    likeliest(planes(&law).into_iter().filter_map(on_planes))
}

/// Time of the first impact of the first flight's motion.
fn first_impact(law: &FlightLaw, contact: &Contact, until: f64) -> Option<Option<f64>> {
    let motion = with_contact(law, &law.candidate.coordinates, contact)?;
    let met = System::new(&motion, Edit::NONE).impacts(&law.flights[0].1, until).ok()?;
    Some(met.first().map(|impact| impact.time))
}

/// The law of flights in coordinates, with a contact whose resting speed is that of a fall by what is not
/// known of body and plane.
fn with_contact(law: &FlightLaw, coordinates: &Coordinates, contact: &Contact) -> Option<Law> {
    let terms = law.candidate.terms.clone();
    let mut motion = Law::new(coordinates.clone(), terms, law.parameters.clone(), law.step).ok()?;
    let (_, state) = &law.flights[0];
    let [pull, _] = System::new(&motion, Edit::NONE).accelerations(state);
    let acceleration = pull[pull.len() - 3..].iter().map(|a| a * a).sum::<f64>().sqrt();
    let unknown = law.noise_of_place().deviation.max(NEAR_PLANE * contact.extent());
    let resting_speed = contact.resting_speed.max(Contact::resting_speed(acceleration, unknown));
    motion.contact = Some(Contact { resting_speed, ..contact.clone() });
    Some(motion)
}

/// The motion through impacts on the planes of a hypothesis, for the better of a body that is filled and one
/// whose mass is where its particles are.
fn on_planes(
    (body, seen): (&Body, &Observed),
    (law, flights): (&FlightLaw, &[Range<usize>]),
    hypothesis: &Hypothesis,
) -> Option<Bounced> {
    let since = seen.since();
    let samples = Samples::new(
        seen.samples(0..since.len()),
        seen.x.to_vec(),
        &law.noise,
        (flights[0].end, law.left_out(flights, since.len())),
    );
    let duration = since[flights[0].end - 1];
    let with_inertia = |coordinates: Coordinates| {
        let impulses = hypothesis.impulses.clone();
        let motion = Law { impulses, ..with_contact(law, &coordinates, &hypothesis.contact)? };
        let given = (since.clone(), samples.clone());
        let bouncing = Bouncing::new(law, motion, given, duration, &hypothesis.freedoms);
        let (pair, error) = bouncing.coarse()?;
        // No restitution and friction bring it about: the plane is not what the body has met.
        (error <= HOPELESS * hypothesis.contact.extent()).then_some((bouncing, pair, error))
    };
    let tried = masses(&law.candidate.coordinates, body.is_shell).into_iter().filter_map(with_inertia);
    let (bouncing, pair, _) = tried.min_by(|a, b| a.2.total_cmp(&b.2))?;
    let (found, are_certain) = bouncing.solve(pair, seen.times[0])?;
    let told = told(body, seen, &found.law.impulses);
    are_certain.iter().all(|is_certain| *is_certain).then(|| found.knowing_hits(told))
}

/// Coordinates with the inertia of the particles, and that of a body which they are the surface of.
fn masses(coordinates: &Coordinates, is_shell: bool) -> Vec<Coordinates> {
    let mut found = vec![coordinates.clone()];
    if let (Coordinates::Rigid(inertia), true) = (coordinates, is_shell) {
        let mut filled = *inertia;
        filled.moments.iter_mut().for_each(|moment| *moment *= FILLED);
        found.push(Coordinates::Rigid(filled));
    }
    found
}

/// The body of a candidate with a contact.
fn body_of(candidate: &Candidate, contact: &Contact) -> Result<Body, MechanicsError> {
    let surface = Surface { points: contact.points.clone(), radius: contact.radius };
    let coordinates = candidate.coordinates.clone();
    let own = |port: &dyn Fn(&Term) -> bool| -> Vec<Term> {
        candidate.terms.iter().copied().filter(|term| port(term)).collect()
    };
    let of_center = own(&|term| [Port::Center, Port::Whole].contains(&term.port));
    let of_center = of_center.into_iter().map(|term| Term { port: Port::Whole, ..term }).collect();
    let centers = vec![Candidate::new(Coordinates::Point, of_center)?];
    let spins = match coordinates.inertia() {
        Some(&inertia) => {
            let ball = Coordinates::Ball(Ball { pivot: [0.0; 3], arm: [0.0; 3], inertia });
            vec![Candidate::new(ball, own(&|term| term.port != Port::Center))?]
        }
        None => Vec::new(),
    };
    Ok(Body { coordinates, centers, spins, surface, grounds: Vec::new(), is_shell: false, hits: Vec::new() })
}
