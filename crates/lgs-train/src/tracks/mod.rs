//! Paths of moving things, straight from the images, where training would lose them: for sets that show each
//! moment from one or two cameras only, where no renderer can tell depth from size, and for what crosses its
//! own width within a few moments, however many cameras see it.
//!
//! Cameras that stand still give silhouettes: pixels that differ from the camera's median image. With few
//! images of each moment, voxels that the silhouettes around it agree on give a coarse path (dynamic
//! programming over the sequence), and the rays of the blobs along it a fine one: a robust least-squares
//! polynomial. What a path explains is taken out of the silhouettes, and the next one is looked for.
//!
//! With many images of each moment, rays of blobs meet at things that stand apart, moment by moment; those
//! that go on evenly over several moments, and a long way for their size, are in flight. Their colours lead
//! on, before and after, through the hands that hold them.

mod carving;
mod colors;
mod curve;
mod flights;
mod following;
mod isolated;
mod parabola;
mod path;
mod silhouettes;
mod spin;
mod texture;
mod thresholds;

use std::f32::consts::TAU;

use lgs_core::Camera;
use lgs_core::linear::{Mat3, dot, matrix_from_quat, norm, scale, sub};
use lgs_data::dataset::{Frame, SceneBox};

use carving::Votes;
use curve::{Curve, Sighting, median_of};
use flights::{Flight, by_moment, flights};
use following::Moments;
pub use parabola::FreeFlight;
use parabola::smoothed;
use path::Path;
use silhouettes::{Silhouette, Taking, silhouettes};
use thresholds::{
    CLOSING_RADIUS, EXPLAINED_RADII, FEWEST_BLOBS, FIRST_RADIUS, FLIGHT_CLOSING_RADIUS, FLIGHT_WIDTH,
    LARGEST_MISS, LONGEST_GAP, MAX_TRACKS, MOMENTS, SILHOUETTE_WIDTH,
};

/// The path of a moving thing.
#[derive(Clone, Debug, PartialEq)]
pub struct Track {
    path: Path,
    /// Radius of a ball about as large as the thing, world units.
    pub radius: f32,
    /// Number of images that show it whole and apart from others.
    pub sightings: usize,
    /// Median distance, world units, from where these images see it, of the path that they give: the texture
    /// may have corrected it since.
    pub median_miss: f32,
    /// The flights over which it was seen apart from all else and followed a parabola, in the order found.
    pub flights: Vec<FreeFlight>,
    /// Angular velocity in world axes, radians per unit of time, if the thing's texture tells it.
    pub spin: Option<[f32; 3]>,
}

impl Track {
    /// Position at a time, world units; beyond the observed times that of the nearest end.
    #[must_use]
    pub fn position(&self, time: f32) -> [f32; 3] {
        self.path.at(time)
    }

    /// First and last time at which the thing was followed.
    #[must_use]
    pub fn span(&self) -> (f32, f32) {
        self.path.span()
    }

    /// Times, ascending, and places at these, world units, between which the path is about straight.
    #[must_use]
    pub fn places(&self) -> Vec<(f32, [f32; 3])> {
        self.path.places()
    }

    /// How far the thing has turned after a time, if its texture told.
    #[must_use]
    pub fn rotation(&self, elapsed: f32) -> Option<Mat3> {
        let [x, y, z] = scale(self.spin?, 0.5 * elapsed);
        let half = norm([x, y, z]);
        let axis = scale([x, y, z], half.sin() / half.max(f32::MIN_POSITIVE));
        Some(matrix_from_quat([half.cos(), axis[0], axis[1], axis[2]]))
    }

    /// Whether its texture tells that it turns so far that the same side comes round again. Less far, a
    /// network that moves every Gaussian follows it, also where the rate is not quite constant.
    #[must_use]
    pub fn turns_round(&self) -> bool {
        let (first, last) = self.span();
        self.spin.is_some_and(|spin| norm(spin) * (last - first) >= TAU)
    }

    /// Takes over the places of a flight of the same thing, on its parabola if it follows one.
    fn take_over(&mut self, flight: &Flight, times: &[f32]) {
        let Path::Places(places) = &mut self.path else { return };
        let Some(&first) = times.get(flight.first) else { return };
        let start = places.partition_point(|(time, _)| *time < first);
        if places.get(start).is_none_or(|place| place.0 > first) {
            return;
        }
        let end = places.len().min(start + flight.things.len());
        let own = &mut places[start..end];
        own.iter_mut().zip(&flight.things).for_each(|(place, thing)| place.1 = thing.position);
        self.flights.extend(smoothed(own, self.radius));
    }

    /// A track through given positions, for tests.
    #[cfg(test)]
    pub(crate) fn through(moments: &[f32], positions: &[[f32; 3]], radius: f32) -> Option<Self> {
        Some(Self {
            path: Path::Curve(Curve::through(moments, positions)?),
            radius,
            sightings: moments.len(),
            median_miss: 0.0,
            flights: Vec::new(),
            spin: None,
        })
    }

    /// Whether a camera sees the thing at a time along a ray, given by its world direction.
    #[must_use]
    pub fn explains(&self, camera: &Camera, time: f32, direction: [f32; 3]) -> bool {
        let from_eye = sub(self.position(time), camera.center_in_world());
        let depth = dot(from_eye, direction);
        depth > 0.0 && norm(sub(from_eye, scale(direction, depth))) < EXPLAINED_RADII * self.radius
    }
}

/// The paths of things that move in front of cameras that stand still, in the order found; none if the
/// cameras move or too little is seen.
#[must_use]
pub fn find_tracks(frames: &[Frame], background: [f32; 3], bounds: SceneBox) -> Vec<Track> {
    let taking = Taking { width: SILHOUETTE_WIDTH, closing: CLOSING_RADIUS };
    let mut silhouettes = silhouettes(frames, background, taking);
    let mut tracks = Vec::new();
    let times = silhouettes.iter().map(|s| s.time);
    let (first, last) = times.fold((f32::MAX, f32::MIN), |(low, high), t| (low.min(t), high.max(t)));
    if last <= first {
        return tracks;
    }
    let evenly = (0..MOMENTS).map(|i| first + (last - first) * i as f32 / (MOMENTS - 1) as f32);
    let moments: Vec<f32> =
        evenly.filter(|&moment| Votes::reach(&silhouettes, moment, last - first)).collect();
    while tracks.len() < MAX_TRACKS {
        let coarse = Votes::new(&silhouettes, bounds).path(&moments);
        let start = Curve::through(&moments, &coarse)
            .map(|curve| curve.refined(&silhouettes, FIRST_RADIUS * bounds.half_side));
        let Some(track) =
            start.flatten().and_then(|(curve, sightings)| confirmed(curve, &sightings, &silhouettes))
        else {
            break;
        };
        silhouettes.iter_mut().for_each(|silhouette| remove_explained(&track, silhouette));
        tracks.push(track);
    }
    tracks.into_iter().map(|track| with_spin(track, frames, background)).collect()
}

/// The track with the spin that its texture tells, and path and radius as these fit it.
fn with_spin(track: Track, frames: &[Frame], background: [f32; 3]) -> Track {
    let Path::Curve(curve) = &track.path else { return track };
    match spin::turning(frames, background, curve, track.radius) {
        Some(ball) => Track {
            path: Path::Curve(ball.curve),
            radius: ball.radius,
            spin: Some(ball.spin.into()),
            ..track
        },
        None => track,
    }
}

/// The paths of things that fly in front of cameras that stand still and take their images together: where
/// they stand apart and go far for their size, and before and after as far as their colours can be followed.
/// In the order of the length of their flights; none if the cameras move or too few see a moment.
#[must_use]
pub fn find_flights(frames: &[Frame], background: [f32; 3]) -> Vec<Track> {
    let taking = Taking { width: FLIGHT_WIDTH, closing: FLIGHT_CLOSING_RADIUS };
    let silhouettes = silhouettes(frames, background, taking);
    let moments = by_moment(&silhouettes);
    let times: Vec<f32> = moments.iter().map(|(time, _)| *time).collect();
    let images = Moments::new(frames, &times, (background, taking));
    let mut tracks: Vec<Track> = Vec::new();
    for flight in flights(&moments) {
        if let Some(track) = tracks.iter_mut().find(|track| passes(track, &flight, &times)) {
            track.take_over(&flight, &times);
        } else if tracks.len() < MAX_TRACKS {
            let mut track = flown(&flight, images.followed(&flight));
            track.iter_mut().for_each(|track| track.take_over(&flight, &times));
            tracks.extend(track);
        }
    }
    tracks
}

/// Whether a track is that of a flight's thing: it passes through most of its places.
fn passes(track: &Track, flight: &Flight, times: &[f32]) -> bool {
    let passed = |(time, thing): (&f32, &isolated::Isolated)| {
        norm(sub(track.position(*time), thing.position)) < track.radius.max(thing.radius)
    };
    let count = times[flight.first..].iter().zip(&flight.things).filter(|&place| passed(place)).count();
    2 * count > flight.things.len()
}

/// The track of a flight's thing through places at times.
fn flown(flight: &Flight, places: Vec<(f32, [f32; 3])>) -> Option<Track> {
    let median_miss = median_of(flight.things.iter().map(|thing| thing.miss))?;
    let sightings = flight.things.iter().map(|thing| thing.views).sum();
    tracing::debug!(sightings, radius = flight.radius, median_miss, moments = places.len(), "flight");
    let (path, radius, flights) = (Path::Places(places), flight.radius, Vec::new());
    Some(Track { path, radius, sightings, median_miss, flights, spin: None })
}

/// The path as a track, if enough blobs confirm it.
fn confirmed(curve: Curve, sightings: &[Sighting], silhouettes: &[Silhouette]) -> Option<Track> {
    let radius = median_of(sightings.iter().map(|s| s.radius))?;
    let median_miss = median_of(sightings.iter().map(|s| s.distance))?;
    let (first, last) = curve.span;
    let mut times: Vec<f32> =
        sightings.iter().map(|s| silhouettes[s.silhouette].time).chain([first, last]).collect();
    times.sort_by(f32::total_cmp);
    let gap = times.windows(2).map(|pair| pair[1] - pair[0]).fold(0.0, f32::max);
    let (start, end) = (curve.at(first), curve.at(last));
    tracing::debug!(sightings = sightings.len(), radius, median_miss, gap, ?start, ?end, "track");
    let is_accepted = sightings.len() >= FEWEST_BLOBS
        && gap <= LONGEST_GAP * (last - first)
        && median_miss <= LARGEST_MISS * radius;
    let path = Path::Curve(curve);
    let flights = Vec::new();
    is_accepted.then_some(Track {
        path,
        radius,
        sightings: sightings.len(),
        median_miss,
        flights,
        spin: None,
    })
}

/// Removes the part of a silhouette that a track explains.
fn remove_explained(track: &Track, silhouette: &mut Silhouette) {
    let Silhouette { camera, time, inside, blobs } = silhouette;
    let width = camera.width as usize;
    for (i, covered) in inside.iter_mut().enumerate() {
        let center = [(i % width) as f32 + 0.5, (i / width) as f32 + 0.5];
        *covered = *covered && !track.explains(camera, *time, camera.ray_direction_in_world(center));
    }
    blobs.retain(|blob| !track.explains(camera, *time, blob.direction));
}

#[cfg(test)]
mod flight_tests;
#[cfg(test)]
pub(crate) mod testing;
#[cfg(test)]
mod tests;
