//! Prints the paths that the silhouettes of a dataset give: `find_tracks DATA [flights]`, those of sets with
//! few images of each moment, or of what flies in sets with many.

use std::path::PathBuf;

use lgs_data::dataset::{Dataset, LoadOptions};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    tracing_subscriber::fmt().with_env_filter("lgs_train=debug").with_writer(std::io::stderr).init();
    let root: PathBuf = std::env::args().nth(1).ok_or("usage: find_tracks DATA")?.into();
    let dataset = Dataset::load(
        &root,
        &LoadOptions { splits: Some(vec!["train".into()]), ..LoadOptions::default() },
        &|_, _| (),
    )?;
    let (frames, background) = (dataset.split("train"), dataset.background);
    let tracks = match std::env::args().nth(2).as_deref() {
        Some("flights") => lgs_train::tracks::find_flights(frames, background),
        _ => lgs_train::tracks::find_tracks(frames, background, dataset.scene_box()),
    };
    for track in tracks {
        let (first, last) = track.span();
        println!(
            "radius {:.3}, {} sightings, median miss {:.4}, spin {:?}, from {first:.3} to {last:.3}",
            track.radius, track.sightings, track.median_miss, track.spin
        );
        for flight in &track.flights {
            println!("  {flight:?}");
        }
        for i in 0..=20 {
            let time = first + 0.05 * i as f32 * (last - first);
            println!("  {time:.3} {:?}", track.position(time));
        }
    }
    Ok(())
}
