//! The pictures of a run, drawn from its EXR files after the last step.

use glam::{DQuat, DVec2, DVec3};
use rayon::prelude::*;

use super::OutputError;
use super::apparent::Apparent;
use super::clock::Seconds;
use super::colour::ColourScale;
use super::eclipses::Eclipses;
use super::exr::read_exr;
use super::folder::Folder;
use super::frame::FrameHeader;
use super::picture::{Tile, contact_sheet, picture};
use super::report::{FrameEntry, ReportPicture};
use super::sensor_files::first_sensed;
use crate::environment::view_factor::ApparentRadius;
use crate::scene::{Camera, Draw, ImageFile, Scene, Time};
use crate::simulation::image::Image;
use crate::simulation::prepare::Prepared;
use crate::thermal::surroundings::within;

/// Small pictures of several steps.
pub(super) const CONTACT_SHEET: &str = "contact_sheet.png";
const MOST_TILES: usize = 12;
/// Width of a picture on the contact sheet [px].
const TILE_WIDTH: u32 = 320;

/// A frame in the output folder.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
pub(crate) struct WrittenFrame {
    /// Its step.
    pub(crate) step: u32,
    /// Number of the image, where images have times of their own.
    pub(crate) image: Option<u32>,
    /// Smallest and largest temperature [K].
    pub(crate) range: Option<[f32; 2]>,
    /// Smallest and largest brightness temperature [K], where brightness temperatures are drawn.
    pub(crate) apparent: Option<[f32; 2]>,
    /// Whether a sensor reads an end of its range at every pixel of the craft.
    pub(crate) at_end: bool,
}

impl WrittenFrame {
    pub(super) fn file(&self, kind: &str) -> String {
        frame_file(self.step, self.image, kind)
    }

    /// Scene time of the frame [s].
    pub(super) fn time(&self, time: &Time) -> f64 {
        match (&time.draw, self.image) {
            (Draw::Times(times), Some(image)) => times[image as usize],
            _ => f64::from(self.step) * time.step,
        }
    }
}

/// File of a drawn step, or of an image at its own time.
pub(super) fn frame_file(step: u32, image: Option<u32>, kind: &str) -> String {
    format!("frames/{}.{kind}", frame_stem(step, image))
}

/// Start of the names of the files of a drawn step, or of an image at its own time.
pub(crate) fn frame_stem(step: u32, image: Option<u32>) -> String {
    match image {
        None => format!("step_{step:06}"),
        Some(image) => format!("image_{image:06}"),
    }
}

/// Draws a PNG for each frame, on a scale of its own unless the scene wants one scale, and the contact sheet on one scale. `drawn` is called after each picture.
pub(super) fn draw_pictures(
    prepared: &Prepared,
    eclipses: &Eclipses,
    folder: &Folder,
    written: &[WrittenFrame],
    drawn: &(dyn Fn() + Sync),
) -> Result<(Vec<FrameEntry>, Vec<ReportPicture>), OutputError> {
    let scene = &prepared.scene;
    let scale = match scene.colour_range {
        Some(range) => ColourScale::new(range),
        None => ColourScale::covering(written.iter().filter_map(|frame| frame.range)),
    };
    let is_one = scene.colour_range.is_some() || scene.images.one_colour_range;
    let scale_of = |frame: &Image, one: &ColourScale| if is_one { *one } else { ColourScale::fitting(frame) };
    let apparent = scene.images.files.contains(&ImageFile::ApparentPng).then(|| Apparent::new(scene.passband()));
    let apparent_scale = match scene.colour_range {
        Some(range) => ColourScale::new(range),
        None => ColourScale::covering(written.iter().filter_map(|frame| frame.apparent)),
    };
    let name = &scene.name;
    let band = scene.band;
    let times: Vec<f64> = written.iter().map(|one| one.time(&scene.time)).collect();
    let digits = Seconds::between(&times);
    let chosen = |index: usize| {
        let tiles = written.len().min(MOST_TILES);
        (0..tiles).any(|tile| tile * written.len() / tiles == index)
    };
    let pictured: Vec<(FrameEntry, Option<Tile>)> = written
        .par_iter()
        .enumerate()
        .map(|(index, one)| {
            let time = one.time(&scene.time);
            let (frame, header) = read_exr(&folder.file(&one.file("exr")))?;
            let light = eclipses.at(time).map_or(String::new(), |name| format!(", {name}"));
            let name_of_frame = match one.image {
                Some(image) => format!("image {image}, t = {} s", digits.finer(time)),
                None => format!("step {}, t = {} s", one.step, digits.finer(time)),
            };
            let details = format!("{name_of_frame}{light}, band {band}");
            let file = one.file("png");
            folder.write_bytes(&file, &picture(&frame, &scale_of(&frame, &scale), name, &details)?.png()?)?;
            if let Some(apparent) = &apparent {
                let file = format!("frames/{}_apparent.png", frame_stem(one.step, one.image));
                let details = format!("apparent, {details}");
                let frame = apparent.frame(&frame);
                let scale = scale_of(&frame, &apparent_scale);
                folder.write_bytes(&file, &picture(&frame, &scale, name, &details)?.png()?)?;
            }
            let caption = format!("t = {} s{light}", digits.of(time));
            let tile = chosen(index).then(|| Tile::new(&frame, &scale, &caption, TILE_WIDTH)).transpose()?;
            drawn();
            Ok((entry_of(prepared, one, (&frame, &header), file), tile))
        })
        .collect::<Result<_, OutputError>>()?;
    let (frames, tiles): (Vec<FrameEntry>, Vec<Option<Tile>>) = pictured.into_iter().unzip();
    let tiles: Vec<Tile> = tiles.into_iter().flatten().collect();
    if tiles.is_empty() {
        return Ok((frames, Vec::new()));
    }
    let details = format!("{} of {} images", tiles.len(), written.len());
    let png = contact_sheet(&tiles, 4, &scale, name, &details).png()?;
    folder.write_bytes(CONTACT_SHEET, &png)?;
    let title = "Surface temperature through the run".to_owned();
    let sheet = ReportPicture { title, file: CONTACT_SHEET.to_owned(), png };
    let sensed = sensor_picture(scene, folder, written, &frames)?;
    Ok((frames, sensed.into_iter().chain([sheet]).collect()))
}

/// What the report tells of a frame. `picture` is its picture in false colour.
fn entry_of(
    prepared: &Prepared,
    one: &WrittenFrame,
    (frame, header): (&Image, &FrameHeader),
    picture: String,
) -> FrameEntry {
    let time = one.time(&prepared.scene.time);
    let turn = DQuat::from_mat3(&frame.camera_from_body.matrix3);
    // The Z axis of the orbit frame leads to the planet's centre.
    let nadir = header.camera_from_orbit.map(|from_orbit| from_orbit.transform_vector3(DVec3::Z));
    FrameEntry {
        step: one.step,
        time_s: time,
        file: one.file("exr"),
        picture: Some(picture),
        camera_m: frame.camera_from_body.inverse().translation.to_array(),
        camera_turn: [turn.w, turn.x, turn.y, turn.z],
        planet_off_axis_deg: nadir.map(|nadir| nadir.angle_between(DVec3::Z).to_degrees()),
        planet_share: prepared.scene.camera.as_ref().zip(nadir).map(|(camera, nadir)| {
            let planet = ApparentRadius::new(prepared.loads.sky_model().sky(time).distance_ratio);
            planet_share(camera, nadir, planet)
        }),
        at_end_of_range: one.at_end,
    }
}

/// Places along width and height of an image at which the planet is looked for.
const LOOKS: [u32; 2] = [64, 48];

/// Share of an image before which the planet stands. `nadir` leads to its centre, in the axes of the camera.
fn planet_share(camera: &Camera, nadir: DVec3, planet: ApparentRadius) -> f64 {
    let step = DVec2::new(f64::from(camera.width), f64::from(camera.height)) / DVec2::from(LOOKS.map(f64::from));
    let is_planet = |look: &u32| {
        let place = DVec2::new(f64::from(look % LOOKS[0]) + 0.5, f64::from(look / LOOKS[0]) + 0.5);
        let ray = camera.lens.unproject(place * step);
        ray.is_some_and(|ray| within(ray.extend(1.0).normalize(), nadir, planet) >= 0.0)
    };
    let looks = LOOKS[0] * LOOKS[1];
    (0..looks).filter(is_planet).count() as f64 / f64::from(looks)
}

/// What the sensor displays in the middle of a run. `None` without such files.
fn sensor_picture(
    scene: &Scene,
    folder: &Folder,
    written: &[WrittenFrame],
    frames: &[FrameEntry],
) -> Result<Option<ReportPicture>, OutputError> {
    let middle = written.len() / 2;
    let (Some(one), Some(frame), true) =
        (written.get(middle), frames.get(middle), scene.images.files.contains(&ImageFile::DisplayPng))
    else {
        return Ok(None);
    };
    let Some(stem) = first_sensed(scene, &frame_stem(one.step, one.image)) else { return Ok(None) };
    let file = format!("frames/{stem}_{}", ImageFile::DisplayPng.ending());
    let path = folder.file(&file);
    let png = std::fs::read(&path).map_err(|source| OutputError::Read(path, source))?;
    let planet = match frame.planet_share {
        Some(share) if share > 0.0 => format!("before the planet in {:.0} % of the image", 100.0 * share),
        _ => "without the planet".to_owned(),
    };
    let title = format!("The sensor's display at t = {} s, from {:.1} m, {planet}", frame.time_s, frame.range());
    Ok(Some(ReportPicture { title, file, png }))
}
