//! Prints the paths that the silhouettes of a dataset give: `find_tracks DATA`.

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
    for track in
        lgs_train::tracks::find_tracks(dataset.split("train"), dataset.background, dataset.scene_box())
    {
        println!(
            "radius {:.3}, {} sightings, median miss {:.4}, spin {:?}",
            track.radius, track.sightings, track.median_miss, track.spin
        );
        for i in 0..=10 {
            let time = 0.075 * i as f32;
            println!("  {time:.3} {:?}", track.position(time));
        }
    }
    Ok(())
}
