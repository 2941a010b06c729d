//! A thing followed by its colours from where it was seen apart from others: through the hands that hold it,
//! as far as the images show it.

use std::collections::BTreeMap;

use lgs_core::linear::{add, sub};
use lgs_data::dataset::Frame;
use rayon::prelude::*;

use super::colors::{Colors, Look};
use super::curve::median_of;
use super::flights::Flight;
use super::silhouettes::Taking;
use super::thresholds::{FINEST_SEARCH, LEAST_CONTRAST_OF_COLORS, LEFT_OF_SCORE};

/// Images of all moments of a set, reduced as they are asked for.
pub(super) struct Moments<'a> {
    frames: Vec<(f32, Vec<&'a Frame>)>,
    background: [f32; 3],
    taking: Taking,
}

impl<'a> Moments<'a> {
    /// The moments of frames at given times, ascending.
    pub(super) fn new(frames: &'a [Frame], times: &[f32], (background, taking): ([f32; 3], Taking)) -> Self {
        let mut by_time: BTreeMap<u32, Vec<&Frame>> = BTreeMap::new();
        frames.iter().for_each(|frame| by_time.entry(frame.time.to_bits()).or_default().push(frame));
        let of = |time: &f32| (*time, by_time.remove(&time.to_bits()).unwrap_or_default());
        Self { frames: times.iter().map(of).collect(), background, taking }
    }

    fn looks(&self, moment: usize) -> Vec<Look> {
        let look = |frame: &&Frame| {
            let factor = self.taking.factor(frame.camera.width);
            let camera = frame.camera.reduced(factor);
            Look { camera, image: frame.composited(self.background).reduced(factor) }
        };
        self.frames[moment].1.par_iter().map(look).collect()
    }

    /// The places of a thing at the moments of its flight and at those around it through which its colours
    /// can be followed, each with its time.
    pub(super) fn followed(&self, flight: &Flight) -> Vec<(f32, [f32; 3])> {
        let mut places: Vec<[f32; 3]> = flight.things.iter().map(|thing| thing.position).collect();
        let mut first = flight.first;
        let known: Vec<Vec<Look>> = (first..first + places.len()).map(|moment| self.looks(moment)).collect();
        let each = known.iter().zip(&places);
        let pairs = each.clone().flat_map(|(looks, &place)| looks.iter().map(move |look| (look, place)));
        let colors = Colors::of(pairs, flight.radius);
        let scores = each.map(|(looks, &place)| colors.score(looks, place, flight.radius));
        let usual = median_of(scores).unwrap_or(0.0);
        tracing::debug!(usual, first, moments = places.len(), "colours of a flight");
        if usual >= LEAST_CONTRAST_OF_COLORS {
            let follower = Follower { colors, radius: flight.radius, least: LEFT_OF_SCORE * usual };
            for moment in first + places.len()..self.frames.len() {
                let last = [places[places.len() - 1], places[places.len() - 2]];
                let Some(next) = follower.next(&self.looks(moment), last) else { break };
                places.push(next);
            }
            for moment in (0..first).rev() {
                let Some(before) = follower.next(&self.looks(moment), [places[0], places[1]]) else { break };
                places.insert(0, before);
                first = moment;
            }
        }
        (first..).zip(places).map(|(moment, place)| (self.frames[moment].0, place)).collect()
    }
}

/// What a thing looks like.
struct Follower {
    colors: Colors,
    radius: f32,
    /// Least score at which it is still seen.
    least: f32,
}

impl Follower {
    /// The place of the thing in the looks at a moment, given its last one and that before.
    fn next(&self, looks: &[Look], [last, before]: [[f32; 3]; 2]) -> Option<[f32; 3]> {
        let starts = [add(last, sub(last, before)), last];
        let found = starts.map(|start| self.climbed(looks, start));
        let best = if found[1].1 > found[0].1 { found[1] } else { found[0] };
        (best.1 >= self.least).then_some(best.0)
    }

    /// The place of the best score around a start, by steps along the axes that are halved where none helps.
    fn climbed(&self, looks: &[Look], start: [f32; 3]) -> ([f32; 3], f32) {
        let mut best = (start, self.colors.score(looks, start, self.radius));
        let mut step = self.radius;
        while step > FINEST_SEARCH * self.radius {
            let neighbor = |direction: usize| {
                let mut place = best.0;
                place[direction / 2] += if direction.is_multiple_of(2) { step } else { -step };
                (place, self.colors.score(looks, place, self.radius))
            };
            let around: Vec<([f32; 3], f32)> = (0..6).into_par_iter().map(neighbor).collect();
            let better = around.into_iter().fold(best, |a, b| if b.1 > a.1 { b } else { a });
            if better.1 > best.1 {
                best = better;
            } else {
                step *= 0.5;
            }
        }
        best
    }
}
