//! A trained model some of whose Gaussians paths carry, and its part of a file.

use lgs_core::GaussianCloud;

use super::path::{Carried, CarryingPath};
use crate::source::kind::SourceKind;
use crate::source::model::SourceModel;
use crate::tensor_file::{TensorFile, TensorFileError};

/// Name of the times of all paths, one after the other, in a file.
const TIMES: &str = "carried.times";
/// Name of the places at these.
const PLACES: &str = "carried.places";
/// Name of the number of the path that each time belongs to, from 0.
const PATHS: &str = "carried.paths";
/// Name of the free flights: number of the path, from 0, first and last time.
const FLIGHTS: &str = "carried.flights";
/// Name of the angular velocities of what turns: number of the path, from 0, then the vector.
const SPINS: &str = "carried.spins";
/// Name of the canonical centres of all Gaussians, in the file of a model in which anything turns.
const CANONICAL: &str = "carried.canonical";
/// Name of the number of the path that carries each Gaussian, from 1; 0: none does.
const OWNERS: &str = "carried.owners";

/// A model of any kind, some of whose Gaussians paths carry.
pub(in crate::source) struct CarriedSource {
    moved: Box<dyn SourceModel>,
    paths: Vec<CarryingPath>,
    owners: Vec<u32>,
    /// Canonical centres, world units.
    canonical: Vec<[f32; 3]>,
    /// The owners that are in flight; 0 for others.
    in_flight: Vec<u32>,
}

impl CarriedSource {
    /// A model with paths, the number of the path that carries each of its Gaussians, from 1, and their
    /// canonical centres.
    pub(super) fn new(
        moved: Box<dyn SourceModel>,
        paths: Vec<CarryingPath>,
        (owners, canonical): (Vec<u32>, Vec<[f32; 3]>),
    ) -> Self {
        let flies = |owner: u32| owner > 0 && paths[owner as usize - 1].spin == [0.0; 3];
        let in_flight = owners.iter().map(|&owner| if flies(owner) { owner } else { 0 }).collect();
        Self { moved, paths, owners, canonical, in_flight }
    }

    /// The model with the paths that a file has beside it; the model itself where it has none.
    ///
    /// # Errors
    /// If an array is absent, not finite or of another shape, or names a path that there is not.
    pub(in crate::source) fn read_over(
        moved: Box<dyn SourceModel>,
        file: &TensorFile,
    ) -> Result<Box<dyn SourceModel>, TensorFileError> {
        if !file.names().any(|name| name == OWNERS) {
            return Ok(moved);
        }
        let paths = read_paths(file)?;
        let owners = file.indices(OWNERS)?.1.to_vec();
        if owners.len() != moved.len() || owners.iter().any(|&owner| owner as usize > paths.len()) {
            let expected = format!("{} numbers of up to {} paths", moved.len(), paths.len());
            return Err(file.field(OWNERS, &expected, format!("{} numbers", owners.len())));
        }
        // Where nothing turns, canonical centres do not matter, and the file has none.
        let turns = file.names().any(|name| name == SPINS);
        let canonical = if turns { file.rows::<3>(CANONICAL)? } else { vec![[0.0; 3]; owners.len()] };
        if canonical.len() != owners.len() {
            return Err(file.field(
                CANONICAL,
                &format!("{} rows", owners.len()),
                canonical.len().to_string(),
            ));
        }
        Ok(Box::new(Self::new(moved, paths, (owners, canonical))))
    }

    /// What the path that carries each Gaussian, if one does, does to it by a time, and its canonical centre.
    fn carried_by(&self, time: f32) -> impl Iterator<Item = Option<(Carried, [f32; 3])>> {
        let carried: Vec<Carried> = self.paths.iter().map(|path| path.carried(time)).collect();
        let of = move |(&owner, &center): (&u32, &[f32; 3])| {
            (owner > 0).then(|| (carried[owner as usize - 1], center))
        };
        self.owners.iter().zip(&self.canonical).map(of)
    }
}

fn read_paths(file: &TensorFile) -> Result<Vec<CarryingPath>, TensorFileError> {
    let (times, places) = (file.values(TIMES)?.1, file.rows::<4>(PLACES)?);
    let numbers = file.indices(PATHS)?.1;
    let mut paths: Vec<CarryingPath> = Vec::new();
    if times.len() != places.len() || numbers.len() != places.len() {
        let expected = format!("{} rows", times.len());
        return Err(file.field(PLACES, &expected, format!("{} rows", places.len())));
    }
    for ((&time, &[x, y, z, reach]), &number) in times.iter().zip(&places).zip(numbers) {
        if number as usize == paths.len() {
            paths.push(CarryingPath { places: Vec::new(), flights: Vec::new(), reach, spin: [0.0; 3] });
        }
        let count = paths.len();
        match paths.last_mut() {
            Some(path) if path.places.last().is_some_and(|before| before.0 >= time) => {
                return Err(file.field(TIMES, "times of each path that ascend", time.to_string()));
            }
            Some(path) if number as usize + 1 == count => path.places.push((time, [x, y, z])),
            _ => return Err(file.field(PATHS, "numbers in order", format!("{number}"))),
        }
    }
    for [number, first, last] in file.rows::<3>(FLIGHTS)? {
        match paths.get_mut(number as usize) {
            Some(path) if first < last => path.flights.push([first, last]),
            _ => return Err(file.field(FLIGHTS, "flights of paths", format!("{number}, {first} to {last}"))),
        }
    }
    // Files from before things could turn have no such array.
    let spins = if file.names().any(|name| name == SPINS) { file.rows::<4>(SPINS)? } else { Vec::new() };
    for [number, x, y, z] in spins {
        let path = paths.get_mut(number as usize);
        path.ok_or_else(|| file.field(SPINS, "numbers of paths", number.to_string()))?.spin = [x, y, z];
    }
    Ok(paths)
}

impl SourceModel for CarriedSource {
    fn kind(&self) -> SourceKind {
        self.moved.kind()
    }

    fn len(&self) -> usize {
        self.moved.len()
    }

    fn inner(&self) -> Option<&dyn SourceModel> {
        Some(&*self.moved)
    }

    fn cloud_at(&self, time: f32) -> GaussianCloud {
        let mut cloud = self.moved.cloud_at(time);
        let poses = cloud.means.iter_mut().zip(&mut cloud.rotations);
        for ((mean, rotation), carried) in poses.zip(self.carried_by(time)) {
            if let Some((carried, center)) = carried {
                (*mean, *rotation) = (carried.center(center, *mean), carried.rotation(*rotation));
            }
        }
        cloud
    }

    fn positions_at(&self, time: f32) -> Vec<[f32; 3]> {
        let mut positions = self.moved.positions_at(time);
        for (position, carried) in positions.iter_mut().zip(self.carried_by(time)) {
            if let Some((carried, center)) = carried {
                *position = carried.center(center, *position);
            }
        }
        positions
    }

    fn carried(&self) -> &[u32] {
        &self.in_flight
    }

    fn free_flights(&self, thing: u32) -> &[[f32; 2]] {
        let path = (thing as usize).checked_sub(1).and_then(|index| self.paths.get(index));
        path.map_or(&[], |path| path.flights.as_slice())
    }

    fn before(&self, time: f32) -> Option<Box<dyn SourceModel>> {
        let moved = self.moved.before(time)?;
        Some(Box::new(Self::new(moved, self.paths.clone(), (self.owners.clone(), self.canonical.clone()))))
    }

    fn to_tensors(&self) -> TensorFile {
        let mut file = self.moved.to_tensors();
        let (mut times, mut places, mut numbers) = (Vec::new(), Vec::new(), Vec::new());
        for (number, path) in (0..).zip(&self.paths) {
            for &(time, [x, y, z]) in &path.places {
                times.push(time);
                places.extend([x, y, z, path.reach]);
                numbers.push(number);
            }
        }
        file.insert(TIMES, &[times.len()], &times);
        file.insert(PLACES, &[times.len(), 4], &places);
        let numbered = (0_u16..).zip(&self.paths);
        let turning = numbered.clone().filter(|(_, path)| path.spin != [0.0; 3]);
        let spins: Vec<[f32; 4]> =
            turning.map(|(i, path)| [f32::from(i), path.spin[0], path.spin[1], path.spin[2]]).collect();
        let flights: Vec<[f32; 3]> = numbered
            .flat_map(|(number, path)| path.flights.iter().map(move |&[a, b]| [f32::from(number), a, b]))
            .collect();
        file.insert(FLIGHTS, &[flights.len(), 3], flights.as_flattened());
        if !spins.is_empty() {
            file.insert(CANONICAL, &[self.canonical.len(), 3], self.canonical.as_flattened());
            file.insert(SPINS, &[spins.len(), 4], spins.as_flattened());
        }
        file.insert_indices(PATHS, &[numbers.len()], &numbers);
        file.insert_indices(OWNERS, &[self.owners.len()], &self.owners);
        file
    }
}
