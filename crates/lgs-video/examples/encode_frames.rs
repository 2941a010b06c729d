//! A video of a folder's PNG images in the order of their names:
//! `cargo run --release -p lgs-video --features av1 --example encode_frames FOLDER FILE.mp4`.

use std::path::{Path, PathBuf};

use lgs_core::Image;
use lgs_video::{Encoder, VideoFormat, VideoSpec};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let [folder, file] = &words[..] else { return Err("two paths: FOLDER FILE".into()) };
    let format = VideoFormat::of(Path::new(file)).ok_or("a file ends in .mp4, .webm or .gif")?;
    let mut paths: Vec<PathBuf> =
        std::fs::read_dir(folder)?.map(|entry| Ok(entry?.path())).collect::<std::io::Result<_>>()?;
    paths.retain(|path| path.extension().is_some_and(|ending| ending == "png"));
    paths.retain(|path| path.file_stem().is_some_and(|name| name != "sheet"));
    paths.sort();
    let first = read(paths.first().ok_or("no images")?)?;
    let spec = VideoSpec { format, width: first.width, height: first.height, frames_per_second: 25 };
    let begun = std::time::Instant::now();
    let mut video = lgs_video::begin(spec, Encoder::BuiltIn)?;
    for path in &paths {
        video.push(&read(path)?)?;
    }
    let bytes = video.finish()?;
    std::fs::write(file, &bytes)?;
    let rate = paths.len() as f64 / begun.elapsed().as_secs_f64();
    println!("{} frames, {rate:.1} per second with reading, {} bytes", paths.len(), bytes.len());
    Ok(())
}

fn read(path: &Path) -> Result<Image, image::ImageError> {
    let image = image::open(path)?.to_rgb8();
    let (width, height) = image.dimensions();
    let pixels = image.pixels().map(|pixel| pixel.0.map(|value| f32::from(value) / 255.0)).collect();
    Ok(Image { width, height, pixels })
}
