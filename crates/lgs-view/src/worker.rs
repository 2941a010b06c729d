//! The thread that draws.

use std::time::Instant;

use image::codecs::jpeg::JpegEncoder;
use image::codecs::png::PngEncoder;
use image::{ExtendedColorType, ImageEncoder, ImageError};
use lgs_core::Image;

use crate::desk::{Desk, Job, Next, Page};
use crate::draw::{draw, paths, pick};
use crate::exhibit::Exhibit;
use crate::motions::Motions;
use crate::protocol::{Answer, FrameHeader, FrameRequest, Model, Quality};
use crate::slice::slice;
use crate::subject::Subject;
use crate::thresholds::{MOVING_QUALITY, PATH_TIMES, PATHS, PICTURE_REST, STILL_QUALITY};

/// Draws what is asked for until the desk closes.
pub(crate) fn work(exhibit: &Exhibit, desk: &Desk, cache_bytes: usize) {
    let (mut subject, mut number) = exhibit.current();
    let mut motions = Motions::new(&subject.scene, cache_bytes);
    let mut has_more = true;
    loop {
        // Idle times belong to training where there is some.
        match desk.next(has_more && !exhibit.is_training()) {
            Next::Closed => return,
            Next::Idle => has_more = motions.prepare(),
            Next::Job(page, job) => {
                let (begun, (newest, newest_number)) = (Instant::now(), exhibit.current());
                if newest_number != number {
                    (subject, number) = (newest, newest_number);
                    motions = Motions::new(&subject.scene, cache_bytes);
                }
                has_more = true;
                done(&subject, desk, &mut motions, (page, job));
                if exhibit.is_training() {
                    exhibit.served(begun.elapsed());
                    std::thread::sleep(PICTURE_REST * begun.elapsed());
                }
            }
        }
    }
}

/// Does a job, or a part of it.
fn done(subject: &Subject, desk: &Desk, motions: &mut Motions, (page, job): (Page, Job)) {
    let Some(outbox) = desk.outbox(page) else { return };
    match job {
        Job::Frame(request) => match frame(subject, motions, &request) {
            Ok((bytes, rolling)) => {
                outbox.frame(request.pane, bytes);
                if rolling {
                    desk.put_back(page, Job::Frame(request));
                }
            }
            Err(reason) => outbox.answer(&refused(request.pane, request.serial, reason)),
        },
        Job::Pick(view, pixel) => outbox.answer(&match pick(subject, motions, &view, pixel) {
            Ok(object) => Answer::Picked { serial: view.serial, object },
            Err(reason) => refused(view.pane, view.serial, reason),
        }),
        Job::Slice(view, object) => outbox.answer(&match slice(subject, motions, &view, object) {
            Ok(slice) => Answer::Slice { serial: view.serial, object, slice },
            Err(reason) => refused(view.pane, view.serial, reason),
        }),
        Job::Paths(serial, edits) => {
            // Paths need the whole rollout: until it is there, pictures go first.
            if motions.prepare_for(&edits) {
                desk.put_back(page, Job::Paths(serial, edits));
                return;
            }
            outbox.answer(&match paths(subject, motions, &edits, (PATHS, PATH_TIMES)) {
                Ok(found) => {
                    Answer::Paths { serial, times: found.times, objects: found.objects, points: found.points }
                }
                Err(reason) => refused(0, serial, reason),
            });
        }
    }
}

fn refused(pane: usize, serial: u64, reason: String) -> Answer {
    Answer::Refused { pane, serial, reason }
}

/// The message of a picture, and whether a later one follows: the length of the header as four bytes, low
/// byte first, the header, and the bytes of the picture.
fn frame(
    subject: &Subject,
    motions: &mut Motions,
    request: &FrameRequest,
) -> Result<(Vec<u8>, bool), String> {
    let begun = Instant::now();
    let drawn = draw(subject, motions, request)?;
    let (picture, mime) = encoded(&drawn.image, request).map_err(|error| error.to_string())?;
    let shown = if request.model == Model::Lagrangian { motions.shown(&request.edits)? } else { Vec::new() };
    let trust = subject.trust(request.model, &shown);
    let header = FrameHeader {
        pane: request.pane,
        serial: request.serial,
        time: drawn.time,
        rolling: drawn.rolling,
        untrusted: trust.untrusted_at(drawn.time),
        trusted: trust.common(),
        size: [drawn.image.width, drawn.image.height],
        mime,
        milliseconds: 1e3 * begun.elapsed().as_secs_f32(),
        kept: motions.memory(),
    };
    let header = serde_json::to_vec(&header).map_err(|error| error.to_string())?;
    let length = u32::try_from(header.len()).map_err(|error| error.to_string())?;
    Ok(([&length.to_le_bytes(), header.as_slice(), &picture].concat(), drawn.rolling))
}

fn encoded(image: &Image, request: &FrameRequest) -> Result<(Vec<u8>, &'static str), ImageError> {
    let (pixels, mut bytes) = (image.to_rgb8(), Vec::new());
    let size = (image.width, image.height, ExtendedColorType::Rgb8);
    let mut jpeg = |quality| {
        JpegEncoder::new_with_quality(&mut bytes, quality).write_image(&pixels, size.0, size.1, size.2)
    };
    let moving = request.jpeg.unwrap_or(MOVING_QUALITY).clamp(1, 100);
    let mime = match request.quality {
        Quality::Moving => jpeg(moving).map(|()| "image/jpeg"),
        Quality::Still => jpeg(STILL_QUALITY).map(|()| "image/jpeg"),
        Quality::Exact => {
            PngEncoder::new(&mut bytes).write_image(&pixels, size.0, size.1, size.2).map(|()| "image/png")
        }
    }?;
    Ok((bytes, mime))
}
