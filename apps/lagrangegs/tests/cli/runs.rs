//! `eval`, `render` and `export` on a run made by hand.

use crate::program::{call, falling, falling_alone, files, json_file};

#[test]
fn metrics_follow_the_schema_and_are_kept_in_the_run() {
    let (_dir, _data, run) = falling();
    let metrics = call("eval {run} --json", &[("run", &run)]).json();
    assert_eq!(metrics["schema"], 1);
    for split in ["train", "val", "test", "long", "past"] {
        let score = &metrics["splits"][split];
        assert!(score["source"].is_null(), "there is no source model");
        for key in ["psnr", "psnr_of_mean_mse", "psnr_foreground", "ssim"] {
            assert!(score["lagrangian"][key].is_f64(), "{split} {key}: {score}");
        }
        assert!(score["lagrangian"]["lpips_vgg"].is_null());
        assert_eq!(score["lagrangian"]["frames"], metrics["frames"][split].as_array().expect("frames").len());
    }
    let physics = &metrics["physics"];
    let negated = physics["cycle_error"]["negated_step"].as_f64().expect("cycle error");
    assert!((negated - 0.0263).abs() < 0.001, "{negated}");
    assert!(
        physics["cycle_error"]["exact"].is_f64()
            && physics["extent_ratio_max"].is_f64()
            && physics["energy_drift"].is_f64()
    );
    assert!((physics["fall_time_exponent"]["slope"].as_f64().expect("slope") + 0.5).abs() < 0.01);
    assert!(physics["trajectory_error"]["2.25"].is_f64() && physics["trajectory_error"]["-0.75"].is_f64());
    assert!(physics["potential"].is_object(), "the truth has gravity");
    let object = &physics["objects"][0];
    assert!(object["terms"].is_array() && object["networks"].is_boolean(), "{object}");
    assert!(object["verdict"].is_string() && object["driven"].is_boolean(), "{object}");
    assert!(physics["bands"]["coverage_90"].is_object());
    assert!(metrics["cost"]["train_secs"].is_null(), "nothing was trained");
    let kept = json_file(&run.join("metrics.json"));
    assert_eq!(kept["splits"], metrics["splits"]);
}

#[test]
fn points_without_a_law_are_a_truth_for_all_that_needs_none() {
    let (_dir, data, run) = falling();
    let paths: [(&str, &std::path::Path); 2] = [("run", &run), ("data", &data)];
    let with_law = call("eval {run} --json", &paths).json();
    std::fs::remove_file(data.join("scene.json")).expect("remove");
    assert!(call("info {data}", &paths).ok().contains("ground truth"));
    let without = call("eval {run} --json", &paths).json();
    let of = |metrics: &serde_json::Value, key: &str| metrics["physics"][key].clone();
    assert!(of(&without, "trajectory_error")["1.0"].is_f64(), "{without}");
    assert_eq!(of(&without, "trajectory_error"), of(&with_law, "trajectory_error"));
    assert!(of(&with_law, "potential").is_object() && of(&without, "potential").is_null());
}

#[test]
fn a_report_needs_metrics_and_stands_alone_after_them() {
    let (_dir, data, run) = falling();
    call("report {run}", &[("run", &run)]).fails(&run, &["has not been evaluated", "eval"]);
    call("eval {run}", &[("run", &run)]).ok();
    let names = files(&run.join("figures"));
    for name in
        ["psnr", "trajectories", "potential", "beta-sweep", "time-reversal", "extrapolation", "partition"]
    {
        assert!(
            names.contains(&format!("{name}.svg")) && names.contains(&format!("{name}.png")),
            "{name}: {names:?}"
        );
    }
    let page = std::fs::read(run.join("report.html")).expect("page");
    std::fs::remove_file(run.join("report.html")).expect("remove");
    let stdout = call("report {run}", &[("run", &run)]).ok();
    assert!(stdout.contains("report.html"), "{stdout}");
    assert_eq!(
        std::fs::read(run.join("report.html")).expect("page"),
        page,
        "the same page from the metrics alone"
    );
    // Without its dataset the run still has what its own scene shows.
    std::fs::remove_dir_all(&data).expect("remove");
    call("report {run}", &[("run", &run)]).ok();
    let names = files(&run.join("figures"));
    assert!(
        names.contains(&"potential.png".to_owned()) && !names.contains(&"extrapolation.png".to_owned()),
        "{names:?}"
    );
    std::fs::write(run.join("metrics.json"), "[]").expect("damage");
    call("report {run}", &[("run", &run)]).fails(&run.join("metrics.json"), &["damaged"]);
}

#[test]
fn the_table_shows_the_splits_asked_for() {
    let (_dir, _, run) = falling();
    let table = call("eval {run} --split test,past", &[("run", &run)]).ok();
    let firsts: Vec<&str> = table.lines().filter_map(|line| line.split_whitespace().next()).collect();
    assert!(firsts.contains(&"test") && firsts.contains(&"past") && !firsts.contains(&"train"), "{table}");
    assert!(table.contains("cycle error"), "{table}");
}

#[test]
fn frames_come_one_per_time_with_a_sheet() {
    let (dir, run) = falling_alone();
    let out = dir.path().join("a/b/out");
    let paths: [(&str, &std::path::Path); 2] = [("run", &run), ("out", &out)];
    call("render {run} --times -0.75:2.25:0.75 --camera orbit --out {out} --size 40", &paths).ok();
    let names = files(&out);
    assert_eq!(names.len(), 7, "{names:?}");
    assert_eq!(names[0], "0000_t-0.7500.png");
    let image = image::open(out.join(&names[0])).expect("a PNG");
    assert_eq!((image.width(), image.height()), (40, 40));
    // A second, shorter call leaves no frame of the first one, and no file of the user's goes.
    std::fs::write(out.join("notes.txt"), "mine").expect("write");
    let edited = "--potential-scale 0.25 --velocity-scale -1 --size 40";
    call(&format!("render {{run}} --times=0.5,1 --camera orbit:30 {edited} --out {{out}}"), &paths).ok();
    assert_eq!(
        files(&out),
        ["0000_t+0.5000.png", "0001_t+1.0000.png", "frames.json", "notes.txt", "sheet.png"]
    );
    let list = json_file(&out.join("frames.json"));
    assert_eq!(list["potential_scale"], 0.25);
}

#[test]
fn a_view_of_the_dataset_is_found_by_its_name() {
    let (dir, data, run) = falling();
    let out = dir.path().join("out");
    let transforms = json_file(&data.join("transforms_val.json"));
    let name =
        transforms["frames"][0]["file_path"].as_str().expect("file_path").trim_start_matches("./").to_owned();
    call(&format!("render {{run}} --times 0 --camera {name} --out {{out}}"), &[("run", &run), ("out", &out)])
        .ok();
    assert_eq!(image::open(out.join("0000_t+0.0000.png")).expect("a PNG").width(), 24);
    let done =
        call("render {run} --times 0 --camera nowhere/r_9 --out {out}", &[("run", &run), ("out", &out)]);
    done.fails(&run, &["nowhere/r_9", "orbit"]);
    std::fs::rename(&data, dir.path().join("moved")).expect("moved");
    call(&format!("render {{run}} --times 0 --camera {name} --out {{out}}"), &[("run", &run), ("out", &out)])
        .fails(&data, &[&name, "absent", "--data"]);
}

#[test]
fn exports_have_the_same_order_and_count_at_every_time() {
    use lagrangegs::lgs_data::ply::read_ply;
    let (dir, run) = falling_alone();
    let out = dir.path().join("out");
    call("export {run} --times 0,1 --format ply --out {out}", &[("run", &run), ("out", &out)]).ok();
    assert_eq!(files(&out), ["frame0001.ply", "frame0002.ply", "frames.json"]);
    let (a, b) = (
        read_ply(&out.join("frame0001.ply")).expect("ply"),
        read_ply(&out.join("frame0002.ply")).expect("ply"),
    );
    assert_eq!((a.len(), b.len()), (67, 67));
    assert_eq!(a.means[..3], b.means[..3], "static Gaussians come first and stay");
    for (p, q) in a.means[3..].iter().zip(&b.means[3..]) {
        assert!((p[0] - q[0]).abs() < 1e-4 && (p[2] - q[2] - 1.01).abs() < 1e-3, "{p:?} {q:?}");
    }
}

#[test]
fn rendering_twice_gives_the_same_bytes_for_any_number_of_threads() {
    let (dir, run) = falling_alone();
    let render = |threads: &str| {
        let out = dir.path().join(threads);
        let status = std::process::Command::new(env!("CARGO_BIN_EXE_lagrangegs"))
            .args([
                "render",
                &run.display().to_string(),
                "--times",
                "0:2:0.5",
                "--size",
                "48",
                "--out",
                &out.display().to_string(),
            ])
            .env("RAYON_NUM_THREADS", threads)
            .output()
            .expect("the program starts");
        assert!(status.status.success());
        files(&out).into_iter().map(|name| std::fs::read(out.join(name)).expect("file")).collect::<Vec<_>>()
    };
    assert_eq!(render("1"), render("3"));
}
