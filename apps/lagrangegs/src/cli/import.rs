//! `lagrangegs import`.

use std::path::PathBuf;

use anyhow::{Result, bail};
use lgs_data::dataset::{CaptureNoise, DatasetFormat, ImportOptions, ImportRules, ImportSize, import};
use lgs_data::files::folder_of;

use super::failure::At;
use super::output;
use super::progress::Task;
use super::run::{absent_images, dataset_format};

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// Dataset in any format
    data: PathBuf,
    /// Folder to write, new or empty
    out: PathBuf,
    /// Format of the dataset [default: detected]
    #[arg(long, value_name = "NAME", value_parser = dataset_format)]
    format: Option<DatasetFormat>,
    /// Width of the images, pixels [default: as they are]
    #[arg(long, value_name = "PX", conflicts_with = "reduce", value_parser = at_least_one())]
    size: Option<u32>,
    /// Make images smaller by this factor, each way
    #[arg(long, value_name = "N", value_parser = at_least_one())]
    reduce: Option<u32>,
    /// Take only times from A to below B, which become 0 and 1
    #[arg(long, value_name = "A:B", value_parser = span)]
    times: Option<[f32; 2]>,
    /// Take one of N moments
    #[arg(long, value_name = "N", value_parser = positive)]
    every: Option<usize>,
    /// Cameras held out as `test`, by name or number
    #[arg(long, value_name = "NAME,…", value_delimiter = ',')]
    test_cameras: Vec<String>,
    /// Cameras held out as `val`
    #[arg(long, value_name = "NAME,…", value_delimiter = ',')]
    val_cameras: Vec<String>,
    /// Hold one of N images out as `test`
    #[arg(long, value_name = "N", value_parser = positive)]
    test_every: Option<usize>,
    /// Hold all images after this time out as `test`
    #[arg(long, value_name = "T", allow_hyphen_values = true)]
    test_after: Option<f32>,
    /// Leave out images that are listed but absent, and count them
    #[arg(long)]
    skip_missing: bool,
    /// Put noise on the training cameras, pixels of root mean square: for trying the refinement of poses
    #[arg(long, value_name = "PX", default_value_t = 0.0)]
    camera_noise: f32,
    /// Change the exposure of training cameras by up to this fraction either way
    #[arg(long, value_name = "X", default_value_t = 0.0)]
    exposure_noise: f32,
    /// Draws the noise
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Print one JSON document instead of text
    #[arg(long)]
    json: bool,
}

fn at_least_one() -> impl clap::builder::TypedValueParser<Value = u32> {
    clap::value_parser!(u32).range(1..)
}

fn positive(text: &str) -> Result<usize, String> {
    text.parse().ok().filter(|&count| count > 0).ok_or_else(|| "expected a number of 1 or more".to_owned())
}

fn span(text: &str) -> Result<[f32; 2], String> {
    let number = |text: &str| text.trim().parse::<f32>().ok().filter(|v| v.is_finite());
    let ends = text.split_once(':').and_then(|(a, b)| Some([number(a)?, number(b)?]));
    ends.filter(|[a, b]| a < b).ok_or_else(|| "expected A:B with A below B".to_owned())
}

pub(super) fn run(args: &Args) -> Result<()> {
    if !args.data.exists() {
        bail!("there is no such file or folder: {}", args.data.display());
    }
    output::refuse_inside_dataset(folder_of(&args.out))?;
    let done = {
        let task = Task::new("images", 0);
        import(&args.data, &args.out, &args.options(), &|done, total| task.count(done, total))
            .at(&args.data)?
    };
    done.remarks.iter().for_each(|remark| tracing::warn!("{remark}"));
    output::warn_of_absent(done.absent, &args.data);
    if args.json {
        let splits: serde_json::Map<_, _> =
            done.splits.iter().map(|(n, c)| (n.clone(), (*c).into())).collect();
        return output::print_json(&serde_json::json!({ "splits": splits, "absent": done.absent }));
    }
    let splits: Vec<String> = done.splits.iter().map(|(name, count)| format!("{name} {count}")).collect();
    output::print(&format!("{} ({})\n", args.out.display(), splits.join(", ")))
}

impl Args {
    fn options(&self) -> ImportOptions {
        let size = match (self.size, self.reduce) {
            (Some(width), _) => ImportSize::Width(width),
            (None, Some(factor)) => ImportSize::Reduced(factor),
            (None, None) => ImportSize::Native,
        };
        let rules = ImportRules {
            times: self.times,
            every: self.every,
            val_cameras: self.val_cameras.clone(),
            test_cameras: self.test_cameras.clone(),
            test_every: self.test_every,
            test_after: self.test_after,
        };
        let noise =
            CaptureNoise { camera: self.camera_noise, exposure: self.exposure_noise, seed: self.seed };
        ImportOptions { format: self.format, absent: absent_images(self.skip_missing), size, rules, noise }
    }
}
